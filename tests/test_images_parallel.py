"""Images through several threads: the same bytes for any number of them, in bounded memory, whole or not."""

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter

import numpy as np
import pytest
import tifffile

from iccbrdf.cli import pipeline
from iccbrdf.cli.pipeline import Output
from iccbrdf.errors import InputError, LimitError
from iccbrdf.images import (
    Block,
    Place,
    checks,
    create_tiff,
    in_order,
    open_tiff,
    tiff_reader,
    tiff_storage,
    tiff_writer,
)
from iccbrdf.resources import folder

HEIGHT, WIDTH, CHANNELS = 61, 83, 4
BLOCK = 4 * WIDTH
"""Pixels of the blocks here: a dozen or more of them."""

LAYOUTS = {
    "one strip": {},
    "strips": {"rowsperstrip": 7},
    "tiles": {"tile": (16, 32)},
    "deflate": {"rowsperstrip": 3, "compression": "deflate", "predictor": True},
    "planar": {"planarconfig": "separate"},
    "planar strips": {"planarconfig": "separate", "rowsperstrip": 5},
    "planar tiles": {"planarconfig": "separate", "tile": (16, 16), "compression": "zstd"},
    "big-endian": {"byteorder": ">", "rowsperstrip": 7},
}


class Sums:
    """Stands in for a transform: two channels of sums and differences, and what `fail` does to a block."""

    channels_in = ("a", "b", "c", "d")
    channels_out = ("p", "q")
    samples_out = "real"

    def __init__(self, fail=lambda data: None):
        self.fail = fail

    def check_cost(self, pixels):
        """Sums are cheap."""

    def __call__(self, data):
        self.fail(data)
        return np.stack([data.sum(axis=2), data[..., 0] - data[..., 3]], axis=2, dtype=np.float32)

    def tallied(self, data):
        return self(data), Counter(full=data[..., 0].size)


class Last:
    source = "the last profile"


def stored(dtype="float32"):
    random = np.random.default_rng(2)
    if np.dtype(dtype).kind == "u":
        return random.integers(0, np.iinfo(dtype).max, (HEIGHT, WIDTH, CHANNELS), dtype, endpoint=True)
    return random.random((HEIGHT, WIDTH, CHANNELS)).astype(dtype)


def write(path, pixels, **layout):
    planar = layout.get("planarconfig") == "separate"
    options = {"photometric": "minisblack", "planarconfig": "contig", "metadata": None, **layout}
    extra = ["unspecified"] * (pixels.shape[2] - 1)
    tifffile.imwrite(path, np.moveaxis(pixels, 2, 0) if planar else pixels, extrasamples=extra, **options)
    return path


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(tiff_reader, "BLOCK_SAMPLES", BLOCK * CHANNELS)


def run(image, target, transform=None, workers=1, overwrite=False):
    with open_tiff(image) as source:
        return pipeline.run(
            source,
            transform or Sums(),
            Last,
            [Output(target)],
            overwrite=overwrite,
            label="",
            workers=workers,
        )


# The result


