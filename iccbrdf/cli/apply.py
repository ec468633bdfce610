"""iccbrdf apply: an image through profiles."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from iccbrdf import images
from iccbrdf.build import image_link, last_slope
from iccbrdf.cli.chain import chain_options
from iccbrdf.cli.options import (
    backend_option,
    emit,
    environment,
    force_option,
    json_option,
    name_list,
    scene_options,
)
from iccbrdf.cli.pipeline import (
    EXR_SUFFIX,
    Output,
    arranged_channels,
    check_decoded,
    check_outputs,
    open_image,
    run,
    run_on_cluster,
)
from iccbrdf.cmm import MAX_COST, link
from iccbrdf.cmm.effects import SUBSTITUTES
from iccbrdf.errors import UsageError
from iccbrdf.icc import Profile, read_profile
from iccbrdf.images import ImageSource, Samples, WithNormals, processors
from iccbrdf.images.blocks import Array
from iccbrdf.images.checks import NonFinite
from iccbrdf.scene import LIGHT, VIEW, that_are_read

MOST_WORKERS = 8
"""Unless more are asked for: reading and writing keep no more busy, and each takes memory."""

EPILOG = """
\b
Examples:
  A softproof lit from the right, and its XYZ:
    iccbrdf apply relief.tif -p mid.icc -p mvis.icc -o proof.png -o xyz.tif --light 60,0
  From the XYZ of the flat print and normals, and the BRDF image on the way:
    iccbrdf apply xyzn.tif -p colour-mid.icc -p mvis.icc -o proof.png
    iccbrdf apply xyzn.tif -p colour-mid.icc -o brdf.tif --dtype uint16
  XYZ of the flat print and a height map:
    iccbrdf apply xyz.tif -p colour-mid.icc -p mvis.icc -o proof.png \\
      --height relief.png --relief 2 --pixel-pitch 0.1
  Channels by name, for a TIFF from elsewhere:
    iccbrdf apply maps.tif -p mid.icc -p mvis.icc -o xyz.tif \\
      --channels kd.X,kd.Y,kd.Z,ks.X,ks.Y,ks.Z,m
  Flat and matte tiles by less work; and how the print looks without its relief:
    iccbrdf apply brdf.tif -p mid.icc -p mvis.icc -o proof.png --effects auto
    iccbrdf apply brdf.tif -p mid.icc -p mvis.icc -o flat.png --without relief
  A large image on a dask cluster whose machines share these files:
    iccbrdf apply big.tif -p mid.icc -p mvis.icc -o xyz.tif --cluster tcp://10.0.0.5:8786
