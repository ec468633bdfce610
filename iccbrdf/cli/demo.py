"""iccbrdf demo: a relief print of a real landscape, from primaries to pictures."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import build_pair
from iccbrdf.cli.options import emit, environment, force_option, json_option
from iccbrdf.cli.pipeline import Output, check_outputs, run
from iccbrdf.cmm import link
from iccbrdf.demo import landscape
from iccbrdf.files import check_target
from iccbrdf.icc import write_profile
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.resources import folder as shipped

LIGHTS = {"left": "60,180", "top": "60,90", "right": "60,0", "mirror": "25,90"}
VIEWS = {"mirror": "25,270"}


@click.command("demo")
@click.option("-o", "--output", "folder", default="demo", show_default=True,
              type=click.Path(path_type=Path, file_okay=False), help="Folder for the results.")  # fmt: skip
@force_option
@json_option
def command(folder: Path, force: bool, as_json: bool) -> None:
    """Build profiles and softproof a relief print of a real landscape under several lights.

    Writes the profiles, the BRDF image of the print (relief.tif), and for every light an XYZ TIFF and a PNG
    softproof.
    """
    folder.mkdir(parents=True, exist_ok=True)
    image = folder / "relief.tif"
    paths = {"mid": folder / "mid.icc", "mvis": folder / "mvis.icc"}
    proofs = {
        name: [Output(folder / f"proof_{name}.png"), Output(folder / f"xyz_{name}.tif")] for name in LIGHTS
    }
    for path in (image, *paths.values()):
        check_target(path, overwrite=force)
    for outputs in proofs.values():
        check_outputs(outputs, overwrite=force)

    primaries = read_primaries(shipped("profiles") / "landscape" / "primaries.json")
    pair = build_pair(primaries)
    write_profile(pair.mid, paths["mid"], overwrite=force)
    write_profile(pair.mvis, paths["mvis"], overwrite=force)

    scene = landscape(primaries)
    height, width, _ = scene.device.shape
    with create_tiff(
        image, height, width, scene.names, samples="device", dtype="uint16", overwrite=force
    ) as sink:
        sink.write(Block(0, 0, scene.device))

    transform = link([pair.mid, pair.mvis])
    lines = [f"{image}: {width} x {height} pixels of {', '.join(scene.names)}"]
    for name, outputs in proofs.items():
        scene_env = environment(LIGHTS[name], VIEWS.get(name), ())
        with open_tiff(image) as source:
            run(source, transform.with_env(scene_env), pair.mvis, outputs, overwrite=force, label=name)
        lines.append(
            f"light {LIGHTS[name]}, view {VIEWS.get(name, '0,0')}: " + ", ".join(str(o.path) for o in outputs)
        )
    result = {
        "image": str(image),
        "profiles": {name: str(path) for name, path in paths.items()},
        "proofs": {name: [str(o.path) for o in outputs] for name, outputs in proofs.items()},
    }
    lines.insert(0, f"profiles: {paths['mid']}, {paths['mvis']}")
    lines.append(f"Open the pictures: {folder}/proof_*.png")
    emit(as_json, "iccbrdf.demo/1", result, "\n".join(lines))
