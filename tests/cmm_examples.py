"""What the tests of linking share: small profiles of every class, and the ICC's own CMM to compare with."""

import iccdev
import numpy as np

from iccbrdf.calc.program import parse
from iccbrdf.icc import (
    D50,
    MCS_SUBSET,
    XYZ,
    Calculator,
    Header,
    Matrix,
    Mluc,
    MultiProcess,
    Profile,
    TagArray,
    write_profile,
)

TEXTS = {"desc": Mluc.of("An example"), "cprt": Mluc.of("No copyright")}
WHITE = np.round(np.array(D50) * 65536) / 65536  # as a header holds it


def matrix(rows, offset=None):
    return MultiProcess.of(Matrix.of(rows, offset))


def scaled(factor):
    """Three channels times one number."""
    return matrix(np.eye(3) * factor)


def program(text, inputs, outputs, elements=()):
    return MultiProcess.of(Calculator(inputs, outputs, parse("{ " + text + " }"), elements))


def mid(names, process=None, *, subset=False, source="mid.icc", **tags):
    """By default its device values are the multiplex ones."""
    n = len(names)
    return Profile(
        Header(
            device_class="mid ",
            colour_space=f"nc{n:04x}",
            mcs=f"mc{n:04x}",
            flags=MCS_SUBSET if subset else 0,
        ),
        {**TEXTS, "mcta": TagArray.of_texts(names), "A2M0": process or matrix(np.eye(n)), **tags},
        source=source,
    )


def mvis(names, *, pcs="XYZ ", subset=False, illuminant=D50, source="mvis.icc", defaults=None, **transforms):
    """By default its XYZ are the first three channels; `transforms` are tags, M2B1 and so on."""
    n = len(names)
    tags = {**TEXTS, "mcta": TagArray.of_texts(names), "wtpt": XYZ.of(*illuminant)}
    if defaults is not None:
        tags["mdv "] = defaults
    header = Header(
        device_class="mvis",
        pcs=pcs,
        mcs=f"mc{n:04x}",
        illuminant=illuminant,
        flags=MCS_SUBSET if subset else 0,
    )
    return Profile(header, {**tags, **(transforms or {"M2B0": matrix(np.eye(3, n))})}, source=source)


def device_profile(device_class="prtr", *, space="RGB ", pcs="XYZ ", illuminant=D50, **tags):
    """Any class between a device space and a connection space."""
    header = Header(device_class=device_class, colour_space=space, pcs=pcs, illuminant=illuminant)
    return Profile(
        header, {**TEXTS, "wtpt": XYZ.of(*illuminant), **tags}, source=f"{device_class.strip()}.icc"
    )


def pixels(channels, count=50, *, seed=1, low=0.0, high=1.0):
    """Random float32 values."""
    return np.random.default_rng(seed).uniform(low, high, (count, channels)).astype(np.float32)


def reference(folder, profiles, array, *, intent=1, pcs=None):
    """What the ICC's CMM makes of `array`; real values where it ends on the connection space `pcs`.

    Its XYZ are encoded so that 1 stands for 1 + 32767/32768, its Lab in 0..1.
    """
    with iccdev.IccCmm() as cmm:
        for i, profile in enumerate(profiles):
            path = folder / f"{i}.icc"
            write_profile(profile, path, overwrite=True)
            mcs = profile.header.device_class in ("mid ", "mvis", "mlnk") or (i == 0 and "A2M0" in profile)
            cmm.attach(path, intent=intent, lut_type=iccdev.LutType.MCS if mcs else iccdev.LutType.Color)
        cmm.begin()
        found = cmm.apply_ndarray(np.ascontiguousarray(array, np.float32)).astype(float)
    if pcs == "XYZ ":
        return found * 65535 / 32768
    if pcs == "Lab ":
        return found * (100, 255, 255) - (0, 128, 128)
    return found