"""


def _relief(
    normal_map: Path | None,
    green: str,
    height_map: Path | None,
    relief: float | None,
    pitch: float | None,
    size: tuple[int, int],
) -> Array | None:
    """Unit normals, (*size, 3), from one of the two kinds of maps; None where neither is given."""
    if normal_map is not None and height_map is not None:
        raise UsageError("--normals and --height are two ways to say one thing: give one of them")
    if (height_map is None) != (relief is None) or (height_map is None) != (pitch is None):
        raise UsageError("--height, --relief and --pixel-pitch belong together")
    if normal_map is not None:
        return images.read_normal_map(normal_map, "opengl" if green == "up" else "directx", size)
    if height_map is None or relief is None or pitch is None:
        return None
    return images.height_to_normals(images.read_height_map(height_map, relief, size=size), pitch)


def _effects(effects: str | None, left_out: str | None) -> str | list[str]:
    """What --effects asks for, as `link` takes it."""
    if effects is None:
        return "full" if left_out is None else "auto"
    return effects if effects in ("auto", "full") else _names(effects)


def _names(effects: str) -> list[str]:
    return [name.replace("_", "-") for name in name_list(effects)]


def _recompiled(
    chain: list[Profile], effects: str | list[str], without: list[str]
) -> tuple[list[Profile], str | list[str], list[str]]:
    """Profiles whose programs have the effects asked for, and what is left of both lists for `link`."""
    named = [] if isinstance(effects, str) else effects
    switches = {**dict.fromkeys(named, True), **dict.fromkeys(without, False)}
    asked = {name: on for name, on in switches.items() if SUBSTITUTES.get(name, {}) is None}
    if not asked:
        return chain, effects, without
    # The compiler is needed for this alone.
    from iccbrdf.build.source import with_effects

    chain, known = with_effects(chain, asked)
    rest = effects if isinstance(effects, str) else [name for name in effects if name not in known]
    return chain, rest, [name for name in without if name not in known]


@click.command("apply", epilog=EPILOG)
@click.argument("image", type=click.Path(path_type=Path))
@click.option("-p", "--profile", "profiles", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A profile of the chain, in order: the MID, then the MVIS.")  # fmt: skip
@click.option("-o", "--output", "outputs", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A file to write; repeatable.  .tif, .exr: what the chain gives, as real values (XYZ with "
              "Y = 1 for white).  .png: a softproof in sRGB.")  # fmt: skip
@scene_options
@click.option("--effects", metavar="auto|full|NAMES",
              help="auto: tiles that are flat or matte, or have other channels constant, run only what they "
              "call for, with the same result.  full: every pixel runs everything.  Or the names of those to "
              "have of relief, specular, chromatic-specular and chromatic-roughness, separated by commas.  "
              "Default: full, with --without auto.")  # fmt: skip
@click.option("--without", "left_out", metavar="NAMES",
              help="Effects to leave out: of these four and, where a profile holds its source, fresnel, "
              "shadowing, below-horizon and highlight-range, which --effects puts back.")  # fmt: skip
@backend_option
@chain_options
@click.option("--samples", type=click.Choice(("device", "real")),
              help="What a float image holds, where it does not say so itself: device values 0..1, or real "
              "ones (signed normals, physical parameters).")  # fmt: skip
@click.option("--channels", metavar="NAMES", help="Names of the image's channels, separated by commas, where "
              "it does not say them itself.  A channel left out takes the default of the MVIS.")  # fmt: skip
@click.option("--normals", "normal_map", type=click.Path(path_type=Path),
              help="A normal map (PNG or TIFF) of the image's size: its channels n.x, n.y, n.z.")  # fmt: skip
@click.option("--green", type=click.Choice(("up", "down")), default="up", show_default=True,
              help="Which way green points in the normal map: up (OpenGL) or down (DirectX).")  # fmt: skip
@click.option("--height", "height_map", type=click.Path(path_type=Path),
              help="A height map (PNG or TIFF) of the image's size, white on top, instead.")  # fmt: skip
@click.option("--relief", type=click.FloatRange(min=0, min_open=True), metavar="LENGTH",
              help="Height of white (of 1, in a float file) above black, such as 2 (mm).")  # fmt: skip
@click.option("--pixel-pitch", "pitch", type=click.FloatRange(min=0, min_open=True), metavar="LENGTH",
              help="Distance of the height map's pixels on the print, in the same unit.")  # fmt: skip
@click.option("--dtype", type=click.Choice(("float32", "uint16")), default="float32", show_default=True,
              help="Samples of a TIFF; uint16 holds XYZ as the ICC's u1.15.")  # fmt: skip
@click.option("--compression", type=click.Choice(("none", "deflate", "zstd")), default="none",
              show_default=True, help="Of a TIFF.")  # fmt: skip
@click.option("--embed", is_flag=True, help="Embed the last profile in a TIFF.")
@click.option("--exposure", type=click.FloatRange(min=0, min_open=True), default=1.0,
              show_default=True, help="Factor on the XYZ of a PNG.")  # fmt: skip
@click.option(
    "--depth", type=click.Choice(("8", "16")), default="8", show_default=True, help="Bits of a PNG."
)
@click.option("--nonfinite", type=click.Choice(("keep", "zero", "error")), default="keep", show_default=True,
              help="What to do with pixels of the image that are not finite: pass them on, take all their "
              "samples for 0, or stop.")  # fmt: skip
@click.option("--max-cost", type=click.FloatRange(min=0, min_open=True), default=MAX_COST, show_default=True,
              help="Operators of the profiles that all pixels together may take.")  # fmt: skip
@click.option("--double", is_flag=True, help="Compute in float64.")
@click.option("--workers", type=click.IntRange(1), default=lambda: min(processors(), MOST_WORKERS),
              show_default=f"the processors, at most {MOST_WORKERS}",
              help="Blocks of the image that are read and computed at a time.")  # fmt: skip
@click.option("--cluster", metavar="ADDRESS",
              help="Compute on a dask cluster: its scheduler's address, or local:N for N processes here.  "
              "All its machines must see the files under the same paths.")  # fmt: skip
@force_option
@json_option
def command(
    image: Path,
    profiles: tuple[Path, ...],
    outputs: tuple[Path, ...],
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    effects: str | None,
    left_out: str | None,
    backend: str,
    intent: str | list[str],
    conditions: dict[int, Path],
    samples: Samples | None,
    channels: str | None,
    normal_map: Path | None,
    green: str,
    height_map: Path | None,
    relief: float | None,
    pitch: float | None,
    dtype: Literal["float32", "uint16"],
    compression: Literal["none", "deflate", "zstd"],
    embed: bool,
    exposure: float,
    depth: str,
    nonfinite: NonFinite,
    max_cost: float,
    double: bool,
    workers: int,
    cluster: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Map IMAGE, a TIFF or OpenEXR file, through a chain of profiles.

    The image holds the channels of the first profile, each encoded in 0..1, or their real values: for a MID
    of `iccbrdf build` the BRDF parameters and the normal, for a colour MID XYZ and the normal.  A colour MID
    alone writes the BRDF image, encoded for the binding MID.
    """
    wanted, gone = _effects(effects, left_out), _names(left_out or "")
    chain, kept, omitted = _recompiled([read_profile(path) for path in profiles], wanted, gone)
    last = chain[-1]
    to_image = image_link(last) if len(chain) == 1 else None
    if to_image is not None:
        chain.append(to_image)
    embedded = last.to_bytes() if embed else None
    packing = None if compression == "none" else compression
    targets = [
        Output(path, dtype, embedded, packing, exposure, 16 if depth == "16" else 8) for path in outputs
    ]
    check_outputs(targets, overwrite=force)
    scene, own_variables = environment(light, view, ()), environment(None, None, env)
    if cluster is not None and (normal_map or height_map):
        raise UsageError("a cluster reads one image: leave --normals and --height out, or --cluster")
    if cluster is not None and image.suffix.lower() == EXR_SUFFIX:
        raise UsageError(f"a cluster reads TIFFs, whose blocks can be found one by one; found {image}")
    with open_image(image, samples) as opened:
        normals = _relief(normal_map, green, height_map, relief, pitch, (opened.height, opened.width))
        declared = name_list(channels) if channels is not None else None
        source: ImageSource = opened
        if normals is not None:
            own = declared or opened.names
            if own is None or len(own) != opened.channels:
                raise UsageError(
                    f"{image}: found {opened.channels} channels without names beside those of the relief; "
                    "name them with --channels, such as X,Y,Z"
                )
            source, declared = WithNormals(opened, own, normals), None
        settings: dict[str, Any] = {
            "intent": intent,
            "conditions": conditions,
            "dtype": "float64" if double else "float32",
            "samples": source.samples,
            "backend": backend,
            "effects": kept,
            "without": omitted,
            "max_cost": max_cost,
        }
        transform = link(chain, **settings)
        settings["env"] = that_are_read(scene, transform.variables) | own_variables
        transform = transform.with_env(settings["env"])
        names = arranged_channels(source, transform.channels_in, declared)
        if names is not None:
            transform = link(chain, channels=names, **settings)
        check_decoded(chain[0], source, transform.channels_in)
        common: dict[str, Any] = {
            "overwrite": force,
            "last_slope": last_slope(chain[0]),
            "nonfinite": nonfinite,
        }
        if cluster is None:
            done = run(source, transform, last, targets, label=image.name, workers=workers, **common)
        else:
            done = run_on_cluster(source, transform, targets, cluster, **common)
        size = f"{source.width} x {source.height} pixels"
        result = {
            "image": str(image),
            "width": source.width,
            "height": source.height,
            "samples": source.samples,
            "channels_in": list(transform.channels_in),
            "channels_out": list(transform.channels_out),
            "profiles": [str(path) for path in profiles],
            "intent": intent,
            "env": dict(transform.env),
            "backend": transform.backend,
            "backend_reason": transform.execution.reason,
            "effects": wanted,
            "without": gone,
            "kinds": dict(done.kinds) if transform.adaptive else {},
            "nonfinite": nonfinite,
            "not_finite_in": done.not_finite_in,
            "not_finite_out": done.not_finite_out,
            "beyond_slopes": done.beyond_slopes,
            "outputs": done.outputs,
        }
    for count, what, more in (
        (done.not_finite_in, "image", "; their pixels are taken for 0" if nonfinite == "zero" else ""),
        (done.not_finite_out, "result", ""),
    ):
        if count:
            click.echo(
                f"iccbrdf: warning: {count} samples of the {what} are not finite numbers{more}", err=True
            )
    if done.beyond_slopes:
        click.echo(
            f"iccbrdf: warning: {done.beyond_slopes} pixels are steeper than the last measured slope of "
            f"{last_slope(chain[0]):g} degrees, which holds for them",
            err=True,
        )
    text = [f"{image}: {size}, {len(transform.channels_in)} channels ({source.samples} samples)"]
    if not {*LIGHT, *VIEW}.isdisjoint(transform.variables):
        own = "of the profiles"
        text.append(f"  light {light or own}, view {view or own}")
    for output in done.outputs:
        counts = [f"{n} {name.replace('_', ' ')}" for name, n in output.items() if name != "path" and n]
        text.append(f"  -> {output['path']}" + (f" ({', '.join(counts)})" if counts else ""))
    if transform.adaptive and done.kinds and effects is not None:
        shares = (f"{n / done.kinds.total():.0%} {kind}" for kind, n in done.kinds.most_common())
        text.append(f"  tiles: {', '.join(shares)}")
    emit(as_json, "iccbrdf.apply/1", result, "\n".join(text))
