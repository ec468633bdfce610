"""TIFF streams: files written by tifffile and read by us, files written by us and read by tifffile."""

import itertools
import json
import os
import struct
import subprocess
import sys

import numpy as np
import pytest
import tifffile

from iccbrdf.errors import InputError, LimitError, UnsupportedError, UsageError
from iccbrdf.images import Block, create_tiff, open_tiff, tiff_storage

HEIGHT, WIDTH, CHANNELS = 45, 71, 5
DTYPES = ["uint8", "uint16", "float16", "float32", "float64"]


def stored_pixels(dtype, shape=(HEIGHT, WIDTH, CHANNELS)):
    random = np.random.default_rng(5)
    if np.dtype(dtype).kind == "u":
        return random.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    return random.random(shape).astype(dtype)


def real_values(stored):
    one = np.iinfo(stored.dtype).max if stored.dtype.kind == "u" else 1
    return (stored.astype(np.float64) / one).astype(np.float32)


def read_blocks(path, max_pixels=1 << 18, samples=None):
    """The image put together, and how often each pixel came."""
    with open_tiff(path, samples) as source:
        image = np.full((source.height, source.width, source.channels), -9, np.float32)
        times = np.zeros((source.height, source.width), int)
        for y0, x0, data in source.blocks(max_pixels):
            assert data.dtype == np.float32
            place = np.s_[y0 : y0 + data.shape[0], x0 : x0 + data.shape[1]]
            image[place] = data
            times[place] += 1
    assert (times == 1).all()
    return image


def write_foreign(path, pixels, planar=False, **options):
    data = np.moveaxis(pixels, 2, 0) if planar else pixels
    tifffile.imwrite(
        path,
        data,
        photometric="minisblack",
        planarconfig="separate" if planar else "contig",
        extrasamples=["unspecified"] * (pixels.shape[2] - 1),
        metadata=None,
        **options,
    )


LAYOUTS = {
    "one strip": {},
    "strips": {"rowsperstrip": 7},
    "tiles": {"tile": (16, 32)},
    "deflate strips": {"rowsperstrip": 7, "compression": "deflate"},
    "predicted deflate tiles": {"tile": (16, 32), "compression": "deflate", "predictor": True},
    "lzw strips": {"rowsperstrip": 1, "compression": "lzw"},
    "packbits strips": {"rowsperstrip": 3, "compression": "packbits"},
    "lzma tiles": {"tile": (32, 16), "compression": "lzma"},
    "zstd tiles": {"tile": (32, 16), "compression": "zstd"},
}


@pytest.mark.parametrize("planar", [False, True], ids=["interleaved", "planar"])
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", DTYPES)
def test_reads_what_tifffile_writes(tmp_path, dtype, layout, planar):
    path = tmp_path / "a.tif"
    pixels = stored_pixels(dtype)
    for big, order in itertools.product([False, True], "<>"):
        options = LAYOUTS[layout]
        if dtype == "float16" and "predictor" in options:
            options = {**options, "predictor": False}
        write_foreign(path, pixels, planar, bigtiff=big, byteorder=order, **options)
        for max_pixels in (40, 500, 1 << 18):
            np.testing.assert_array_equal(read_blocks(path, max_pixels), real_values(pixels))


def test_blocks_come_in_row_order_and_keep_their_size(tmp_path):
    path = tmp_path / "a.tif"
    write_foreign(path, stored_pixels("uint8"), rowsperstrip=7)
    with open_tiff(path) as source:
        blocks = list(source.blocks(2 * WIDTH))
        assert [(b.y0, b.x0) for b in blocks] == [(y, 0) for y in range(0, HEIGHT, 2)]
    write_foreign(path, stored_pixels("uint8"), tile=(16, 32), compression="deflate")
    with open_tiff(path) as source:
        places = [(b.y0, b.x0, *b.data.shape[:2]) for b in source.blocks(1100)]
        assert places[:4] == [(0, 0, 16, 64), (0, 64, 16, 7), (16, 0, 16, 64), (16, 64, 16, 7)]
        assert places[-1] == (32, 64, 13, 7)


