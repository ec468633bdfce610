"""Ways made ready to run: from tiles of an image to what is stored of their proof."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.interpolation import InterpolationMethod
from iccbrdf.brdf.models import MODELS, NORMAL
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.build.literal import literal_mvis
from iccbrdf.build.profiles import decoding, ranges, text_tags
from iccbrdf.build.slope_adjustment import slope_adjustment
from iccbrdf.build.table import build_table_mid, build_table_profile
from iccbrdf.build.viewing import viewing
from iccbrdf.calc import verify
from iccbrdf.cmm import link, standard_XYZ
from iccbrdf.cmm.luts import as_elements
from iccbrdf.cmm.spaces import Space
from iccbrdf.icc import ColorantTable, Header, Matrix, MultiProcess, Profile
from iccbrdf.images.little_cms import to_XYZ
from iccbrdf.images.showing import Showing, srgb
from iccbrdf.planning import ScenePlan
from iccbrdf.report.cost_scene import CostScene, Tiles
from iccbrdf.report.cost_ways import Way

Stored = NDArray[Any]

_LARGEST_U16 = 65535
_ONE_U1_15 = 32768


@dataclass(frozen=True)
class Ready:
    """A way that is ready to run."""

    run: Callable[[Tiles], Stored]
    """From tiles (n, height, width, channels) to what is stored of them; what the time is taken of."""
    profiles: tuple[Profile, ...] = ()
    backend: str = "numpy"
    """What runs it, where a transform does."""
    operators: float | None = None
    """Executed for a pixel at most; None where no program runs."""
    take: Callable[[Tiles], Tiles] = lambda tiles: tiles
    """Gives the image its way starts from, before any time is taken."""
    decode: Callable[[Stored], Array] = lambda stored: np.asarray(stored, np.float64)
    """From what is stored to XYZ (..., 3)."""
    bound: float | None = None
    """CIEDE2000 that the way promises not to exceed, up to rounding."""


def make_ready(way: Way, scene: CostScene, plan: Callable[[float], ScenePlan]) -> Ready:
    """Build and link the profiles of a way.

    `plan` makes the plan of the whole image within a tolerance in CIEDE2000; it is asked where the way needs
    one.
    """
    if way.is_reference:
        return Ready(scene.exact)
    if way.output != "float32":
        return _stored(way, scene, make_ready(replace(way, output="float32"), scene, plan))
    if way.version == 4:
        return _by_version_4(way, scene)
    if way.reduction > 1:
        return _reduced(way, scene)
    return _linked(way, scene, plan)


def _linked(way: Way, scene: CostScene, plan: Callable[[float], ScenePlan]) -> Ready:
    """A chain of profiles that takes the image as it is."""
    recipe, names, bound = scene.recipe, scene.names, None
    columns = list(range(len(names)))
    if way.model is not None:
        recipe = replace(recipe, primaries=_with_roughness(recipe.primaries, way.model))
        if not scene.is_colour:
            names, columns = _roughness_columns(names, way.model)
    if way.interpolation is not None:
        recipe = replace(recipe, interpolation=way.interpolation)
    if way.geometry is not None:
        recipe = replace(recipe, geometry=way.geometry)
    mid, mvis = scene.mid, scene.pair.mvis
    if way.tolerance is not None:
        found = plan(way.tolerance)
        mid, mvis = found.reduced.chain
        bound = found.decision.bound
    elif way.grid is not None:
        mid = _table_mid(way.grid, scene)
    elif recipe != scene.recipe:
        pair = recipe.pair()
        mid, mvis = recipe.colour_mid().mid if scene.is_colour else pair.mid, pair.mvis
    if way.literal:
        mvis, _ = literal_mvis(scene.pair, recipe.primaries.model)
    transform = link(
        [mid, mvis],
        env=_known(scene, mvis),
        dtype=way.dtype,
        channels=names,
        samples=scene.samples,
        interpolation=way.lookup,
        effects="auto" if way.by_tile else "full",
    )
    in_order = columns == list(range(len(scene.names)))
    return Ready(
        transform,
        (mid, mvis),
        transform.backend,
        operators([mid, mvis]),
        (lambda tiles: tiles) if in_order else (lambda tiles: np.ascontiguousarray(tiles[..., columns])),
        bound=bound,
    )


def _by_version_4(way: Way, scene: CostScene) -> Ready:
    """A 16-bit image of parameters by the version 4 profile, then MID and MVIS as ever.

    The profile's 16-bit tag runs in this CMM, on XYZ that is adjusted to the slope and rounded as its input.
    """
    recipe, names, pair = scene.recipe, scene.names, scene.pair
    parameters = MODELS[recipe.primaries.model].channels
    table = build_table_profile(recipe.primaries, method=_method(scene), grid=way.grid or 0)[0]
    mid = _version_4_mid(scene, table)
    look_up = link([mid], channels=names, samples=scene.samples)
    rest = [i for i, name in enumerate(names) if name in NORMAL]
    channels = [*parameters, *(names[i] for i in rest)]
    transform = link([pair.mid, pair.mvis], env=_known(scene, pair.mvis), channels=channels)
    finish = transform

    def run(tiles: Tiles) -> Stored:
        image = np.rint(np.clip(look_up(tiles), 0, 1) * np.float32(_LARGEST_U16)).astype(np.uint16)
        normals = tiles[..., rest]
        device = normals if scene.samples == "device" else (normals + 1) / 2
        return finish(np.concatenate([image * np.float32(1 / _LARGEST_U16), device], axis=-1))

    count = operators([mid, pair.mid, pair.mvis])
    return Ready(run, (table, pair.mid, pair.mvis), transform.backend, count)


def _version_4_mid(scene: CostScene, table: Profile) -> Profile:
    """A MID that holds the look-up tag of a version 4 profile, from the image to device values."""
    recipe = scene.recipe
    primaries = recipe.primaries
    parameters = MODELS[primaries.model].channels
    device = ("X", "Y", "Z", *NORMAL)
    conditions = viewing(primaries.illuminant, primaries.observer, primaries.white)
    pcs = Space("pcs", "XYZ ", ("X", "Y", "Z"))
    lut = as_elements(table["B2A1"], pcs, Space("device", table.header.colour_space, parameters), "B2A1")
    pick = Matrix.of(conditions.to_standard().elements[0].matrix @ np.eye(3, 6))
    adjust = [] if recipe.slopes is None else [slope_adjustment(recipe.slopes, recipe.slope_method)]
    process = MultiProcess.of(decoding(device, ranges(device, {}), device), *adjust, pick, *lut.elements)
    header = Header(device_class="mid ", colour_space="nc0006", mcs=f"mc{len(parameters):04x}")
    tags = {**text_tags("Version 4 table", parameters), "clrt": ColorantTable.of(device), "A2M0": process}
    return Profile(header, tags)


def _reduced(way: Way, scene: CostScene) -> Ready:
    """Parameters of an image with shorter sides, interpolated; normals and reflection of every pixel."""
    names, pair, mid = scene.names, scene.pair, scene.mid
    to_parameters = link([mid], channels=names, samples=scene.samples)
    channels = to_parameters.channels_out
    reflect = link([pair.mvis], env=_known(scene, pair.mvis), channels=channels)
    own = [(channels.index(name), names.index(name)) for name in NORMAL if name in names]
    kept = [j for j, name in enumerate(channels) if name not in NORMAL or name not in names]
    decode = to_parameters

    def run(tiles: Tiles) -> Stored:
        few = decode(shrunk(tiles, way.reduction))
        values = np.empty((*tiles.shape[:3], few.shape[-1]), np.float32)
        values[..., kept] = enlarged(few[..., kept], way.reduction)
        for j, i in own:
            values[..., j] = tiles[..., i] if scene.samples == "real" else tiles[..., i] * 2 - 1
        return reflect(values)

    profiles = (mid, pair.mvis)
    count = operators([mid]) / way.reduction**2 + operators([pair.mvis])
    return Ready(run, profiles, to_parameters.backend, count)


def shrunk(tiles: Tiles, factor: int) -> Tiles:
    """The means of squares of `factor` pixels a side; sides of (n, height, width, c) are multiples of it."""
    n, height, width, channels = tiles.shape
    squares = tiles.reshape(n, height // factor, factor, width // factor, factor, channels)
    means: Tiles = squares.mean(axis=(2, 4), dtype=np.float32)
    return means


def enlarged(tiles: Tiles, factor: int) -> Tiles:
    """Bilinear interpolation of (n, height, width, c) to sides `factor` times as long, held at the border."""
    for axis in (1, 2):
        before = np.take(tiles, [0, *range(tiles.shape[axis] - 1)], axis)
        after = np.take(tiles, [*range(1, tiles.shape[axis]), -1], axis)
        shape = list(tiles.shape)
        shape[axis] *= factor
        result = np.empty(shape, np.float32)
        for phase in range(factor):
            # Where the new pixel's centre lies, seen from that of the old one.
            offset = np.float32((phase + 0.5) / factor - 0.5)
            part = [slice(None)] * 4
            part[axis] = slice(phase, None, factor)
            result[tuple(part)] = tiles + abs(offset) * ((before if offset < 0 else after) - tiles)
        tiles = result
    return tiles


def _stored(way: Way, scene: CostScene, ready: Ready) -> Ready:
    """What `iccbrdf apply` stores of the results of another way."""
    if way.output == "16-bit XYZ":

        def u1_15(tiles: Tiles) -> Stored:
            levels = np.rint(ready.run(tiles) * np.float32(_ONE_U1_15))
            whole: Stored = np.clip(levels, 0, _LARGEST_U16).astype(np.uint16)
            return whole

        return replace(ready, run=u1_15, decode=lambda stored: stored / _ONE_U1_15)
    primaries = scene.recipe.primaries
    back = viewing(primaries.illuminant, primaries.observer, primaries.white).from_standard()
    to_own = back.elements[0].matrix.astype(np.float64)
    to_display, showing = standard_XYZ(ready.profiles[-1]), Showing(srgb())
    dtype = np.dtype(np.uint8 if way.output == "8-bit sRGB" else np.uint16)
    largest = np.iinfo(dtype).max

    def picture(tiles: Tiles) -> Stored:
        XYZ = to_display(ready.run(tiles))
        device = showing(XYZ.reshape(1, -1, 3)).device.reshape(XYZ.shape)
        levels: Stored = np.rint(device * largest).astype(dtype)
        return levels

    def decode(stored: Stored) -> Array:
        device = (stored / largest).reshape(1, -1, 3)
        XYZ: Array = to_XYZ(device, srgb(), "relative").astype(np.float64) @ to_own.T
        return XYZ.reshape(stored.shape)

    return replace(ready, run=picture, decode=decode)


def operators(profiles: Sequence[Profile]) -> float:
    """Operators of the programs of MIDs and MVIS that are executed for a pixel at most."""
    return float(
        sum(
            verify(element.program, element.inputs, element.outputs, element.elements).executed
            for profile in profiles
            for tag in ("A2M0", "M2B0")
            if tag in profile
            for element in profile[tag].elements
            if element.signature == "calc"
        )
    )


def _known(scene: CostScene, mvis: Profile) -> dict[str, float]:
    """The scene's run-time variables that the MVIS reads: a reduced one may have lost some."""
    read = link([mvis]).variables
    return {name: value for name, value in scene.env.items() if name in read}


