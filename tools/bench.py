"""What iccbrdf costs in time and memory, as ratios within one run.

    python tools/bench.py [-o docs] [--only NAME ...] [--large 200]

Writes bench.json, bench.md and bench_growth.png.  The ICC's own CMM (package iccdev) runs the same profiles
on the same pixels.  Every figure is the median of seven runs that take turns, so that a slow spell of the
machine slows all of them; absolute times are those of the machine, and shared ones are slow at times.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import iccdev
import matplotlib as mpl
import numpy as np
from bench_scenes import moved, scenes
from matplotlib import pyplot as plt
from numpy.typing import NDArray

import iccbrdf
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.build.profiles import XYZ_RANGE, text_tags
from iccbrdf.calc import parse, verify
from iccbrdf.icc import Calculator, Header, Matrix, MultiProcess, Profile
from iccbrdf.resources import folder

Array = NDArray[Any]
REPEATS = 7
MEGAPIXEL = 1 << 20
FEW = 1 << 16
"""Pixels where the reference takes tens of microseconds for each."""
GROWTH_SIZES = (1, 4, 16, 64)
"""Megapixels of the images whose time per pixel is compared; the largest is an option."""
PROGRAM_SIZES = (50, 100, 200, 500, 1000, 2000, 5000)


@dataclass(frozen=True)
class Row:
    """One line of the table: `ratio` is to be at least (or at most) `goal`, if there is one."""

    work: str
    against: str
    ratio: float
    goal: float | None
    at_most: bool = False
    figures: Mapping[str, float] | None = None

    @property
    def holds(self) -> bool:
        if self.goal is None:
            return True
        return self.ratio <= self.goal if self.at_most else self.ratio >= self.goal


def in_turns(works: Mapping[str, Callable[[], Any]], repeats: int = REPEATS) -> dict[str, float]:
    """Median seconds of each, all run once before and then in turns."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(repeats + 1):
        for name, work in works.items():
            start = time.perf_counter()
            work()
            if turn:
                seconds[name].append(time.perf_counter() - start)
    return {name: median(values) for name, values in seconds.items()}


# Profiles and pixels -----------------------------------------------------------------------------------


PRIMARIES = read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")


def brdf_pixels(count: int, seed: int = 1) -> Array:
    """Device values of a BRDF image: mixtures of the primaries on a hilly relief."""
    rng = np.random.default_rng(seed)
    pair = build_pair(PRIMARIES)
    element = pair.mid["A2M0"].elements[0]
    parameters = rng.dirichlet(np.full(len(PRIMARIES.primaries), 0.6), count) @ PRIMARIES.parameters
    real = np.concatenate([parameters, normals(count, rng)], axis=1)
    return ((real - element.offset) / np.diag(element.matrix)).astype(np.float32)


def colour_pixels(count: int, seed: int = 2) -> Array:
    """Device values of XYZ and normals."""
    rng = np.random.default_rng(seed)
    XYZ = rng.dirichlet(np.full(len(PRIMARIES.primaries), 0.6), count) @ PRIMARIES.XYZ
    return np.concatenate([XYZ / XYZ_RANGE[1], (normals(count, rng) + 1) / 2], axis=1).astype(np.float32)


def normals(count: int, rng: np.random.Generator) -> Array:
    slopes = rng.normal(0, 0.3, (count, 2))
    vectors = np.concatenate([slopes, np.ones((count, 1))], axis=1)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def reference(profiles: Sequence[Profile], place: Path) -> iccdev.IccCmm:
    """The ICC's CMM with a chain attached."""
    cmm = iccdev.IccCmm()
    for i, profile in enumerate(profiles):
        path = place / f"reference-{i}.icc"
        path.write_bytes(profile.to_bytes())
        cmm.attach(path, intent=1, lut_type=iccdev.LutType.MCS)
    cmm.begin()
    return cmm


def identity(names: Sequence[str]) -> Profile:
    """A MID that changes nothing, without which the reference runs no MVIS."""
    n = len(names)
    header = Header(device_class="mid ", colour_space=f"nc{n:04x}", mcs=f"mc{n:04x}")
    process = MultiProcess(n, n, (Matrix.of(np.eye(n)),))
    return Profile(header, {**text_tags("identity", names), "A2M0": process})


