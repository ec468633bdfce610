"""iccbrdf demo: a relief print of a real landscape, from primaries to pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.cli.options import emit, environment, force_option, json_option
from iccbrdf.cli.pipeline import Output, check_outputs, run
from iccbrdf.cmm import link
from iccbrdf.demo import Image, landscape
from iccbrdf.files import make_folder, write_together
from iccbrdf.icc import Profile
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.images.display import create_png
from iccbrdf.resources import folder as shipped

SCENES = {
    "left": ("50,180", "0,0"),
    "top": ("50,90", "0,0"),
    "right": ("50,0", "0,0"),
    "mirror": ("40,90", "40,270"),
}
"""Light and view of each picture.  In the last one flat ground mirrors the light."""

SLOPES_LIGHT = "50,180"
"""Light of the pictures with and without slope adjustment."""

PRINTER = "fogra39_gloss"
"""Folder of the primaries and slopes that the colour MID is made of."""

EPILOG = """
\b
Examples:
  iccbrdf demo
  One more light, on the files that the demo made:
  iccbrdf apply demo/relief.tif -p demo/mid.icc -p demo/mvis.icc -o mine.png --light 70,135
  From XYZ and normals:
  iccbrdf apply demo/relief_xyz.tif -p demo/colour-mid.icc -p demo/mvis.icc -o mine.png
"""


@click.command("demo", epilog=EPILOG)
@click.option("-o", "--output", "folder", default="demo", show_default=True,
              type=click.Path(path_type=Path, file_okay=False), help="Folder for the results.")  # fmt: skip
@force_option
@json_option
def command(folder: Path, force: bool, as_json: bool) -> None:
    """Build profiles and softproof a relief print of a real landscape under several lights.

    \b
    relief.tif             the print as a BRDF image, for mid.icc and mvis.icc
    relief_xyz.tif         the print as XYZ of the flat colours and normals, for colour-mid.icc
    proof_*.png, xyz_*.tif softproofs of the BRDF image by light, and their XYZ
    proof_slopes.png       from XYZ and normals: left without, right with slope adjustment
    """
    make_folder(folder)
    proofs = {
        name: [Output(folder / f"proof_{name}.png"), Output(folder / f"xyz_{name}.tif")] for name in SCENES
    }
    images = {kind: folder / name for kind, name in (("brdf", "relief.tif"), ("xyz", "relief_xyz.tif"))}
    slopes_proof = folder / "proof_slopes.png"
    pictures = [output for outputs in proofs.values() for output in outputs]
    others = [Output(path) for path in (*images.values(), slopes_proof)]
    check_outputs([*pictures, *others], overwrite=force)

    tints = read_primaries(shipped("profiles") / "landscape" / "primaries.json")
    printer = shipped("profiles") / PRINTER
    primaries = read_primaries(printer / "primaries.json")
    pair = build_pair(tints)
    flat = build_colour_mid(primaries)
    sloped = build_colour_mid(primaries, slopes=read_slopes(printer / "slopes.json"))
    contents = {**pair.files, **sloped.files, "colour-mid-flat.icc": flat.mid.to_bytes()}
    profiles = {folder / name: data for name, data in contents.items()}
    write_together(profiles, overwrite=force)

    scene = landscape(tints)
    _write(scene.brdf, images["brdf"], force)
    _write(scene.xyz, images["xyz"], force)

    transform = link([pair.mid, pair.mvis])
    for name, (light, view) in SCENES.items():
        lit = transform.with_env(environment(light, view, ()))
        with open_tiff(images["brdf"]) as source:
            run(source, lit, pair.mvis, proofs[name], overwrite=force, label=f"light {name}")
    _side_by_side(images["xyz"], slopes_proof, [flat.mid, sloped.mid], pair.mvis, force)

    height, width, _ = scene.brdf.device.shape
    result = {
        "folder": str(folder),
        "images": {kind: str(path) for kind, path in images.items()},
        "profiles": [str(path) for path in profiles],
        "proofs": {
            name: {"light": light, "view": view, "files": [str(output.path) for output in proofs[name]]}
            for name, (light, view) in SCENES.items()
        },
        "slopes_proof": str(slopes_proof),
    }
    text = [
        f"profiles    {', '.join(map(str, profiles))}",
        f"BRDF image  {images['brdf']}: {width} x {height} pixels, {len(scene.brdf.names)} channels",
        f"XYZ image   {images['xyz']}: the same print, {len(scene.xyz.names)} channels",
        "softproofs and their XYZ, by light and view (zenith,azimuth):",
    ]
    for name, (light, view) in SCENES.items():
        files = ", ".join(str(output.path) for output in proofs[name])
        text.append(f"  {light:<7} {view:<7} {files}")
    text.append(f"  {SLOPES_LIGHT:<7} 0,0     {slopes_proof}: left without, right with slope adjustment")
    emit(as_json, "iccbrdf.demo/1", result, "\n".join(text))


def _write(image: Image, path: Path, overwrite: bool) -> None:
    height, width, _ = image.device.shape
    with create_tiff(
        path, height, width, image.names, samples="device", dtype="uint16", overwrite=overwrite
    ) as sink:
        sink.write(Block(0, 0, image.device))


def _side_by_side(
    image: Path, picture: Path, mids: Sequence[Profile], mvis: Profile, overwrite: bool
) -> None:
    """Softproofs of one image by several MIDs, beside each other in one picture."""
    env = environment(SLOPES_LIGHT, None, ())
    transforms = [link([mid, mvis], env=env) for mid in mids]
    with (
        open_tiff(image) as source,
        create_png(picture, source.height, source.width * len(mids), overwrite=overwrite) as sink,
    ):
        # Strips, so a block is as wide as the image.
        for block in source.blocks():
            proofs = [transform(block.data) for transform in transforms]
            sink.write(block._replace(data=np.concatenate(proofs, axis=1)))
