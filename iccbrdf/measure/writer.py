"""Measurements as a CSV file that needs no declaration, since its header makes them all."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np

from iccbrdf.files import StrPath, atomic_output
from iccbrdf.measure.columns import INKS, TRISTIMULUS
from iccbrdf.measure.declarations import SCHEMA, VERSION
from iccbrdf.measure.measurements import Measurements


def write_measurements(measurements: Measurements, path: StrPath, *, overwrite: bool = False) -> None:
    """
    Write measurements so that `read_measurements(path)` gives them back exactly, but for the notes.

    Comment lines of TOML come first, then a line of column names, then a row for each patch and geometry;
    what was not measured is empty.

    Raises
    ------
    UsageError
        The file cannot be written, or exists and `overwrite` is not set.
    """
    with atomic_output(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(_csv(measurements).encode())


def _csv(measurements: Measurements) -> str:
    in_plane = not measurements.phi.any()
    header = {
        "schema": SCHEMA,
        "version": VERSION,
        "source": measurements.source,
        "angles": "degree",
        "view_angles": "lamp" if in_plane else "azimuth",
        "quantity": "reflectance",
        "scale": 1,
        "illuminant": measurements.illuminant,
        "observer": measurements.observer,
        "white": list(measurements.white),
    }
    names, values = ["theta_i", "theta_r"], [measurements.theta_i, measurements.theta_r]
    if not in_plane:
        names.append("phi")
        values.append(measurements.phi)
    angles = [[_text(value) for value in row] for row in np.stack(values, axis=-1).tolist()]
    samples = [measurements.XYZ]
    names += TRISTIMULUS
    if measurements.wavelengths is not None and measurements.spectra is not None:
        names += [_text(wavelength) for wavelength in measurements.wavelengths.tolist()]
        samples.append(measurements.spectra)
    patch_names = ["patch"]
    patch_rows = [[name] for name in measurements.patches]
    for columns, array in ((INKS, measurements.cmyk), (("slope",), measurements.slopes)):
        if array is not None:
            patch_names += columns
            for row, numbers in zip(patch_rows, array.reshape(len(patch_rows), -1).tolist(), strict=True):
                row += [_text(value) for value in numbers]

    stream = io.StringIO()
    for key, value in header.items():
        # JSON's texts, numbers and lists are TOML's, but for escapes beyond 16 bits and the character DEL.
        text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        stream.write(f"# {key} = {text}\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*patch_names, *names])
    for patch, readings in zip(patch_rows, np.concatenate(samples, axis=-1).tolist(), strict=True):
        for angle, reading in zip(angles, readings, strict=True):
            writer.writerow([*patch, *angle, *map(_text, reading)])
    return stream.getvalue()


def _text(value: float) -> str:
    """The shortest text that gives a number back exactly."""
    if math.isnan(value):
        return ""
    return repr(value).removesuffix(".0")