def program_profile(operators: int) -> Profile:
    """An MVIS of three channels whose program has so many operators: sums, products, some roots."""
    rng = np.random.default_rng(operators)
    text = ["in(0,3) tput(0,3)"]
    count = 2
    while count < operators - 2:
        a, b = rng.integers(0, 3, 2)
        step = rng.choice(
            [f"tget({a}) tget({b}) mul 0.5 add tput({a})", f"tget({a}) sq 0.1 add sqrt tput({b})"],
            p=[0.75, 0.25],
        )
        text.append(step)
        count += len(step.split())
    program = parse(" ".join(text) + " tget(0,3) out(0,3)")
    channels = ("a", "b", "c")
    header = Header(device_class="mvis", pcs="XYZ ", mcs="mc0003")
    process = MultiProcess(3, 3, (Calculator(inputs=3, outputs=3, program=program),))
    return Profile(header, {**text_tags("generated", channels), "M2B0": process})


# Rows --------------------------------------------------------------------------------------------------


def cook_torrance(place: Path) -> list[Row]:
    pair = build_pair(PRIMARIES)
    chain = [pair.mid, pair.mvis]
    pixels = brdf_pixels(MEGAPIXEL)
    cmm = reference(chain, place)
    numpy = iccbrdf.link(chain, backend="numpy")
    llvm = {n: iccbrdf.link(chain, backend="llvm", threads=n) for n in (1, 2)}
    out = np.empty((len(pixels), 3), np.float32)

    def copied() -> None:
        out[:] = pixels.copy()[:, :3]

    seconds = in_turns(
        {
            "iccdev": lambda: cmm.apply_ndarray(pixels),
            "numpy": lambda: numpy(pixels),
            "llvm 1": lambda: llvm[1](pixels),
            "llvm 2": lambda: llvm[2](pixels),
            "copy": copied,
        }
    )
    figures = per_pixel(seconds, len(pixels))
    work = "Cook-Torrance, MID + MVIS, 1 Mpixel, 10 channels"
    against = "iccdev, the same profiles"
    return [
        Row(f"{work}, NumPy, 1 thread", against, seconds["iccdev"] / seconds["numpy"], 30, figures=figures),
        Row(f"{work}, LLVM, 1 thread", against, seconds["iccdev"] / seconds["llvm 1"], 150),
        Row(f"{work}, LLVM, 2 threads", against, seconds["iccdev"] / seconds["llvm 2"], 250),
    ]


def interpolation(place: Path) -> list[Row]:
    pixels = colour_pixels(FEW)
    mvis = build_pair(PRIMARIES).mvis
    chains = {
        name: [build_colour_mid(PRIMARIES, interpolation=name).mid, mvis] for name in ("published", "smooth")
    }
    cmm = reference(chains["published"], place)
    published = {backend: iccbrdf.link(chains["published"], backend=backend) for backend in ("numpy", "llvm")}
    smooth = iccbrdf.link(chains["smooth"], backend="llvm")
    seconds = in_turns(
        {
            "iccdev": lambda: cmm.apply_ndarray(pixels),
            "numpy": lambda: published["numpy"](pixels),
            "llvm": lambda: published["llvm"](pixels),
            "smooth, llvm": lambda: smooth(pixels),
        }
    )
    work = "Published interpolation (CIEDE2000) + Cook-Torrance"
    against = "iccdev, the same profiles"
    return [
        Row(f"{work}, NumPy", against, seconds["iccdev"] / seconds["numpy"], 12,
            figures=per_pixel(seconds, len(pixels))),
        Row(f"{work}, LLVM", against, seconds["iccdev"] / seconds["llvm"], 100),
        Row("Smooth interpolation + Cook-Torrance, LLVM", "published one, LLVM",
            seconds["llvm"] / seconds["smooth, llvm"], 5),
    ]  # fmt: skip


SCENE_GOALS = {"flat matte": 0.25, "relief matte": 0.5}
"""The part of the full program's time that the reduced one may take."""