def test_segments_that_a_sparse_file_leaves_out_are_zero(tmp_path):
    path = tmp_path / "a.tif"
    tile = np.full((16, 16), 255, np.uint8)
    with tifffile.TiffWriter(path) as writer:
        writer.write(iter([tile, None]), shape=(16, 32), dtype="u1", tile=(16, 16), photometric="minisblack")
    image = read_blocks(path)
    assert (image[:, :16] == 1).all()
    assert (image[:, 16:] == 0).all()


def test_grey_and_rgb_with_thumbnail(tmp_path):
    path = tmp_path / "a.tif"
    pixels = stored_pixels("uint16", (20, 30, 3))
    with tifffile.TiffWriter(path) as writer:
        writer.write(pixels, photometric="rgb")
        writer.write(pixels[::4, ::4], photometric="rgb", subfiletype=1)
    np.testing.assert_array_equal(read_blocks(path), real_values(pixels))
    tifffile.imwrite(path, pixels[:, :, 0])
    np.testing.assert_array_equal(read_blocks(path), real_values(pixels[:, :, :1]))


def test_floats_pass_unchanged_when_declared_real(tmp_path):
    path = tmp_path / "a.tif"
    pixels = np.array([[[-1.5, np.nan], [np.inf, 3e38], [1e300, -0.0]]])
    write_foreign(path, pixels)
    np.testing.assert_array_equal(
        read_blocks(path, samples="real"),
        np.array([[[-1.5, np.nan], [np.inf, 3e38], [np.inf, -0.0]]], np.float32),
    )


# What the samples mean


def test_undeclared_floats_outside_the_device_range_are_refused(tmp_path):
    path = tmp_path / "a.tif"
    pixels = stored_pixels("float32")
    pixels[0, 0, 0], pixels[1, 1, 1] = np.nan, np.inf
    pixels[30, 12, 3] = -0.25
    write_foreign(path, pixels, rowsperstrip=7)
    with open_tiff(path) as source:
        assert source.samples == "device"
        assert source.names is None
    with pytest.raises(InputError, match=r"row 30, column 12, channel 3 is -0\.25.*--samples real"):
        read_blocks(path, 100)
    for declared in ("device", "real"):
        np.testing.assert_array_equal(read_blocks(path, samples=declared), pixels)


def test_integers_cannot_be_declared_real(tmp_path):
    path = tmp_path / "a.tif"
    write_foreign(path, stored_pixels("uint16"))
    with pytest.raises(InputError, match=r"declared as 'real', but samples of uint16 are 'device'"):
        open_tiff(path, "real")
    with pytest.raises(UsageError, match=r"unknown samples 'rael': did you mean 'real'"):
        open_tiff(path, "rael")


def test_declaration_must_not_contradict_the_record(tmp_path):
    path = tmp_path / "a.tif"
    for recorded, other in (("real", "device"), ("device", "real")):
        with create_tiff(path, 2, 3, ["a"], samples=recorded, overwrite=True) as sink:
            sink.write(Block(0, 0, np.zeros((2, 3, 1))))
        with open_tiff(path, recorded) as source:
            assert source.samples == recorded
        with pytest.raises(InputError, match=f"declared as '{other}', but the file says '{recorded}'"):
            open_tiff(path, other)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"schema": "iccbrdf.image/2"}, UnsupportedError, "schema 'iccbrdf.image/2', known is"),
        ({"samples": "Real"}, InputError, r"samples 'Real': did you mean 'real'"),
        ({"channels": ["a"]}, InputError, r"names 1 channels \(a\), but the image has 5"),
        ({"channels": "abcde"}, InputError, "expected a list of names"),
        ({"encoding": "u2.14"}, InputError, "encoding 'u2.14', known is 'u1.15'"),
        ({"samples": "real"}, InputError, "'real' samples in encoding None, which does not go with uint16"),
        ({"encoding": "u1.15"}, InputError, "'device' samples in encoding 'u1.15', which does not"),
    ],
)
def test_damaged_records_are_refused(tmp_path, change, error, message):
    path = tmp_path / "a.tif"
    record = {"schema": "iccbrdf.image/1", "samples": "device", "channels": list("abcde")}
    write_foreign(path, stored_pixels("uint16"), description=json.dumps(record))
    with open_tiff(path) as source:
        assert source.names == tuple("abcde")
    write_foreign(path, stored_pixels("uint16"), description=json.dumps({**record, **change}))
    with pytest.raises(error, match=message):
        open_tiff(path)


