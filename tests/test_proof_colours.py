"""The colours of a job: against measured patches, colour-science and hand-computed encodings."""

import warnings

import imagecodecs
import numpy as np
import pytest
import tifffile
from proof_examples import D65_10, PRIMARIES, TEN_DEGREES, nodes, primaries_for_d65_10, write_lab

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.errors import InputError, InputWarning, UnsupportedError
from iccbrdf.icc import read_profile
from iccbrdf.icc.header import D50
from iccbrdf.images import Block, create_tiff
from iccbrdf.images.showing import display_p3, srgb
from iccbrdf.proof.colour_in import ColourIn

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import colour


def read(path, printer=None, primaries=PRIMARIES):
    """The whole image, and the source it came from."""
    with ColourIn(path, printer, read_primaries(primaries)) as source:
        data = np.empty((source.height, source.width, source.channels), np.float32)
        for place in source.places():
            data[place.y0 : place.y0 + place.height, place.x0 : place.x0 + place.width] = source.read(
                place
            ).data
    return data, source


@pytest.fixture
def printer(shared_data):
    """A real CMYK profile, and its characterisation data: CMYK in 0..1 and XYZ, Y = 1."""
    text = (shared_data / "print" / "FOGRA39L.ti3").read_text().replace("\r", "")
    columns = text.split("BEGIN_DATA_FORMAT\n")[1].split("END_DATA_FORMAT")[0].split()
    rows = [line.split() for line in text.split("BEGIN_DATA\n")[1].split("END_DATA")[0].strip().split("\n")]
    wanted = [
        columns.index(name) for name in ("CMYK_C", "CMYK_M", "CMYK_Y", "CMYK_K", "XYZ_X", "XYZ_Y", "XYZ_Z")
    ]
    table = np.array([[float(row[i]) for i in wanted] for row in rows]) / 100
    profile = read_profile(shared_data / "icc" / "ISOcoated_v2_300_bas.icc")
    return profile, table[np.newaxis, :, :4], table[np.newaxis, :, 4:]


def test_cmyk_gives_the_measured_colours_of_the_print(tmp_path, printer):
    profile, CMYK, measured = printer
    tifffile.imwrite(tmp_path / "a.tif", np.rint(CMYK * 65535).astype(np.uint16), photometric="separated")
    XYZ, source = read(tmp_path / "a.tif", profile)
    dE = delta_E_CIE2000(XYZ_to_Lab(XYZ, D50), XYZ_to_Lab(measured, D50))
    assert dE.mean() < 0.05
    assert dE.max() < 0.5
    assert (source.space, source.summary["intent"], source.samples) == ("CMYK", "absolute", "real")
    # Paper stays paper: the relative intent would make it the perfect diffuser.
    paper = XYZ[(CMYK == 0).all(axis=-1)]
    np.testing.assert_allclose(paper, [[0.8448, 0.8762, 0.7457]] * len(paper), atol=2e-4)


@pytest.mark.parametrize(
    "layout",
    [
        {"rowsperstrip": 7},
        {"tile": (16, 32), "compression": "lzw", "predictor": True},
        {"tile": (32, 16), "compression": "zlib", "planarconfig": "separate"},
    ],
    ids=["strips", "lzw tiles", "planar deflate"],
)
def test_layouts_of_cmyk(tmp_path, printer, layout):
    profile, *_ = printer
    stored = np.random.default_rng(0).integers(0, 256, (45, 50, 4), np.uint8)
    planar = layout.get("planarconfig") == "separate"
    tifffile.imwrite(
        tmp_path / "a.tif", np.moveaxis(stored, 2, 0) if planar else stored, photometric="separated",
        iccprofile=profile.to_bytes(), **layout,
    )  # fmt: skip
    XYZ, _ = read(tmp_path / "a.tif")
    scaled = stored.astype(np.float64) / 255 * 100
    # Little CMS in its own double precision format, over Lab instead of XYZ.
    Lab = imagecodecs.cms_transform(
        scaled, profile.to_bytes(), imagecodecs.cms_profile("lab4"), colorspace="cmyk", outcolorspace="lab",
        outdtype=np.float64, intent=imagecodecs.CMS.INTENT.ABSOLUTE_COLORIMETRIC,
    )  # fmt: skip
    assert np.abs(XYZ_to_Lab(XYZ, D50) - Lab).max() < 0.05


def test_another_profile_is_embedded(tmp_path, printer):
    profile, CMYK, _ = printer
    other = bytearray(profile.to_bytes())
    other[24:36] = bytes(12)
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, np.rint(CMYK * 255).astype(np.uint8), photometric="separated", iccprofile=bytes(other)
    )
    with pytest.warns(InputWarning, match="another profile is embedded in it than"):
        _, source = read(path, profile)
    assert source.profile is profile
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "embedded profile" in read(path)[1].summary["profile"]


def test_cmyk_that_is_no_number_is_no_colour(tmp_path, printer):
    profile, *_ = printer
    pixels = np.zeros((1, 3, 4), np.float32)
    pixels[0, 1, 2] = np.nan
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="separated")
    XYZ, _ = read(tmp_path / "a.tif", profile)
    assert np.isnan(XYZ[0, 1]).all()
    assert np.isfinite(XYZ[0, [0, 2]]).all()


