"""iccbrdf demo: a relief print of a real landscape, from primaries to pictures."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import build_pair
from iccbrdf.cli.build import write_pair
from iccbrdf.cli.options import emit, environment, force_option, json_option
from iccbrdf.cli.pipeline import Output, check_outputs, run
from iccbrdf.cmm import link
from iccbrdf.demo import landscape
from iccbrdf.files import check_target, make_folder
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.resources import folder as shipped

SCENES = {
    "left": ("50,180", "0,0"),
    "top": ("50,90", "0,0"),
    "right": ("50,0", "0,0"),
    "mirror": ("40,90", "40,270"),
}
"""Light and view of each picture.  In the last one flat ground mirrors the light."""

EPILOG = """
\b
Examples:
  iccbrdf demo
  One more light, on the files that the demo made:
  iccbrdf apply demo/relief.tif -p demo/mid.icc -p demo/mvis.icc -o mine.png --light 70,135
"""


@click.command("demo", epilog=EPILOG)
@click.option("-o", "--output", "folder", default="demo", show_default=True,
              type=click.Path(path_type=Path, file_okay=False), help="Folder for the results.")  # fmt: skip
@force_option
@json_option
def command(folder: Path, force: bool, as_json: bool) -> None:
    """Build profiles and softproof a relief print of a real landscape under several lights.

    Writes the profiles with their listing, the BRDF image of the print (relief.tif), and for every light an
    XYZ TIFF and a PNG softproof.
    """
    make_folder(folder)
    image = folder / "relief.tif"
    check_target(image, overwrite=force)
    proofs = {
        name: [Output(folder / f"proof_{name}.png"), Output(folder / f"xyz_{name}.tif")] for name in SCENES
    }
    check_outputs([output for outputs in proofs.values() for output in outputs], overwrite=force)

    primaries = read_primaries(shipped("profiles") / "landscape" / "primaries.json")
    pair = build_pair(primaries)
    profiles = write_pair(pair, folder, overwrite=force)

    scene = landscape(primaries)
    height, width, _ = scene.device.shape
    with create_tiff(
        image, height, width, scene.names, samples="device", dtype="uint16", overwrite=force
    ) as sink:
        sink.write(Block(0, 0, scene.device))

    transform = link([pair.mid, pair.mvis])
    for name, (light, view) in SCENES.items():
        lit = transform.with_env(environment(light, view, ()))
        with open_tiff(image) as source:
            run(source, lit, pair.mvis, proofs[name], overwrite=force, label=f"light {name}")

    result = {
        "folder": str(folder),
        "image": str(image),
        "profiles": [str(path) for path in profiles],
        "proofs": {
            name: {"light": light, "view": view, "files": [str(output.path) for output in proofs[name]]}
            for name, (light, view) in SCENES.items()
        },
    }
    text = [
        f"profiles    {', '.join(map(str, profiles))}",
        f"BRDF image  {image}: {width} x {height} pixels, {len(scene.names)} channels",
        "softproofs and their XYZ, by light and view (zenith,azimuth):",
    ]
    for name, (light, view) in SCENES.items():
        files = ", ".join(str(output.path) for output in proofs[name])
        text.append(f"  {light:<7} {view:<7} {files}")
    emit(as_json, "iccbrdf.demo/1", result, "\n".join(text))