def reduced(place: Path) -> list[Row]:
    """What plans spare; rows without a goal tell what scenes cost that call for gloss."""
    chain = [build_colour_mid(PRIMARIES, interpolation="published").mid, build_pair(PRIMARIES).mvis]
    published = iccbrdf.link(chain, backend="llvm")
    rows: list[Row] = []
    for name, scene in scenes().items():
        pixels = np.resize(scene.pixels, (MEGAPIXEL, scene.pixels.shape[1]))
        few = pixels[:FEW]
        colours = colour_pixels(FEW)
        out = np.empty((MEGAPIXEL, 3), np.float32)
        works: dict[str, Callable[[], Any]] = {
            "copy": partial(moved, pixels, np.empty_like(pixels), out),
            "published, llvm": partial(published, colours),
        }
        for form, chain in {"full": scene.full, "reduced": scene.reduced}.items():
            folder = place / name / form
            folder.mkdir(parents=True)
            works[f"iccdev, {form}"] = partial(reference(chain, folder).apply_ndarray, few)
            for backend in ("numpy", "llvm"):
                works[f"{backend}, {form}"] = partial(iccbrdf.link(chain, backend=backend), pixels)
        seconds = in_turns(works)
        for work in works:
            seconds[work] /= len(few) if "iccdev" in work or "published" in work else len(pixels)
        goal = SCENE_GOALS.get(name)
        without = ", ".join(scene.without) or "nothing"
        for label, backend in {"NumPy": "numpy", "the ICC's CMM": "iccdev"}.items():
            ratio = seconds[f"{backend}, reduced"] / seconds[f"{backend}, full"]
            rows.append(Row(f"{name}: without {without}; {label}", "full Cook-Torrance", ratio, goal, True,
                            figures=per_pixel(seconds, 1)))  # fmt: skip
        llvm = seconds["llvm, reduced"]
        rows += [
            Row(f"{name}, LLVM", "a copy of the same bytes", llvm / seconds["copy"],
                1.3 if goal else None, True),
            Row(f"{name}, LLVM", "published interpolation + Cook-Torrance", llvm / seconds["published, llvm"],
                0.25 if goal else None, True),
            Row(f"{name}, planning", "reading the image and decoding it",
                sum(scene.planning.values()) / (scene.planning["reading"] + scene.planning["decoding"]),
                None, figures=scene.planning),
        ]  # fmt: skip
    return rows


COPY = """
import sys, tifffile
data = tifffile.imread(sys.argv[1])
height, width, _ = data.shape
tifffile.imwrite(sys.argv[2], data.reshape(-1)[: height * width * 3].reshape(height, width, 3))
"""


def end_to_end(place: Path) -> list[Row]:
    image = large_image(place, 20)
    mid, mvis = write_pair(place)
    out = place / "out.tif"
    seconds = in_turns(
        {
            "apply": lambda: run_apply(image, mid, mvis, out, "--workers", "2"),
            "copy": lambda: subprocess.run(
                [sys.executable, "-c", COPY, image, place / "copy.tif"], check=True
            ),
        }
    )
    return [
        Row("iccbrdf apply, 20 Mpixel float TIFF, process start to file closed (LLVM, 2 threads)",
            "tifffile copying the same bytes", seconds["apply"] / seconds["copy"], 3, at_most=True,
            figures=per_pixel(seconds, 20e6)),
    ]  # fmt: skip


def memory(place: Path, large: float) -> list[Row]:
    mid, mvis = write_pair(place)
    peaks = {}
    for size in (10, large):
        image = large_image(place, size)
        command = [sys.executable, str(Path(__file__).with_name("measure_memory.py")), image, "-p", mid,
                   "-p", mvis, "-o", place / "out.tif", "--workers", "2", "--force"]  # fmt: skip
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        peaks[size] = json.loads(done.stdout.splitlines()[-1])["peak_MB"]
    work = f"Peak memory of apply, {large:g} Mpixel"
    return [
        Row(work, "10 Mpixel", peaks[large] / peaks[10], 1.1, at_most=True,
            figures={f"{size:g} Mpixel, MB": peak for size, peak in peaks.items()}),
        Row(work, "500 MB", peaks[large] / 500, 1, at_most=True),
    ]  # fmt: skip


