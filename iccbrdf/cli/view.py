"""iccbrdf view: a print as one HTML file in which its light can be moved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from iccbrdf.cli.options import emit, environment, force_option, json_option, name_list, scene_options
from iccbrdf.cli.pipeline import arranged_channels, check_decoded
from iccbrdf.errors import UsageError
from iccbrdf.files import atomic_output, check_target
from iccbrdf.icc import Profile, read_profile
from iccbrdf.images import ImageSource, Samples, open_tiff

MAX_PIXELS = 4_000_000
"""As iccbrdf.viewer has it, which would take longer to import than this file to read."""

EPILOG = """
\b
Examples:
  A relief print that can be lit in a browser, on a phone too:
    iccbrdf view relief.tif -p mid.icc -p mvis.icc -o proof.html
  From the XYZ of the flat print and normals, for another display:
    iccbrdf view xyzn.tif -p colour-mid.icc -p mvis.icc -o proof.html --display display-p3
  What `iccbrdf proof --keep flat` wrote to a folder:
    iccbrdf view out -o proof.html
"""


@click.command("view", epilog=EPILOG)
@click.argument("proof", type=click.Path(path_type=Path))
@click.option("-p", "--profile", "profiles", multiple=True, type=click.Path(path_type=Path),
              help="A profile of the chain, in order: the MID, then the MVIS.")  # fmt: skip
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="The page to write.")
@scene_options
@click.option("--display", default="srgb", show_default=True, metavar="NAME|FILE",
              help="srgb, display-p3, or the profile (version 2 or 4) of a display whose browser leaves "
              "colours as they are.")  # fmt: skip
@click.option("--max-pixels", type=click.IntRange(1, MAX_PIXELS), default=MAX_PIXELS, show_default=True,
              help="A larger image is made smaller by a whole number, each pixel the mean of those "
              "that it covers.")  # fmt: skip
@click.option("--title", help="Of the page.  [default: the name of PROOF]")
@click.option("--samples", type=click.Choice(("device", "real")),
              help="What a float image holds, where it does not say so itself.")  # fmt: skip
@click.option("--channels", metavar="NAMES", help="Names of the image's channels, separated by commas, where "
              "it does not say them itself.")  # fmt: skip
@force_option
@json_option
def command(
    proof: Path,
    profiles: tuple[Path, ...],
    output: Path,
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    display: str,
    max_pixels: int,
    title: str | None,
    samples: Samples | None,
    channels: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Write PROOF as one HTML file that needs no server and no network.

    PROOF is a TIFF as `iccbrdf apply` takes it, with the profiles that it goes through, or a folder of
    `iccbrdf proof`.  The page computes the profiles' program for every pixel on the graphics processor.
    """
    from iccbrdf.viewer import make_display, make_page, read_folder, read_print
    from iccbrdf.viewer.cost import cost

    check_target(output, overwrite=force)
    image, paths, name = proof, profiles, proof.stem
    variables: dict[str, float] = {}
    start = None
    if proof.is_dir():
        found = read_folder(proof)
        image, paths, name, start = found.image, profiles or found.profiles, found.title, found.start
        variables.update(found.env)
    if not paths:
        raise UsageError(f"{proof}: say by which profiles it is seen: -p MID -p MVIS")
    variables |= environment(light, view, env)
    chain = [read_profile(path) for path in paths]
    shown_on = make_display(display)
    with open_tiff(image, samples) as source:
        names = _names(source, chain[0], channels)
        shown = read_print(source, chain, names, variables, max_pixels=max_pixels)
    page = make_page(shown, shown_on, name if title is None else title, start)
    with atomic_output(output, overwrite=force) as temporary:
        temporary.write_text(page, encoding="utf-8")
    height, width = shown.size
    result: dict[str, Any] = {
        "image": str(image),
        "profiles": [str(path) for path in paths],
        "output": str(output),
        "bytes": output.stat().st_size,
        "size": {"width": width, "height": height},
        "divisor": shown.divisor,
        "channels": list(shown.chain.channels),
        "effects": list(shown.programs.effects),
        "mid_run_now": shown.run_now,
        "display": display,
        "cost": cost(shown, shown_on),
    }
    estimate = result["cost"]["laptop_1080p"]
    text = [
        f"{output}: {width} x {height} pixels"
        + (f", each the mean of {shown.divisor} x {shown.divisor}" if shown.divisor > 1 else "")
        + f", {result['bytes'] / 1e6:.1f} MB",
        f"  {result['cost']['operations_a_pixel']} operations a pixel; on a laptop some "
        f"{estimate['milliseconds']:.1f} ms a frame at {estimate['width']} x {estimate['height']}",
    ]
    if shown.run_now:
        text.append(f"  the MID was run now, the page runs the MVIS: {shown.run_now}")
    emit(as_json, "iccbrdf.view/1", result, "\n".join(text))


def _names(source: ImageSource, first: Profile, channels: str | None) -> tuple[str, ...] | None:
    """The image's channels as they are declared or recorded; None for those of the first profile."""
    from iccbrdf.cmm.stages import stages

    own = stages([first], "relative")[0].source.names
    declared = name_list(channels) if channels is not None else None
    found = arranged_channels(source, own, declared)
    check_decoded(first, source, own if found is None else found)
    return None if found is None else tuple(found)
