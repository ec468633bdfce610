"""Images beyond one machine: the file is that of one process."""

import os
import pickle
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest
import tifffile

import iccbrdf
from iccbrdf import cluster
from iccbrdf.errors import InputError, UnsupportedError, UsageError
from iccbrdf.images import TiffSink, TiffSource, open_tiff, tiff_reader
from iccbrdf.resources import folder

MID, MVIS = (folder("profiles") / "fogra39_gloss" / name for name in ("mid.icc", "mvis.icc"))
CHAIN = ["-p", MID, "-p", MVIS]
HEIGHT, WIDTH = 150, 210
TILED = {"tile": (16, 32), "bigtiff": True}


def device_values() -> np.ndarray:
    device = np.random.default_rng(5).random((HEIGHT, WIDTH, 10), np.float32)
    device[..., 9] = 0.9
    return device


def write(path, data, **layout):
    tifffile.imwrite(path, data, photometric="minisblack", planarconfig="contig", **layout)
    return path


@pytest.fixture
def transform():
    return iccbrdf.link([MID, MVIS])


@pytest.fixture
def image(tmp_path):
    return write(tmp_path / "image.tif", device_values(), **TILED)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(tiff_reader, "BLOCK_SAMPLES", 10 * WIDTH * 10)


@pytest.fixture(scope="module")
def here():
    """The address of a cluster of two threads in this process."""
    distributed = pytest.importorskip("distributed", reason="dask is not installed (extra cluster)")
    pytest.importorskip("dask.array", reason="dask is not installed (extra cluster)")
    started = distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, silence_logs=50
    )
    with started:
        yield started.scheduler_address


def apply(transform, image, target, address, samples=None, **options):
    with open_tiff(image, samples) as source:
        return cluster.apply(transform, source, target, cluster=address, **options)


def test_two_worker_processes_write_the_file_of_one_process(run, tmp_path):
    pytest.importorskip("distributed", reason="dask is not installed (extra cluster)")
    device = device_values()
    device[70, 80, 0] = np.nan
    image = write(tmp_path / "image.tif", device, compression="zlib", **TILED)
    with tifffile.TiffFile(image) as file:
        assert file.is_bigtiff
    one, two = tmp_path / "one.tif", tmp_path / "two.tif"
    options = ["--dtype", "uint16", "--env", "litI=8", "--embed", "--json"]
    alone = run("apply", image, *CHAIN, "-o", one, *options)
    together = run("apply", image, *CHAIN, "-o", two, *options, "--cluster", "local:2")
    assert (alone.code, together.code, together.err) == (0, 0, alone.err)
    assert one.read_bytes() == two.read_bytes()
    first, second = alone.json, together.json
    assert first["not_finite_in"] == 1
    assert first["outputs"][0].pop("clipped") == second["outputs"][0].pop("clipped") > 0
    assert (first.pop("outputs"), second.pop("outputs")) == ([{"path": str(one)}], [{"path": str(two)}])
    assert first == second
    assert sorted(os.listdir(tmp_path)) == ["image.tif", "one.tif", "two.tif"]


@pytest.mark.parametrize("tile", [None, (32, 16)], ids=["strips", "tiles"])
@pytest.mark.parametrize(
    "layout",
    [{}, {"rowsperstrip": 7, "byteorder": ">"}, TILED, {**TILED, "compression": "zstd"}],
    ids=["one strip", "big-endian", "tiles", "zstd tiles"],
)
def test_layouts(tmp_path, here, transform, layout, tile):
    image = write(tmp_path / "image.tif", device_values(), **layout)
    met = apply(transform, image, tmp_path / "out.tif", here, tile=tile)
    assert np.array_equal(tifffile.imread(tmp_path / "out.tif"), transform(device_values()))
    assert met == (0, 0, 0, 0)
    with tifffile.TiffFile(tmp_path / "out.tif") as file:
        assert file.pages[0].is_tiled == (tile is not None)


def test_counts(tmp_path, here, transform):
    device = device_values()
    device[3, 4, :2] = np.nan
    device[149, 209, 5] = np.inf
    image = write(tmp_path / "image.tif", device, **TILED)
    met = apply(transform, image, tmp_path / "out.tif", here, "device", dtype="uint16", last_slope=30.0)
    x, y, z = 2 * device[..., 7:].astype(float).transpose(2, 0, 1) - 1
    assert met.not_finite_in == 3
    assert met.beyond_slopes == (np.degrees(np.arctan2(np.hypot(x, y), z)) > 30).sum() > 1000
    levels = np.rint(transform(device) * np.float32(32768))
    assert met.clipped == ((levels < 0) | (levels > 65535)).sum() > 0


