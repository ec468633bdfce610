"""What several elements of the dialect hold: triples, spectral ranges, numeric arrays, grids of a table."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iccbrdf.icc.tags import NUMBERS, NumberArray
from iccbrdf.icc.xml.forms import Form, Forms, Inside, Numbers, Part, Seen
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import FLOAT32, U8, U16, Codec, numbers


class Triple(Part):
    """Three attributes as a tuple."""

    def __init__(self, field: str, codec: Codec, names: tuple[str, str, str] = ("X", "Y", "Z")) -> None:
        self.attributes = names
        self.field = field
        self.codec = codec

    def read(self, node: Node, seen: Seen) -> None:
        seen[self.field] = tuple(node.value(self.codec, node.get(name), name) for name in self.attributes)

    def write(self, out: Target, record: Any) -> None:
        for name, value in zip(self.attributes, getattr(record, self.field), strict=True):
            out.set(name, self.codec.write(value))


class Wavelengths(Part):
    """The first and the last wavelength as a tuple, and how many there are (of a record: `count`)."""

    attributes = ("start", "end", "steps")

    def __init__(self, field: str, steps: str, count: Callable[[Any], int]) -> None:
        self.field = field
        self.steps = steps
        self.count = count

    def read(self, node: Node, seen: Seen) -> None:
        seen[self.field] = tuple(node.value(FLOAT32, node.get(name), name) for name in ("start", "end"))
        seen[self.steps] = node.value(U16, node.get("steps"), "steps")

    def write(self, out: Target, record: Any) -> None:
        start, end = getattr(record, self.field)
        out.set("start", FLOAT32.write(start))
        out.set("end", FLOAT32.write(end))
        out.set("steps", str(self.count(record)))


def spectral_range(name: str, field: str, steps: str) -> Inside:
    """Wavelengths in an element of their own, left out where they are zeros."""
    return Inside(
        name,
        Inside("Wavelengths", Wavelengths(field, steps, lambda record: int(getattr(record, steps)))),
        default=lambda seen: {field: (0.0, 0.0), steps: 0},
        present=lambda record: any(getattr(record, field)) or getattr(record, steps) > 0,
    )


class Grid(Part):
    """The grid points of each input, or one number that holds for all of them."""

    attributes = ("GridGranularity",)
    children = ("GridPoints",)

    def read(self, node: Node, seen: Seen) -> None:
        points = node.child("GridPoints")
        if points is not None:
            grid = tuple(points.value(numbers(np.uint8), points.text).tolist())
        else:
            grid = (node.value(U8, node.get("GridGranularity"), "GridGranularity"),) * seen["inputs"]
        if len(grid) != seen["inputs"]:
            raise (points or node).error(f"found {len(grid)} grid points, expected {seen['inputs']}")
        seen["grid"] = grid

    def write(self, out: Target, record: Any) -> None:
        out.child("GridPoints").write(" ".join(map(str, record.table.shape[:-1])))


_NAMES = {
    "ui08": "uInt8",
    "ui16": "uInt16",
    "ui32": "uInt32",
    "ui64": "uInt64",
    "fl16": "float16",
    "fl32": "float32",
    "fl64": "float64",
    "sf32": "s15Fixed16",
    "uf32": "u16Fixed16",
}


def _form(signature: str) -> Form:
    # The ICC's tools take floating-point numbers in <Data> and fixed-point ones in <Array> alone.
    name, alias = ("Data", "Array") if signature.startswith("fl") else ("Array", "Data")
    memory = NUMBERS[signature][0]
    return Form(
        f"{_NAMES[signature]}ArrayType",
        NumberArray,
        Inside(name, Numbers("values", dtype=memory), aliases=(alias,)),
        signature=signature,
        aliases=(f"{_NAMES[signature]}NumberType",),
    )


NUMBER_FORMS = Forms("numeric array")
NUMBER_FORMS.add(*map(_form, NUMBERS))