@pytest.mark.parametrize("dtype", ["float32", "uint16", "float64"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_bytes_do_not_depend_on_the_workers(tmp_path, layout, dtype):
    image = write(tmp_path / "image.tif", stored(dtype), **LAYOUTS[layout])
    written = []
    for workers in (1, 2, 4):
        target = tmp_path / f"{workers}.tif"
        run(image, target, workers=workers)
        written.append(target.read_bytes())
    assert written[0] == written[1] == written[2]
    values = stored(dtype).astype(np.float32)
    if dtype == "uint16":
        values /= np.float32(65535)
    assert np.array_equal(tifffile.imread(target), Sums()(values))


@pytest.mark.parametrize("layout", [{}, {"tile": (16, 16)}, {"rows_per_strip": 3}], ids=str)
@pytest.mark.parametrize("compression", ["deflate", "zstd"])
def test_compressed_bytes_do_not_depend_on_the_workers(tmp_path, layout, compression):
    pixels = stored()
    for workers in (1, 3):
        target = tmp_path / f"{workers}.tif"
        options = {"samples": "device", "compression": compression, "workers": workers, **layout}
        with create_tiff(target, HEIGHT, WIDTH, "abcd", **options) as sink:
            for y in range(0, HEIGHT, 5):
                sink.write(Block(y, 0, pixels[y : y + 5]))
        assert np.array_equal(tifffile.imread(target), pixels)
    assert (tmp_path / "1.tif").read_bytes() == (tmp_path / "3.tif").read_bytes()


def test_counts_do_not_depend_on_the_workers(tmp_path):
    pixels = stored()
    pixels[3, 4, 0] = np.nan
    pixels[50, 4:7, 3] = np.inf
    image = write(tmp_path / "image.tif", pixels)
    for workers in (1, 3):
        done = run(image, tmp_path / "out.tif", workers=workers, overwrite=True)
        # Of infinities come sums and differences, of which one is infinite and one not a number.
        assert (done.not_finite_in, done.not_finite_out) == (4, 8)


def test_sums_beyond_float32_are_not_taken_for_infinities(tmp_path):
    pixels = stored()
    pixels[:, :, 0] = 3e38
    image = tmp_path / "image.tif"
    with create_tiff(image, HEIGHT, WIDTH, "abcd", samples="real") as sink:
        sink.write(Block(0, 0, pixels))
    done = run(image, tmp_path / "out.tif", workers=2)
    assert (done.not_finite_in, done.not_finite_out) == (0, 0)


@pytest.mark.parametrize("name", ["n.z", "other"])
def test_steep_normals_are_counted_as_their_angles_are(tmp_path, name):
    angles = np.radians([0, 29.99, 30, 30.01, 60, 90, 120, 180, np.nan])
    pixels = np.stack([0 * angles, np.sin(angles), np.cos(angles)], axis=1, dtype=np.float32)
    names = ("n.x", "n.y", name)
    expected = 5 if name == "n.z" else 0
    assert checks.steeper(pixels[np.newaxis], "real", names, 30.0) == expected
    assert checks.steeper((pixels[np.newaxis] + 1) / 2, "device", names, 30.0) == expected
    assert checks.steeper(pixels[np.newaxis], "real", names, None) == 0


@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f2", "<f8", ">f8"])
@pytest.mark.parametrize("value", [-1e-6, 1.001, -0.0, 1.0, np.nan, np.inf, 5e-8])
def test_device_range_of_floats(tmp_path, dtype, value):
    pixels = stored("float32").astype(dtype)
    pixels[17, 5, 2] = value
    image = write(tmp_path / "image.tif", pixels, byteorder=dtype[0])
    with open_tiff(image) as source:
        if value in (-1e-6, 1.001):
            with pytest.raises(InputError, match="row 17, column 5, channel 2 is"):
                list(source.blocks())
        else:
            assert sum(block.data.shape[0] for block in source.blocks()) == HEIGHT


def test_reading_where_the_system_has_no_positioned_read(tmp_path, monkeypatch):
    images = [write(tmp_path / f"{name}.tif", stored(), **LAYOUTS[name]) for name in ("strips", "planar")]
    for image in images:
        run(image, tmp_path / "a.tif", workers=4, overwrite=True)
        with monkeypatch.context() as without:
            without.delattr(os, "preadv")
            run(image, tmp_path / "b.tif", workers=4, overwrite=True)
        assert (tmp_path / "a.tif").read_bytes() == (tmp_path / "b.tif").read_bytes()


def test_reads_that_give_less_than_was_asked_for(tmp_path, monkeypatch):
    pixels = stored()
    image = write(tmp_path / "image.tif", pixels)
    whole = os.preadv
    monkeypatch.setattr(os, "preadv", lambda file, buffers, at: whole(file, [buffers[0][:1000]], at))
    with open_tiff(image) as source:
        assert np.array_equal(source.read(Place(0, 0, HEIGHT, WIDTH)).data, pixels)


def test_strips_that_follow_each_other_are_read_at_one_go(tmp_path, monkeypatch):
    image = write(tmp_path / "image.tif", stored(), rowsperstrip=1)
    reads = []
    whole = os.preadv
    with open_tiff(image) as source:
        monkeypatch.setattr(os, "preadv", lambda *arguments: reads.append(whole(*arguments)) or reads[-1])
        blocks = list(source.blocks())
    assert reads == [block.data.nbytes for block in blocks]
    assert len(blocks) > 10


# Errors


def tear(path, which):
    """Overwrite the start of a compressed segment."""
    with tifffile.TiffFile(path) as file:
        offset = file.pages[0].dataoffsets[which]
    with path.open("r+b") as stream:
        stream.seek(offset)
        stream.write(bytes(16))


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_damage_in_mid_image_leaves_nothing(tmp_path, workers):
    image = write(tmp_path / "image.tif", stored(), rowsperstrip=3, compression="deflate")
    tear(image, 9)
    tear(image, 10)
    (tmp_path / "old.tif").write_text("old")
    for target in ("new.tif", "old.tif"):
        with pytest.raises(InputError, match="segment 9 cannot be decoded"):
            run(image, tmp_path / target, workers=workers, overwrite=True)
    assert sorted(os.listdir(tmp_path)) == ["image.tif", "old.tif"]
    assert (tmp_path / "old.tif").read_text() == "old"


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_a_file_cut_short_while_it_is_read(tmp_path, workers):
    image = write(tmp_path / "image.tif", stored())
    size = image.stat().st_size
    cut = threading.Event()

    def shorten(data):
        if not cut.is_set():
            os.truncate(image, size - 1000)
            cut.set()

    with pytest.raises(InputError, match=r"image\.tif: truncated: no \d+ bytes at byte"):
        run(image, tmp_path / "out.tif", Sums(shorten), workers)
    assert os.listdir(tmp_path) == ["image.tif"]


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_of_several_failures_the_first_in_the_image_comes_out(tmp_path, workers):
    pixels = stored()
    pixels[20, 0], pixels[40, 0] = 0.25, 0.75
    image = write(tmp_path / "image.tif", pixels)

    def fail(data):
        for value in (0.25, 0.75):
            if (data[:, 0] == value).all(axis=1).any():
                # The failure further down happens first.
                time.sleep(0.05 if value == 0.25 else 0)
                raise ZeroDivisionError(f"at {value}")

    with pytest.raises(ZeroDivisionError, match=r"at 0\.25"):
        run(image, tmp_path / "out.tif", Sums(fail), workers)
    assert os.listdir(tmp_path) == ["image.tif"]


def test_full_disk(tmp_path, monkeypatch):
    image = write(tmp_path / "image.tif", stored())

    def full(self, encoded):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tiff_writer.TiffSink, "put", full)
    with pytest.raises(LimitError, match="No space left on device"):
        run(image, tmp_path / "out.tif", workers=3)
    assert os.listdir(tmp_path) == ["image.tif"]


SLOW = """
import sys, time
from iccbrdf.cmm import Transform
from iccbrdf.cli import main
from iccbrdf.images import tiff_reader
tiff_reader.BLOCK_SAMPLES = 5000
compute = Transform.tallied
def slowly(self, data):
    sys.stderr.write("computing\\n")
    time.sleep(0.1)
    return compute(self, data)
Transform.tallied = slowly
main()
"""


def test_interrupt(tmp_path):
    image = write(tmp_path / "image.tif", np.full((200, 100, 10), 0.5, np.float32))
    profiles = folder("profiles") / "fogra39_gloss"
    chain = ["-p", profiles / "mid.icc", "-p", profiles / "mvis.icc"]
    command = [sys.executable, "-c", SLOW, "apply", image, *chain, "-o", tmp_path / "out.tif"]
    with subprocess.Popen([*command, "--workers", "3"], stderr=subprocess.PIPE, text=True) as process:
        for _ in range(5):
            assert process.stderr.readline() == "computing\n"
        process.send_signal(signal.SIGINT)
        messages = process.stderr.read()
    assert process.returncode == 130
    assert messages.endswith("iccbrdf: interrupted\n")
    assert "Traceback" not in messages
    assert os.listdir(tmp_path) == ["image.tif"]


# Memory and order


def test_blocks_under_way_are_bounded(tmp_path, monkeypatch):
    image = write(tmp_path / "image.tif", stored())
    under_way, most, lock = 0, 0, threading.Lock()
    read, put = tiff_reader.TiffSource.read, tiff_writer.TiffSink.put

    def counted_read(self, place):
        nonlocal under_way, most
        with lock:
            under_way += 1
            most = max(most, under_way)
        return read(self, place)

    def counted_put(self, encoded):
        nonlocal under_way
        put(self, encoded)
        time.sleep(0.002)  # so that the workers get as far ahead as they may
        with lock:
            under_way -= 1

    monkeypatch.setattr(tiff_reader.TiffSource, "read", counted_read)
    monkeypatch.setattr(tiff_writer.TiffSink, "put", counted_put)
    for workers in (1, 3):
        most = 0
        run(image, tmp_path / "out.tif", workers=workers, overwrite=True)
        assert most <= 2 * workers + 1
        assert under_way == 0


def test_large_segments_are_not_decoded_at_the_same_time(tmp_path, monkeypatch):
    image = write(tmp_path / "image.tif", stored(), compression="deflate", rowsperstrip=20)
    monkeypatch.setattr(pipeline, "SAMPLES_AT_A_TIME", 2 * 20 * WIDTH * CHANNELS - 1)
    together, most, lock = 0, 0, threading.Lock()
    read = tiff_reader.TiffSource.read

    def counted_read(self, place):
        nonlocal together, most
        with lock:
            together += 1
            most = max(most, together)
        time.sleep(0.002)
        block = read(self, place)
        with lock:
            together -= 1
        return block

    monkeypatch.setattr(tiff_reader.TiffSource, "read", counted_read)
    run(image, tmp_path / "out.tif", workers=4)
    assert most == 1


@pytest.mark.parametrize("compression", ["deflate", "zstd"])
def test_compressed_results(tmp_path, compression):
    image = write(tmp_path / "image.tif", stored())
    for workers in (1, 3):
        target = tmp_path / f"{workers}.tif"
        with open_tiff(image) as source:
            outputs = [Output(target, compression=compression)]
            pipeline.run(source, Sums(), Last, outputs, overwrite=False, label="", workers=workers)
        assert np.array_equal(tifffile.imread(target), Sums()(stored()))
        with tifffile.TiffFile(target) as file:
            assert compression in file.pages[0].compression.name.lower()
    assert (tmp_path / "1.tif").read_bytes() == (tmp_path / "3.tif").read_bytes()


def test_blocks_of_many_channels_have_fewer_pixels(tmp_path):
    image = write(tmp_path / "image.tif", np.zeros((HEIGHT, WIDTH, 16), np.uint8))
    with open_tiff(image) as source:
        assert max(place.height * place.width for place in source.places()) * 16 <= BLOCK * CHANNELS
        assert sum(place.height * place.width for place in source.places()) == HEIGHT * WIDTH


def test_several_threads_compute_at_a_time():
    both = threading.Barrier(2)
    results = []
    with in_order(2, results.append) as submit:
        for _ in range(4):
            # Passes only when another thread waits, too.
            submit(both.wait, 10)
    assert sorted(results) == [0, 0, 1, 1]


def test_results_come_in_order_and_after_a_failure_nothing_begins():
    begun, taken = [], []

    def work(number):
        begun.append(number)
        if number == 3:
            raise ValueError(number)
        time.sleep(0.001 * (number % 2))
        return number

    def all_of_them():
        with in_order(2, taken.append) as submit:
            for number in itertools.count():
                submit(work, number)

    with pytest.raises(ValueError, match="3"):
        all_of_them()
    assert taken == [0, 1, 2]
    assert max(begun) <= 3 + 2 * 2
    threads = [thread.name for thread in threading.enumerate()]
    assert not [name for name in threads if name.startswith("ThreadPoolExecutor")]


def test_what_the_block_raises_comes_out():
    def fail():
        with in_order(2, print) as submit:
            submit(time.sleep, 0)
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        fail()


def test_segments_that_leave_gaps_are_read_from_their_places(tmp_path):
    pixels = stored()
    image = write(tmp_path / "image.tif", pixels, rowsperstrip=HEIGHT // 2)
    with tifffile.TiffFile(image) as file:
        page = file.pages[0]
        last, count = page.dataoffsets[-1], page.databytecounts[-1]
        moved = [*page.dataoffsets[:-1], image.stat().st_size]
    data = image.read_bytes()
    image.write_bytes(data + data[last : last + count])
    with tifffile.TiffFile(image, mode="r+") as file:
        file.pages[0].tags["StripOffsets"].overwrite(moved)
    with image.open("r+b") as stream:
        stream.seek(last)
        stream.write(b"\xff" * count)
    storage = tiff_storage.TiffStorage(image)
    try:
        assert np.array_equal(storage.read(0, 0, HEIGHT, WIDTH), pixels)
    finally:
        storage.close()