@pytest.mark.parametrize("text", ["A print", "[1]", '{"shape": [45, 71, 5]}', '{"schema": 1}', "[" * 100_000])
def test_other_descriptions_are_no_record(tmp_path, text):
    path = tmp_path / "a.tif"
    write_foreign(path, stored_pixels("uint8"), description=text)
    with open_tiff(path) as source:
        assert source.names is None


# Files that are refused


def refused(path, error, message):
    with pytest.raises(error, match=message):
        open_tiff(path)


def test_unreadable_files(tmp_path):
    path = tmp_path / "a.tif"
    refused(path, InputError, r"a\.tif: cannot be read: No such file")
    refused(tmp_path, InputError, "cannot be read: Is a directory")
    for content in (b"", b"II", b"not a TIFF at all", b"II*\0\x08\0\0\0", b"II*\0\xff\xff\xff\x7f"):
        path.write_bytes(content)
        refused(path, InputError, r"a\.tif: (not a readable|damaged) TIFF")


def test_images_of_another_kind(tmp_path):
    path = tmp_path / "a.tif"
    pixels = stored_pixels("uint8")
    tifffile.imwrite(path, np.moveaxis(pixels, 2, 0), photometric="minisblack", metadata=None)
    refused(path, UnsupportedError, "holds 5 images, expected one")
    tifffile.imwrite(path, pixels[:, :, 0], photometric="miniswhite")
    refused(path, UnsupportedError, "photometric interpretation MINISWHITE, supported are MINISBLACK, RGB")
    tifffile.imwrite(path, pixels[:, :, 0], extratags=[(274, "H", 1, 3, True)])
    refused(path, UnsupportedError, "orientation 3, supported is 1")
    tifffile.imwrite(path, pixels[:, :, 0] > 9, photometric="minisblack")
    refused(path, UnsupportedError, "samples of 1 bits")
    tifffile.imwrite(path, pixels[:, :, :3], photometric="rgb", compression="jpeg2000")
    refused(path, UnsupportedError, "compression JPEG2000, supported are NONE, LZW")
    for dtype in ("int16", "uint32", "complex64"):
        tifffile.imwrite(path, pixels[:, :, 0].astype(dtype))
        refused(path, UnsupportedError, "supported are unsigned integers of 8 and 16 bits and floats")


def test_truncated_and_damaged_files(tmp_path):
    path = tmp_path / "a.tif"
    pixels = stored_pixels("uint8")
    write_foreign(path, pixels, rowsperstrip=7)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    end = len(whole)
    refused(path, InputError, f"truncated: segment 6 of 7 ends at byte {end}, the file at byte {end - 1}")

    path.write_bytes(whole)
    with tifffile.TiffFile(path, mode="r+") as file:
        file.pages[0].tags["StripByteCounts"].overwrite([7 * 71 * 5] * 6 + [9])
    refused(path, InputError, f"segment 6 has 9 bytes, expected {3 * 71 * 5}")

    write_foreign(path, pixels, rowsperstrip=7, compression="deflate")
    with tifffile.TiffFile(path) as file:
        offset = file.pages[0].dataoffsets[2]
    with path.open("r+b") as file:
        file.seek(offset)
        file.write(b"\xff" * 20)
    with pytest.raises(InputError, match="segment 2 cannot be decoded"):
        read_blocks(path, WIDTH)