def test_the_image_of_a_path_is_the_present_one(tmp_path, here, transform):
    image = tmp_path / "image.tif"
    for value in (0.5, 0.75):
        device = np.full((64, 32, 10), value, np.float32)
        write(image, device, **TILED)
        apply(transform, image, tmp_path / "out.tif", here, overwrite=True)
        assert np.array_equal(tifffile.imread(tmp_path / "out.tif"), transform(device))
    apply(transform, image, image, here, overwrite=True)
    assert np.array_equal(tifffile.imread(image), transform(device))


def test_blocks_in_memory_are_those_of_the_threads(image, tmp_path, here, transform, monkeypatch):
    under_way, most, blocks, lock = 0, 0, 0, threading.Lock()
    read, put = TiffSource.read, TiffSink.put

    def counted_read(self, place):
        nonlocal under_way, most, blocks
        with lock:
            under_way, blocks = under_way + 1, blocks + 1
            most = max(most, under_way)
        return read(self, place)

    def counted_put(self, encoded):
        nonlocal under_way
        put(self, encoded)
        with lock:
            under_way -= 1

    monkeypatch.setattr(TiffSource, "read", counted_read)
    monkeypatch.setattr(TiffSink, "put", counted_put)
    apply(transform, image, tmp_path / "out.tif", here)
    assert blocks == 15
    assert most <= 2
    assert under_way == 0


def test_damage_comes_out_as_it_does_alone(tmp_path, here, transform):
    image = write(tmp_path / "image.tif", device_values(), compression="zlib", **TILED)
    with tifffile.TiffFile(image) as file:
        offset = file.pages[0].dataoffsets[30]
    with image.open("r+b") as stream:
        stream.seek(offset)
        stream.write(bytes(30))
    with pytest.raises(InputError, match=r"image\.tif: segment 30 cannot be decoded"):
        apply(transform, image, tmp_path / "out.tif", here)
    assert os.listdir(tmp_path) == ["image.tif"]


def test_the_back_end_is_decided_once(image, tmp_path, here, transform, monkeypatch):
    used = []

    class Other(type(transform)):
        @property
        def backend(self):
            used.append(self.wanted)
            return "interpreter"

    fields = {name: getattr(transform, name) for name in transform.__dataclass_fields__}
    apply(Other(**fields), image, tmp_path / "out.tif", here)
    assert used == ["auto"]
    reference = replace(transform, wanted="interpreter")(device_values())
    assert np.array_equal(tifffile.imread(tmp_path / "out.tif"), reference)


def test_an_image_pickles_as_its_path_and_meaning(image, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with open_tiff("image.tif", "real") as source:
        pickled = pickle.dumps(source)
    assert len(pickled) < 1000
    monkeypatch.chdir("/")
    with pickle.loads(pickled) as again:
        assert again.samples == "real"
        assert np.array_equal(np.concatenate([block.data for block in again.blocks()]), device_values())


# What is refused


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "out.png"], "a cluster writes one TIFF"),
        (["-o", "out.tif", "-o", "more.tif"], "a cluster writes one TIFF"),
        (["-o", "out.tif", "--compression", "zstd"], "a cluster writes no compressed TIFF"),
        (["-o", "out.tif", "--normals", "map.png"], "leave --normals and --height out"),
    ],
)
def test_usage(run, tmp_path, monkeypatch, image, options, message):
    monkeypatch.chdir(tmp_path)
    result = run("apply", image, *CHAIN, *options, "--cluster", "local:2")
    assert (result.code, result.out) == (2, "")
    assert message in result.err
    assert os.listdir(tmp_path) == ["image.tif"]


@pytest.mark.parametrize(
    ("address", "error", "message"),
    [
        ("local:two", UsageError, "found 'two', expected a number of worker processes"),
        ("local:0", UsageError, "found '0', expected a number of worker processes"),
        ("carrier-pigeon://3", UsageError, "'carrier-pigeon://3' is neither an address nor 'local'"),
        ("tcp://127.0.0.1:1", InputError, r"cluster tcp://127\.0\.0\.1:1: cannot be reached"),
    ],
)
def test_no_such_cluster(tmp_path, monkeypatch, image, transform, address, error, message):
    pytest.importorskip("distributed", reason="dask is not installed (extra cluster)")
    monkeypatch.setattr(cluster, "_SECONDS_TO_CONNECT", 0.2)
    with pytest.raises(error, match=message):
        apply(transform, image, tmp_path / "out.tif", address)
    assert os.listdir(tmp_path) == ["image.tif"]


@pytest.mark.parametrize("package", ["dask.array", "distributed"])
def test_without_dask(tmp_path, monkeypatch, image, transform, package):
    if package == "distributed":
        pytest.importorskip("dask.array", reason="dask is not installed (extra cluster)")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UnsupportedError, match=r"pip install 'iccbrdf\[cluster\]'"):
        apply(transform, image, tmp_path / "out.tif", "local:2")
    assert os.listdir(tmp_path) == ["image.tif"]