def test_rgb_of_a_display(tmp_path):
    RGB = np.random.default_rng(0).integers(0, 65536, (9, 11, 3), np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", RGB, photometric="rgb", iccprofile=srgb().to_bytes())
    with pytest.warns(InputWarning, match="no profile of a print"):
        XYZ, source = read(tmp_path / "a.tif")
    assert source.space == "RGB"
    D50_xy = np.array(D50[:2]) / sum(D50)
    expected = colour.sRGB_to_XYZ(RGB / 65535, D50_xy, chromatic_adaptation_transform="Bradford")
    np.testing.assert_allclose(XYZ, expected, atol=3e-4)


def test_adaptation_to_the_primaries(tmp_path):
    primaries = primaries_for_d65_10(tmp_path / "primaries.json")
    write_lab(tmp_path / "a.tif", nodes())
    with pytest.warns(InputWarning, match="the primaries for the CIE 1964 10 Degree"):
        XYZ, source = read(tmp_path / "a.tif", primaries=primaries)
    bradford = colour.adaptation.matrix_chromatic_adaptation_VonKries(D50, D65_10, transform="Bradford")
    np.testing.assert_allclose(XYZ, nodes() @ bradford.T, rtol=2e-4)
    assert source.summary["adaptation"].startswith("Bradford")
    assert source.summary["conditions"] == f"D65, {TEN_DEGREES}"


LAB = [(0, 0, 0), (100, 0, 0), (50, -100, 20), (50, 100, -20)]


@pytest.mark.parametrize(
    ("photometric", "stored"),
    [
        ("cielab", np.uint8([[0, 0, 0], [255, 0, 0], [128, 156, 20], [128, 100, 236]])),
        ("icclab", np.uint8([[0, 128, 128], [255, 128, 128], [128, 28, 148], [128, 228, 108]])),
        ("cielab", np.uint16([[0, 0, 0], [65535, 0, 0], [32768, 39936, 5120], [32768, 25600, 60416]])),
        ("icclab", np.uint16(
            [[0, 32768, 32768], [65280, 32768, 32768], [32640, 7168, 37888], [32640, 58368, 27648]])),
        ("cielab", np.float32(LAB)),
    ],
    ids=["CIELAB 8", "ICCLAB 8", "CIELAB 16", "ICCLAB 16", "float"],
)  # fmt: skip
def test_encodings_of_lab(tmp_path, photometric, stored):
    tifffile.imwrite(tmp_path / "a.tif", stored[np.newaxis], photometric=photometric)
    XYZ, source = read(tmp_path / "a.tif")
    assert source.space == "Lab"
    with colour.utilities.suppress_warnings(colour_usage_warnings=True):
        expected = colour.Lab_to_XYZ(np.array(LAB, float), np.array(D50[:2]) / sum(D50))
    # A step of 8 bits in L* is 0.4.
    np.testing.assert_allclose(XYZ[0], expected, atol=0.005 if stored.itemsize == 1 else 1e-4)


def test_xyz_with_and_without_normals(tmp_path):
    XYZ = np.random.default_rng(0).uniform(0, 1, (7, 8, 3)).astype(np.float32)
    normals = np.float32([0.6, 0, 0.8]) * np.ones((7, 8, 1), np.float32)
    for names, real in (
        ("XYZ", XYZ),
        ((*"XYZ", "n.x", "n.y", "n.z"), np.concatenate([XYZ, normals], axis=2)),
    ):
        device = np.concatenate([real[..., :3] / (65535 / 32768), (real[..., 3:] + 1) / 2], axis=2)
        for samples, data in (("real", real), ("device", device)):
            with create_tiff(tmp_path / "a.tif", 7, 8, names, samples=samples, overwrite=True) as sink:
                sink.write(Block(0, 0, data))
            found, source = read(tmp_path / "a.tif")
            assert (source.space, tuple(source.names)) == ("XYZ", tuple(names))
            np.testing.assert_allclose(found, real, atol=1e-6)


def test_no_colours(tmp_path):
    path = tmp_path / "a.tif"
    grey = np.zeros((6, 7), np.uint8)
    inks = np.zeros((6, 7, 5), np.uint8)
    cmyk, rgb = inks[..., :4], inks[..., :3]
    ink_set = [(332, "H", 1, 2, True)]
    for data, options, error, message in (
        (inks, {"photometric": "separated"}, UnsupportedError, "5 channels, expected 4 for SEPARATED: spot"),
        (cmyk, {"photometric": "separated", "extratags": ink_set}, UnsupportedError, "are not CMYK"),
        (
            cmyk,
            {"photometric": "rgb", "extrasamples": ["unassalpha"]},
            UnsupportedError,
            "expected 3 for RGB",
        ),
        (grey, {"photometric": "minisblack"}, InputError, "expected CMYK, RGB"),
        (cmyk, {"photometric": "separated"}, InputError, "no profile is embedded"),
        (cmyk, {"photometric": "separated", "iccprofile": srgb().to_bytes()}, InputError, "expected 'CMYK'"),
        (rgb, {"photometric": "rgb", "iccprofile": b"no profile at all"}, InputError, None),
    ):
        tifffile.imwrite(path, data, **options)
        if message is None:
            with pytest.raises(Exception, match="embedded profile"):
                read(path)
            continue
        with pytest.raises(error, match=message):
            read(path)
    with create_tiff(path, 4, 5, ("kd.X", "m"), samples="device", overwrite=True) as sink:
        sink.write(Block(0, 0, np.zeros((4, 5, 2), np.float32)))
    with pytest.raises(InputError, match=r"channels kd\.X, m, expected colours"):
        read(path)


def test_profiles_that_little_cms_cannot_run(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((4, 5, 3), np.uint8), photometric="rgb")
    five = read_profile(PRIMARIES.with_name("mvis.icc"))
    with pytest.raises(UnsupportedError, match="version 5"):
        read(path, five)
    with pytest.raises(InputError, match="Little CMS cannot use this profile"):
        read(path, display_p3().replace(remove=["rXYZ"]))