def test_limits(tmp_path, monkeypatch):
    path = tmp_path / "a.tif"
    flat = np.ones((HEIGHT, WIDTH, CHANNELS), np.uint8)
    write_foreign(path, flat, compression="deflate", rowsperstrip=HEIGHT)
    segment = HEIGHT * WIDTH * CHANNELS
    monkeypatch.setattr(tiff_storage, "MAX_SEGMENT_BYTES", segment)
    read_blocks(path)
    monkeypatch.setattr(tiff_storage, "MAX_SEGMENT_BYTES", segment - 1)
    refused(path, LimitError, f"segment of 45 x 71 pixels takes {segment} bytes decoded.*smaller strips")
    monkeypatch.setattr(tiff_storage, "MAX_SEGMENT_BYTES", 9)
    refused(path, LimitError, "bytes encoded and can only be decoded as a whole; the limit is 9")
    # The same image uncompressed needs no such memory.
    write_foreign(path, flat)
    read_blocks(path)
    monkeypatch.setattr(tiff_storage, "MAX_CHANNELS", 4)
    refused(path, LimitError, "5 channels, the limit is 4")
    monkeypatch.undo()
    monkeypatch.setattr(tiff_storage, "MAX_SAMPLES", segment - 1)
    refused(path, LimitError, f"45 x 71 pixels with 5 channels, the limit is {segment - 1} samples")


# Our own files


def write_ours(path, pixels, names, step=(9, 30), **options):
    with create_tiff(path, *pixels.shape[:2], names, **options) as sink:
        for y, x in itertools.product(range(0, pixels.shape[0], step[0]), range(0, pixels.shape[1], step[1])):
            sink.write(Block(y, x, pixels[y : y + step[0], x : x + step[1]]))
    return sink


@pytest.mark.parametrize("compression", [None, "deflate", "zstd"])
@pytest.mark.parametrize("layout", [{}, {"rows_per_strip": 4}, {"tile": (16, 32)}], ids=str)
@pytest.mark.parametrize("dtype", ["float32", "uint16", "uint8"])
def test_tifffile_reads_what_we_write(tmp_path, dtype, layout, compression):
    path = tmp_path / "a.tif"
    stored = stored_pixels(dtype)
    names = ["kd.X", "kd.Y", "kd.Z", "m", "Rauheit µ"]
    sink = write_ours(
        path, real_values(stored), names, samples="device", dtype=dtype, compression=compression, **layout
    )
    assert sink.clipped == 0
    np.testing.assert_array_equal(tifffile.imread(path), stored)
    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        assert not file.is_bigtiff
        assert page.photometric == tifffile.PHOTOMETRIC.MINISBLACK
        assert page.extrasamples == (tifffile.EXTRASAMPLE.UNSPECIFIED,) * 4
        assert "DateTime" not in page.tags
        assert page.is_tiled == ("tile" in layout)
        assert page.rowsperstrip == layout.get("rows_per_strip", page.rowsperstrip)
    np.testing.assert_array_equal(read_blocks(path), real_values(stored))
    with open_tiff(path) as source:
        assert source.names == tuple(names)
        assert source.samples == "device"
        assert source.dtype == dtype


def test_real_values_profile_and_single_channel_round_trip(tmp_path):
    path = tmp_path / "a.tif"
    pixels = np.array([[[-3.5], [np.inf]], [[1e-30], [np.nan]]], np.float32)
    profile = bytes(range(256))
    write_ours(path, pixels, ["n.x"], samples="real", profile=profile)
    np.testing.assert_array_equal(read_blocks(path), pixels)
    with open_tiff(path) as source:
        assert (source.samples, source.names, source.profile) == ("real", ("n.x",), profile)
    with tifffile.TiffFile(path) as file:
        assert file.pages[0].tags[34675].value == profile


