"""iccbrdf apply: an image through profiles."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from iccbrdf.build import image_link, last_slope
from iccbrdf.cli.options import emit, environment, force_option, json_option, name_list, scene_options
from iccbrdf.cli.pipeline import Output, arranged_channels, check_outputs, run
from iccbrdf.cmm import INTENTS, link
from iccbrdf.icc import read_profile
from iccbrdf.images import Samples, open_tiff

EPILOG = """
\b
Examples:
  A softproof lit from the right, and its XYZ:
    iccbrdf apply relief.tif -p mid.icc -p mvis.icc -o proof.png -o xyz.tif --light 60,0
  From the XYZ of the flat print and normals, and the BRDF image on the way:
    iccbrdf apply xyzn.tif -p colour-mid.icc -p mvis.icc -o proof.png
    iccbrdf apply xyzn.tif -p colour-mid.icc -o brdf.tif --dtype uint16
  Channels by name, for a TIFF from elsewhere:
    iccbrdf apply maps.tif -p mid.icc -p mvis.icc -o xyz.tif \\
      --channels kd.X,kd.Y,kd.Z,ks.X,ks.Y,ks.Z,m
"""


@click.command("apply", epilog=EPILOG)
@click.argument("image", type=click.Path(path_type=Path))
@click.option("-p", "--profile", "profiles", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A profile of the chain, in order: the MID, then the MVIS.")  # fmt: skip
@click.option("-o", "--output", "outputs", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A file to write; repeatable.  .tif: what the chain gives, as real values (XYZ with Y = 1 "
              "for white).  .png: a softproof in sRGB.")  # fmt: skip
@scene_options
@click.option("--intent", type=click.Choice(INTENTS), default="relative", show_default=True)
@click.option("--samples", type=click.Choice(("device", "real")),
              help="What a float image holds, where it does not say so itself: device values 0..1, or real "
              "ones (signed normals, physical parameters).")  # fmt: skip
@click.option("--channels", metavar="NAMES", help="Names of the image's channels, separated by commas, where "
              "it does not say them itself.  A channel left out takes the default of the MVIS.")  # fmt: skip
@click.option("--dtype", type=click.Choice(("float32", "uint16")), default="float32", show_default=True,
              help="Samples of a TIFF; uint16 holds XYZ as the ICC's u1.15.")  # fmt: skip
@click.option("--embed", is_flag=True, help="Embed the last profile in a TIFF.")
@click.option("--exposure", type=click.FloatRange(min=0, min_open=True), default=1.0,
              show_default=True, help="Factor on the XYZ of a PNG.")  # fmt: skip
@click.option(
    "--depth", type=click.Choice(("8", "16")), default="8", show_default=True, help="Bits of a PNG."
)
@click.option("--double", is_flag=True, help="Compute in float64.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Threads that compute.")
@force_option
@json_option
def command(
    image: Path,
    profiles: tuple[Path, ...],
    outputs: tuple[Path, ...],
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    intent: str,
    samples: Samples | None,
    channels: str | None,
    dtype: Literal["float32", "uint16"],
    embed: bool,
    exposure: float,
    depth: str,
    double: bool,
    workers: int,
    force: bool,
    as_json: bool,
) -> None:
    """Map IMAGE, a TIFF, through a chain of profiles.

    The image holds the channels of the first profile, each encoded in 0..1, or their real values: for a MID
    of `iccbrdf build` the BRDF parameters and the normal, for a colour MID XYZ and the normal.  A colour MID
    alone writes the BRDF image, encoded for the binding MID.
    """
    chain = [read_profile(path) for path in profiles]
    last = chain[-1]
    to_image = image_link(last) if len(chain) == 1 else None
    if to_image is not None:
        chain.append(to_image)
    embedded = last.to_bytes() if embed else None
    targets = [Output(path, dtype, embedded, exposure, 16 if depth == "16" else 8) for path in outputs]
    check_outputs(targets, overwrite=force)
    variables = environment(light, view, env)
    with open_tiff(image, samples) as source:
        settings: dict[str, Any] = {
            "env": variables,
            "intent": intent,
            "threads": workers,
            "dtype": "float64" if double else "float32",
            "samples": source.samples,
        }
        transform = link(chain, **settings)
        declared = name_list(channels) if channels is not None else None
        names = arranged_channels(source, transform.channels_in, declared)
        if names is not None:
            transform = link(chain, channels=names, **settings)
        done = run(
            source,
            transform,
            last,
            targets,
            overwrite=force,
            label=image.name,
            last_slope=last_slope(chain[0]),
        )
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
            "not_finite_in": done.not_finite_in,
            "not_finite_out": done.not_finite_out,
            "beyond_slopes": done.beyond_slopes,
            "outputs": done.outputs,
        }
    for count, what in ((done.not_finite_in, "image"), (done.not_finite_out, "result")):
        if count:
            click.echo(f"iccbrdf: warning: {count} samples of the {what} are not finite numbers", err=True)
    if done.beyond_slopes:
        click.echo(
            f"iccbrdf: warning: {done.beyond_slopes} pixels are steeper than the last measured slope of "
            f"{last_slope(chain[0]):g} degrees, which holds for them",
            err=True,
        )
    text = [f"{image}: {size}, {len(transform.channels_in)} channels ({source.samples} samples)"]
    for output in done.outputs:
        counts = [f"{n} {name.replace('_', ' ')}" for name, n in output.items() if name != "path" and n]
        text.append(f"  -> {output['path']}" + (f" ({', '.join(counts)})" if counts else ""))
    emit(as_json, "iccbrdf.apply/1", result, "\n".join(text))
