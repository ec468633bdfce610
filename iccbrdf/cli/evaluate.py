"""iccbrdf evaluate: the papers' experiments on measurements, the papers' figures beside ours."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from iccbrdf.brdf.interpolation import InterpolationMethod
from iccbrdf.brdf.slopes import SlopeMethod
from iccbrdf.build import INTERPOLATIONS, SLOPE_METHODS
from iccbrdf.cli.options import emit, force_option, json_option
from iccbrdf.errors import UsageError
from iccbrdf.files import check_target, make_folder, write_together
from iccbrdf.report import evaluate_print, histograms, orderings, read_print, tables
from iccbrdf.report.plots import PICTURES, plots

EPILOG = """
\b
Examples:
  iccbrdf simulate -o print
  iccbrdf evaluate print --plots print/plots
  To the letter of the papers:
  iccbrdf evaluate print --as-published --interpolation published --slope-method published
"""


@click.command("evaluate", epilog=EPILOG)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--as-published", is_flag=True,
              help="Compare the models' I, cosine included, with the measured reflectance, as the papers "
              "do; by default the same quantity of both.")  # fmt: skip
@click.option("--interpolation", type=click.Choice(INTERPOLATIONS), default="smooth", show_default=True,
              help="From colours to parameters: continuous, or as published.")  # fmt: skip
@click.option("--slope-method", type=click.Choice(SLOPE_METHODS), default="affine", show_default=True,
              help="From the flat colour to the one on a slope: continuous, or as published.")  # fmt: skip
@click.option("--plots", "pictures", type=click.Path(path_type=Path, file_okay=False),
              help="Folder for plots; made if need be.")  # fmt: skip
@force_option
@json_option
def command(
    folder: Path,
    as_published: bool,
    interpolation: InterpolationMethod,
    slope_method: SlopeMethod,
    pictures: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Evaluate fits, interpolation and slope adjustment on the measurements in DIR.

    DIR holds what `iccbrdf simulate` writes, or real measurements under the same names: primaries.csv,
    tests.csv, slopes.csv and slopes.json.  The tables are those of Habib, Green and Nussbaum (2020, 2023);
    the papers' figures stand in brackets beside the figures of DIR.
    """
    if force and pictures is None:
        raise UsageError("--force says that plots may replace files: it needs --plots")
    if pictures is not None:
        make_folder(pictures)
        for name in PICTURES:
            check_target(pictures / name, overwrite=force)
    data = read_print(folder)
    evaluation = evaluate_print(
        data, as_published=as_published, interpolation=interpolation, slope_method=slope_method
    )
    found, claims = tables(evaluation), orderings(evaluation)
    files: dict[Path, bytes] = {}
    if pictures is not None:
        files = {pictures / name: data for name, data in plots(evaluation).items()}
        write_together(files, overwrite=force)
    result = {
        "source": data.primaries.source,
        "as_published": as_published,
        "interpolation": interpolation,
        "slope_method": slope_method,
        "tables": [table.to_dict() for table in found],
        "wilcoxon": asdict(evaluation.wilcoxon),
        "histograms": histograms(evaluation.slopes),
        "orderings": [claim.to_dict() for claim in claims],
        "files": [str(file) for file in files],
    }
    text = [
        f"source         {data.primaries.source}",
        f"compared       {'I as published' if as_published else 'the same quantity of model and data'}",
        f"interpolation  {interpolation}; slope adjustment {slope_method}",
        "In brackets: the papers' figures, of other prints.",
        *(f"\n{table}" for table in found),
        "\nOrderings of the papers: the first figure is to be below the second",
        *map(str, claims),
        *(f"  -> {file}" for file in files),
    ]
    emit(as_json, "iccbrdf.evaluate/1", result, "\n".join(text))