def start_up(place: Path) -> list[Row]:
    def python(*arguments: str) -> Callable[[], Any]:
        return lambda: subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

    seconds = in_turns(
        {
            "numpy": python("-c", "import numpy"),
            "import": python("-c", "import iccbrdf"),
            "help": python("-c", "from iccbrdf.cli import main; main(['--help'])"),
        },
        2 * REPEATS,
    )
    more = {name: seconds[name] - seconds["numpy"] for name in ("help", "import")}
    return [
        Row("iccbrdf --help, seconds more", "python -c 'import numpy'", more["help"], 0.25, at_most=True),
        Row("import iccbrdf, seconds more", "python -c 'import numpy'", more["import"], 0.1, at_most=True),
    ]


def image_growth(place: Path, large: float) -> dict[str, list[float]]:
    """Nanoseconds a pixel of `apply`, start-up taken off, for images of growing size."""
    mid, mvis = write_pair(place)
    sizes = [*(float(size) for size in GROWTH_SIZES if size < large), large]
    start = in_turns({"": lambda: run_apply(large_image(place, 0.01), mid, mvis, place / "out.tif")}, 5)[""]
    times = []
    for size in sizes:
        command = partial(run_apply, large_image(place, size), mid, mvis, place / "out.tif", "--workers", "2")
        seconds = in_turns({"": command}, 3)
        times.append((seconds[""] - start) / (size * 1e6) * 1e9)
    return {"Mpixel": sizes, "ns a pixel": times}


