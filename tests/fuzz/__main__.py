"""All targets for minutes, with a report: PYTHONPATH=tests python -m fuzz [--seconds N] [-o FOLDER] [TARGET].

Half of a target's time goes to seeded mutations, which anybody can repeat, half to atheris, which follows
what it covers.  The report is report.md in the folder, the inputs that are findings lie beside it.  What it
said of other targets stays.
Exit code 1 where there are any.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fuzz.report import markdown, row
from fuzz.targets import TARGETS


def main() -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"{', '.join(TARGETS)}; default: all")
    parser.add_argument("--seconds", type=float, default=240, help="for each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "-o", dest="folder", type=Path, default=Path("build/fuzz"), help="for the report and findings"
    )
    parser.add_argument("--summary", type=Path, help="where the report is written, too")
    wanted = parser.parse_args()
    targets = wanted.targets or list(TARGETS)
    for name in targets:
        if name not in TARGETS:
            parser.error(f"no target {name!r}: there are {', '.join(TARGETS)}")
    engines = ["mutation", "atheris"] if find_spec("atheris") else ["mutation"]
    if len(engines) == 1:
        print("atheris is not installed (pip install 'iccbrdf[dev]'): mutations alone", file=sys.stderr)
    kept = wanted.folder / "report.json"
    earlier = json.loads(kept.read_text()) if kept.exists() else {}
    results: dict[str, dict[str, Any]] = {
        label: counts for label, counts in earlier.items() if label.partition(" ")[0] in TARGETS
    }
    for name in targets:
        for engine in engines:
            label = f"{name} ({engine})"
            results[label] = _run(name, engine, wanted.seconds / len(engines), wanted.seed, wanted.folder)
            print(row(label, results[label]), flush=True)
            # Each time, for those who interrupt it.
            kept.write_text(json.dumps(results, indent=1) + "\n")
            (wanted.folder / "report.md").write_text(markdown(results))
    print(f"  -> {wanted.folder / 'report.md'}")
    if wanted.summary is not None:
        wanted.summary.write_text(markdown(results))
        print(f"  -> {wanted.summary}")
    return 1 if any(result["findings"] for result in results.values()) else 0


def _run(name: str, engine: str, seconds: float, seed: int, folder: Path) -> dict[str, Any]:
    place = folder / engine
    place.mkdir(parents=True, exist_ok=True)
    counts_file = place / f"{name}.json"
    counts_file.unlink(missing_ok=True)
    begun = time.monotonic()
    arguments = [name, str(seconds), str(seed), engine, str(place)]
    log = place / f"{name}.log"
    with log.open("w") as file:
        done = subprocess.run([sys.executable, "-m", "fuzz.one", *arguments], stdout=file, stderr=file)
    counts: dict[str, Any] = dict.fromkeys(("inputs", "taken", "worst_seconds", "worst_memory_mib"), 0)
    counts["findings"] = {}
    if counts_file.exists():
        counts |= json.loads(counts_file.read_text())
    if done.returncode:
        counts["findings"][f"exit code {done.returncode}"] = {
            "error": f"see {log} and what lies by it",
            "times": 1,
        }
    return counts | {"seconds": round(time.monotonic() - begun, 1)}


if __name__ == "__main__":
    sys.exit(main())