def _method(scene: CostScene) -> InterpolationMethod:
    return "published" if scene.recipe.interpolation == "published" else "smooth"


def _table_mid(grid: int, scene: CostScene) -> Profile:
    recipe = scene.recipe
    return build_table_mid(
        recipe.primaries,
        method=_method(scene),
        grid=grid,
        slopes=recipe.slopes,
        slope_method=recipe.slope_method,
    )[0]


def _with_roughness(primaries: Primaries, model: str) -> Primaries:
    """The primaries as those of a model with another number of roughnesses: one for all, or that of Y."""
    columns = _places(MODELS[primaries.model].channels, MODELS[model].channels)
    entries = [
        replace(primary, parameters=tuple(primary.parameters[i] for i in columns))
        for primary in primaries.primaries
    ]
    return replace(primaries, model=model, primaries=tuple(entries))


def _roughness_columns(names: Sequence[str], model: str) -> tuple[tuple[str, ...], list[int]]:
    """The channels of an image with the roughnesses of another model, and where they come from."""
    others = [name for name in names if not name.startswith("m")]
    parameters = [n for n in MODELS[model].channels if n in others or n.startswith("m")]
    normals = [name for name in names if name in NORMAL]
    places = [*_places(names, parameters), *(names.index(name) for name in normals)]
    return (*parameters, *normals), places


def _places(names: Sequence[str], wanted: Sequence[str]) -> list[int]:
    """Where channels stand among `names`, whose roughness is one or three."""
    roughness = names.index("m" if "m" in names else "m.Y")
    return [names.index(name) if name in names else roughness for name in wanted]
