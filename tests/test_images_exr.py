"""OpenEXR in and out: against the official package's other interface, which reads and writes whole images."""

import os
import sys

import numpy as np
import pytest

from iccbrdf.errors import InputError, LimitError, UnsupportedError, UsageError
from iccbrdf.images import Block, ImageSource
from iccbrdf.images.exr import create_exr, open_exr

OpenEXR = pytest.importorskip("OpenEXR", reason="the extra exr is not installed")

NAMES = ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z")
HEIGHT, WIDTH = 75, 41


def picture(channels=10):
    return np.random.default_rng(0).normal(size=(HEIGHT, WIDTH, channels)).astype(np.float32)


def write(path, data, names=NAMES, **options):
    options = {"samples": "real", **options}
    with create_exr(path, *data.shape[:2], names, **options) as sink:
        for y in range(0, len(data), 20):
            for x in (0, 30):
                sink.write(Block(y, x, data[y : y + 20, x : x + (30 if x == 0 else 11)]))
    return sink


def read(path, samples=None, **options):
    with open_exr(path, samples) as source:
        data = np.empty((source.height, source.width, source.channels), np.float32)
        for place in source.places(**options):
            y0, x0, block = source.read(place)
            data[y0 : y0 + block.shape[0], x0 : x0 + block.shape[1]] = block
        return source, data


def by_package(path, channels, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    with OpenEXR.File(header, dict(channels)) as file:
        file.write(str(path))


def test_the_package_reads_what_was_written(tmp_path):
    data = picture()
    write(tmp_path / "a.exr", data)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        stored = file.channels()
        assert sorted(stored) == sorted(NAMES)
        for i, name in enumerate(NAMES):
            assert stored[name].pixels.dtype == np.float32
            np.testing.assert_array_equal(stored[name].pixels, data[:, :, i])


@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"])
def test_what_the_package_wrote_is_read(tmp_path, compression):
    planes = {name: np.ascontiguousarray(picture()[:, :, i]) for i, name in enumerate(NAMES)}
    by_package(tmp_path / "a.exr", planes, compression=getattr(OpenEXR, f"{compression}_COMPRESSION"))
    source, data = read(tmp_path / "a.exr", max_pixels=WIDTH * 32)
    assert source.names == tuple(sorted(NAMES))
    assert source.samples == "real"
    for i, name in enumerate(source.names):
        np.testing.assert_array_equal(data[:, :, i], planes[name])


def test_order_names_and_meaning_come_back(tmp_path):
    names = ("n.z", "m", "X", "a")
    data = picture(4)
    for samples in ("real", "device"):
        write(tmp_path / "a.exr", data, names, samples=samples, overwrite=True)
        source, found = read(tmp_path / "a.exr")
        assert (source.names, source.samples) == (names, samples)
        np.testing.assert_array_equal(found, data)
    checked: ImageSource = source
    assert (checked.height, checked.width, checked.channels) == (HEIGHT, WIDTH, 4)
    with pytest.raises(InputError, match="declared as 'real', but the file says 'device'"):
        open_exr(tmp_path / "a.exr", "real")


def test_half(tmp_path):
    data = np.float32([[[0.1, -2.5, 65504], [np.nan, np.inf, 7e4]]])
    with create_exr(tmp_path / "a.exr", 1, 2, "XYZ", samples="real", dtype="float16") as sink:
        sink.write(Block(0, 0, data))
    assert sink.clipped == 1
    _, found = read(tmp_path / "a.exr")
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(found, data.astype(np.float16))


def test_a_data_window_elsewhere(tmp_path):
    window = (np.array([5, -3], np.int32), np.array([5 + WIDTH - 1, -3 + HEIGHT - 1], np.int32))
    plane = picture(1)[:, :, 0].copy()
    by_package(tmp_path / "a.exr", {"m": plane}, dataWindow=window, displayWindow=window)
    source, found = read(tmp_path / "a.exr", max_pixels=1)
    assert (source.height, source.width) == (HEIGHT, WIDTH)
    np.testing.assert_array_equal(found[:, :, 0], plane)


def test_files_that_are_none(tmp_path):
    write(tmp_path / "a.exr", picture())
    whole = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "short.exr").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.exr").write_bytes(b"hello")
    for name, message in (
        ("no.exr", "no.exr: cannot be read"),
        ("text.exr", "cannot be read as OpenEXR"),
        ("short.exr", "short.exr"),
    ):
        with pytest.raises(InputError, match=message):
            open_exr(tmp_path / name)
    # Noise is stored as it is, but what is compressed has a checksum.
    ramp = np.linspace(0, 1, picture().size, dtype=np.float32).reshape(picture().shape)
    write(tmp_path / "damaged.exr", ramp)
    damaged = bytearray((tmp_path / "damaged.exr").read_bytes())
    damaged[len(damaged) // 2 : len(damaged) // 2 + 400] = bytes(400)
    (tmp_path / "damaged.exr").write_bytes(damaged)
    with pytest.raises(InputError, match=r"damaged\.exr"):
        read(tmp_path / "damaged.exr")


def test_refused(tmp_path, monkeypatch):
    many = {f"c{i}": np.zeros((2, 2), np.float32) for i in range(257)}
    by_package(tmp_path / "many.exr", many)
    with pytest.raises(LimitError, match="257 channels, expected 1 to 256"):
        open_exr(tmp_path / "many.exr")
    by_package(tmp_path / "wide.exr", {"m": np.zeros((1, 300_000), np.float32)})
    with pytest.raises(LimitError, match="lines of 300000 pixels"):
        open_exr(tmp_path / "wide.exr")
    half_size = OpenEXR.Channel("m", np.zeros((4, 4), np.float32), 2, 2)
    window = (np.array([0, 0], np.int32), np.array([7, 7], np.int32))
    by_package(tmp_path / "sub.exr", {"m": half_size}, dataWindow=window, displayWindow=window)
    with pytest.raises(UnsupportedError, match="'m' is subsampled"):
        open_exr(tmp_path / "sub.exr")
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(UsageError, match=r"pip install iccbrdf\[exr\]"):
        open_exr(tmp_path / "wide.exr")


def write_one_block(path, block, names=("a", "b")):
    with create_exr(path, 40, 3, names, samples="real") as sink:
        sink.write(block)


def test_only_whole_files_appear(tmp_path):
    path = tmp_path / "a.exr"
    with pytest.raises(UsageError, match="3 pixels were written to an image of 40 x 3"):
        write_one_block(path, Block(0, 0, np.zeros((1, 3, 2), np.float32)))
    with pytest.raises(UsageError, match="row 32 came before"):
        write_one_block(path, Block(32, 0, np.zeros((8, 3, 2), np.float32)))
    with pytest.raises(UsageError, match="different names"):
        write_one_block(path, None, ("a", "a"))
    with pytest.raises(UsageError, match="does not fit"):
        write_one_block(path, Block(0, 0, np.zeros((1, 3, 1), np.float32)))
    assert os.listdir(tmp_path) == []