def program_growth(place: Path) -> dict[str, list[float]]:
    """Nanoseconds a pixel of generated programs, and what compiling them takes."""
    pixels = np.random.default_rng(0).random((FEW, 3)).astype(np.float32)
    growth: dict[str, list[float]] = {"operators": []}
    for size in PROGRAM_SIZES:
        profile = program_profile(size)
        program = profile["M2B0"].elements[0].program
        growth["operators"].append(verify(program, 3, 3).executed)
        chain = [identity(("a", "b", "c")), profile]
        cmm = reference(chain, place)
        transforms = {}
        for backend in ("numpy", "llvm"):
            start = time.perf_counter()
            transforms[backend] = iccbrdf.link(chain, backend=backend)
            growth.setdefault(f"{backend}, ms to compile", []).append(1e3 * (time.perf_counter() - start))
        few = pixels[: FEW // 16]
        seconds = in_turns({name: partial(transform, pixels) for name, transform in transforms.items()})
        seconds["iccdev"] = 16 * in_turns({"": partial(cmm.apply_ndarray, few)}, 3)[""]
        for name, value in per_pixel(seconds, FEW).items():
            growth.setdefault(name, []).append(value)
    return growth


def reference_cost(place: Path) -> list[dict[str, Any]]:
    """What the reference CMM pays for our programs."""
    root = folder("profiles")
    lines = []
    for path in sorted(root.glob("*/*.icc")):
        if path.stem not in ("mvis", "colour-mid"):
            continue
        profile = iccbrdf.read_profile(path)
        tag = "A2M0" if "A2M0" in profile else "M2B0"
        process = profile[tag]
        executed = sum(
            verify(e.program, e.inputs, e.outputs, e.elements).executed
            for e in process.elements
            if e.signature == "calc"
        )
        pixels = np.random.default_rng(0).random((FEW // 8, process.inputs)).astype(np.float32)
        is_mid = tag == "A2M0"
        cmm = reference([profile] if is_mid else [identity(profile["mcta"].texts()), profile], place)
        seconds = in_turns({"": partial(cmm.apply_ndarray, pixels)}, 5)[""]
        lines.append(
            {
                "profile": f"{path.parent.name}/{path.name}",
                "operators": executed,
                "microseconds a pixel": 1e6 * seconds / len(pixels),
            }
        )
    return lines


# Pieces ------------------------------------------------------------------------------------------------


def per_pixel(seconds: Mapping[str, float], count: float) -> dict[str, float]:
    return {f"{name}, ns a pixel": 1e9 * value / count for name, value in seconds.items()}


def large_image(place: Path, megapixels: float) -> Path:
    path = place / f"{megapixels:g}.tif"
    if not path.exists():
        script = Path(__file__).with_name("make_large_image.py")
        subprocess.run([sys.executable, script, path, "--megapixels", str(megapixels)], check=True)
    return path


def write_pair(place: Path) -> tuple[Path, Path]:
    pair = build_pair(read_primaries(folder("profiles") / "landscape" / "primaries.json"))
    paths = place / "mid.icc", place / "mvis.icc"
    for path, profile in zip(paths, (pair.mid, pair.mvis), strict=True):
        path.write_bytes(profile.to_bytes())
    return paths


def run_apply(image: Path, mid: Path, mvis: Path, out: Path, *more: str) -> None:
    command = [sys.executable, "-c", "from iccbrdf.cli import main; main()", "apply", image, "-p", mid,
               "-p", mvis, "-o", out, "--force", *more]  # fmt: skip
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


# Report ------------------------------------------------------------------------------------------------


def table(rows: Sequence[Row], costs: Sequence[Mapping[str, Any]], machine: str) -> str:
    lines = [
        "# What it costs",
        "",
        f"Made by `make bench` on {machine}; ratios within one run, medians of {REPEATS}.",
        "",
        "| work | against | ratio | goal |",
        "|---|---|---|---|",
    ]
    for row in rows:
        goal = "" if row.goal is None else f"{'at most' if row.at_most else 'at least'} {row.goal:g}"
        ratio = f"{row.ratio:.0f}" if row.ratio >= 20 else f"{row.ratio:.2f}"
        lines.append(f"| {row.work} | {row.against} | {ratio}{'' if row.holds else ' (!)'} | {goal} |")
    if costs:
        lines += [
            "",
            "What the ICC's CMM pays for our programs (operators executed on the longest path):",
            "",
            "| profile | operators | µs a pixel |",
            "|---|---|---|",
            *(
                f"| {cost['profile']} | {cost['operators']} | {cost['microseconds a pixel']:.2f} |"
                for cost in costs
            ),
        ]
    return "\n".join(lines) + "\n"


def draw(growth: Mapping[str, Mapping[str, Sequence[float]]], path: Path) -> None:
    mpl.use("Agg")
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    programs, images = growth.get("programs"), growth.get("images")
    if programs:
        for name in ("iccdev", "numpy", "llvm"):
            axes[0].loglog(programs["operators"], programs[f"{name}, ns a pixel"], "o-", label=name)
        axes[0].set(xlabel="operators of a generated program", ylabel="ns a pixel")
        axes[0].legend()
        axes[0].grid(alpha=0.3)
    if images:
        axes[1].semilogx(images["Mpixel"], images["ns a pixel"], "o-")
        axes[1].set(
            xlabel="Mpixel, 10 channels, float32", ylabel="ns a pixel, apply end to end", ylim=(0, None)
        )
        axes[1].grid(alpha=0.3)
    figure.savefig(path, dpi=110)


PARTS: Mapping[str, Callable[[Path, float], list[Row]]] = {
    "cook-torrance": lambda place, large: cook_torrance(place),
    "interpolation": lambda place, large: interpolation(place),
    "scenes": lambda place, large: reduced(place),
    "end-to-end": lambda place, large: end_to_end(place),
    "memory": memory,
    "start-up": lambda place, large: start_up(place),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent.parent / "docs")
    parser.add_argument(
        "--only", nargs="+", choices=[*PARTS, "growth", "reference"], help="leave out the rest"
    )
    parser.add_argument(
        "--large", type=float, default=200, help="Mpixel of the largest image (40 bytes each)"
    )
    arguments = parser.parse_args()

    def wanted(name: str) -> bool:
        return not arguments.only or name in arguments.only

    rows: list[Row] = []
    growth: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder_name:
        place = Path(folder_name)
        for name, part in PARTS.items():
            if wanted(name):
                found = part(place, arguments.large)
                for row in found:
                    print(
                        f"{row.ratio:10.3f}  {'ok ' if row.holds else 'NOT'} {row.work} / {row.against}",
                        flush=True,
                    )
                rows += found
        if wanted("growth"):
            growth = {"programs": program_growth(place), "images": image_growth(place, arguments.large)}
        costs = reference_cost(place) if wanted("reference") else []
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    text = table(rows, costs, machine)
    print(text)
    if not arguments.only:
        result = {
            "machine": machine,
            "rows": [asdict(row) for row in rows],
            "growth": growth,
            "reference": costs,
        }
        (arguments.output / "bench.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        (arguments.output / "bench.md").write_text(text, encoding="utf-8")
        draw(growth, arguments.output / "bench_growth.png")


if __name__ == "__main__":
    main()