def test_xyz_in_16_bits_is_u1_15(tmp_path):
    path = tmp_path / "a.tif"
    pixels = np.array([[[0.9642, 1.0, 0.8249], [65535 / 32768, 2.0, -0.1]]], np.float32)
    sink = write_ours(path, pixels, "XYZ", samples="real", dtype="uint16")
    assert sink.clipped == 2
    expected = [[[31595, 32768, 27030], [65535, 65535, 0]]]
    np.testing.assert_array_equal(tifffile.imread(path), np.array(expected, np.uint16))
    np.testing.assert_array_equal(read_blocks(path), np.array(expected, np.float32) / 32768)
    with open_tiff(path) as source:
        assert source.samples == "real"


def test_clipping_to_integers_is_counted(tmp_path):
    path = tmp_path / "a.tif"
    pixels = np.array([[[-0.001], [0.001], [1.001], [1.01], [np.nan], [np.inf], [-1e38], [3e38]]], np.float32)
    sink = write_ours(path, pixels, "a", samples="device", dtype="uint8")
    # -0.001 and 1.001 round to levels that there are.
    assert sink.clipped == 5
    np.testing.assert_array_equal(tifffile.imread(path), [[0, 0, 255, 255, 0, 255, 0, 255]])


def test_bytes_are_the_same_every_time(tmp_path):
    pixels = real_values(stored_pixels("uint16"))
    for name, step in (("a.tif", (9, 30)), ("b.tif", (45, 71))):
        write_ours(tmp_path / name, pixels, "abcde", step, samples="device", rows_per_strip=9)
    assert (tmp_path / "a.tif").read_bytes() == (tmp_path / "b.tif").read_bytes()


@pytest.mark.parametrize("compression", [None, "deflate"])
def test_bigtiff_when_it_needs_to_be(tmp_path, monkeypatch, compression):
    monkeypatch.setattr("iccbrdf.images.tiff_writer.CLASSIC_BYTES", 1000)
    pixels = stored_pixels("float32")
    write_ours(tmp_path / "a.tif", pixels, "abcde", samples="device", compression=compression)
    assert (tmp_path / "a.tif").read_bytes()[:4] == b"II+\0"
    np.testing.assert_array_equal(read_blocks(tmp_path / "a.tif"), pixels)


def test_more_than_4_gigabytes_are_laid_out_as_bigtiff(tmp_path):
    def write_first_and_last():
        with create_tiff(tmp_path / "a.tif", 50_000, 10_000, "XYZ", samples="real") as sink:
            sink.write(Block(0, 0, np.ones((1, 10_000, 3))))
            sink.write(Block(49_999, 0, np.ones((1, 10_000, 3))))
            (partial,) = tmp_path.iterdir()
            with tifffile.TiffFile(partial) as file:
                assert file.is_bigtiff
                assert file.pages[0].dataoffsets[-1] > 1 << 32

    # The file is sparse; only what was written takes space.
    with pytest.raises(UsageError, match="20000 pixels were written to an image of 50000 x 10000"):
        write_first_and_last()
    assert list(tmp_path.iterdir()) == []


def write_some(path, failure=None, rows=1, **options):
    with create_tiff(path, 2, 3, "XYZ", samples="real", **options) as sink:
        sink.write(Block(0, 0, np.zeros((rows, 3, 3))))
        if failure:
            raise failure


