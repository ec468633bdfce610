"""One target for some seconds in a process of its own: python -m fuzz.one NAME SECONDS SEED ENGINE FOLDER."""

from __future__ import annotations

import json
import logging
import os
import random
import resource
import sys
import time
from pathlib import Path

MAX_ADDRESSES = 8 << 30
"""Bytes that the process may ask for, libraries included."""


def by_mutation(name: str, seconds: float, seed: int, folder: Path) -> None:
    """Mutate seeds, and what was taken of their mutations, with a seeded generator."""
    from fuzz.mutations import mutated
    from fuzz.targets import TARGETS
    from fuzz.watch import Watch

    target = TARGETS[name]
    watch = Watch(name, target, folder)
    pool = target.seeds()
    for data in pool:
        watch.run(data)
    draw = random.Random(seed)
    # Stays behind where an input brings the process down.
    current = folder / f"{name}-current"
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        data = mutated(draw.choice(pool), target.words, draw)
        current.write_bytes(data)
        before = watch.taken
        watch.run(data)
        # What is taken is likely to be one change from what is just not.
        if watch.taken > before and len(pool) < 500 and len(data) < 50_000:
            pool.append(data)
    current.unlink(missing_ok=True)
    _write(folder, name, watch.counts() | {"engine": "mutation"})


def by_coverage(name: str, seconds: float, seed: int, folder: Path) -> None:
    """Let atheris look for inputs that reach new code."""
    import atheris

    with atheris.instrument_imports(include=["iccbrdf"]):
        from fuzz.targets import TARGETS
    from fuzz.watch import MAX_SECONDS, Watch

    target = TARGETS[name]
    watch = Watch(name, target, folder)
    corpus = folder / f"corpus-{name}"
    corpus.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(target.seeds()):
        (corpus / f"seed-{number}").write_bytes(data)
    words = folder / f"words-{name}"
    escaped = ("".join(map("\\x{:02x}".format, word)) for word in target.words)
    words.write_text("".join(f'"{word}"\n' for word in escaped))
    written = time.monotonic()

    def one(data: bytes) -> None:
        nonlocal written
        watch.run(data)
        # libFuzzer leaves without a word to us.
        if time.monotonic() > written + 1:
            written = time.monotonic()
            _write(folder, name, watch.counts() | {"engine": "atheris"})

    atheris.Setup(
        [
            "fuzz",
            f"-max_total_time={max(1, round(seconds))}",  # 0 would be without an end
            f"-seed={seed}",
            *([f"-dict={words}"] if target.words else []),
            "-max_len=20000",
            "-rss_limit_mb=0",
            f"-timeout={10 * MAX_SECONDS}",
            f"-artifact_prefix={folder}/",
            str(corpus),
        ],
        one,
    )
    atheris.Fuzz()


def _write(folder: Path, name: str, counts: dict[str, object]) -> None:
    temporary = folder / f".{name}.json"
    temporary.write_text(json.dumps(counts, indent=1))
    os.replace(temporary, folder / f"{name}.json")


def main() -> None:
    name, seconds, seed, engine, folder = sys.argv[1:]
    logging.disable()  # libraries tell of every tag that they cannot read
    resource.setrlimit(resource.RLIMIT_AS, (MAX_ADDRESSES, MAX_ADDRESSES))
    Path(folder).mkdir(parents=True, exist_ok=True)
    {"atheris": by_coverage, "mutation": by_mutation}[engine](name, float(seconds), int(seed), Path(folder))


if __name__ == "__main__":
    main()