@pytest.mark.parametrize("compression", [None, "zstd"])
def test_only_whole_files_appear(tmp_path, compression):
    path = tmp_path / "a.tif"
    with pytest.raises(ValueError, match="stop"):
        write_some(path, ValueError("stop"), compression=compression)
    with pytest.raises(UsageError, match="3 pixels were written to an image of 2 x 3"):
        write_some(path, compression=compression)
    with pytest.raises(UsageError, match=r"shape \(3, 3, 3\) at row 0, column 0 does not fit"):
        write_some(path, rows=3, compression=compression)
    assert os.listdir(tmp_path) == []
    write_some(path, rows=2, compression=compression)
    before = path.read_bytes()
    with pytest.raises(UsageError, match=r"a\.tif: exists already"):
        write_some(path, rows=2, compression=compression)
    with pytest.raises(ValueError, match="stop"):
        write_some(path, ValueError("stop"), overwrite=True, compression=compression)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.tif"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": "reel"}, "unknown samples 'reel': did you mean 'real'"),
        ({"dtype": "uint61"}, "unknown sample type 'uint61': did you mean 'uint16'"),
        ({"compression": "deflat"}, "unknown compression 'deflat': did you mean 'deflate'"),
        ({"names": "XYX"}, "two channels are called 'X'"),
        ({"names": ""}, "3 x 4 pixels with 0 channels is empty"),
        ({"dtype": "uint8"}, "real values do not fit 8 bits"),
        ({"dtype": "uint16", "names": ["n.x", "n.y"]}, r"can only be X, Y, Z, not n\.x, n\.y"),
        ({"tile": (16, 20)}, "tiles of 16 x 20 pixels, expected multiples of 16"),
        ({"tile": (16, 16), "rows_per_strip": 3}, "tiles and rows per strip"),
        ({"rows_per_strip": 0}, "0 rows per strip"),
    ],
)
def test_impossible_requests(tmp_path, options, message):
    options = {"names": "XYZ", "samples": "real", **options}
    names = options.pop("names")
    with pytest.raises(UsageError, match=message), create_tiff(tmp_path / "a.tif", 3, 4, names, **options):
        pytest.fail("the block must not run")
    assert os.listdir(tmp_path) == []


STREAM = """
import resource, sys
import numpy as np
from iccbrdf.images import Block, create_tiff, open_tiff

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

before = peak()
with open_tiff(sys.argv[1]) as source, create_tiff(
    sys.argv[1] + ".out", source.height, source.width, "XYZ", samples="real"
) as sink:
    for block in source.blocks():
        sink.write(block._replace(data=block.data[:, :, :3]))
print(peak() - before)
"""


COMPRESSED_TILES = {"tile": (64, 64), "compression": "zstd"}


@pytest.mark.parametrize("options", [{}, {"planar": True}, COMPRESSED_TILES], ids=str)
def test_memory_does_not_hold_the_image(tmp_path, options):
    path = tmp_path / "a.tif"
    pixels = np.zeros((3000, 3000, 10), np.float32)
    write_foreign(path, pixels, **options)
    megabytes = pixels.nbytes / 2**20
    del pixels
    done = subprocess.run([sys.executable, "-c", STREAM, path], capture_output=True, text=True, check=True)
    assert megabytes > 340
    assert float(done.stdout) < 80


def test_hand_made_file(tmp_path):
    """A classic TIFF of 2 x 2 grey pixels, byte by byte, big-endian."""
    entries = [
        (256, 3, 2 << 16),
        (257, 3, 2 << 16),
        (258, 3, 8 << 16),
        (259, 3, 1 << 16),
        (262, 3, 1 << 16),
        (273, 4, 8),
        (277, 3, 1 << 16),
        (278, 3, 2 << 16),
        (279, 4, 4),
    ]
    directory = b"".join(struct.pack(">HHII", tag, kind, 1, value) for tag, kind, value in entries)
    data = b"MM\0*" + struct.pack(">I", 12) + bytes([0, 51, 102, 255])
    data += struct.pack(">H", len(entries)) + directory + bytes(4)
    path = tmp_path / "a.tif"
    path.write_bytes(data)
    np.testing.assert_allclose(read_blocks(path)[:, :, 0], [[0, 0.2], [0.4, 1]], rtol=1e-7)
