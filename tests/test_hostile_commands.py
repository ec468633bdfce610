"""Every command on files that are not what it expects: an error of ours, and nothing written."""

import os
from pathlib import Path

import pytest
from fuzz import seeds

from iccbrdf.resources import folder

HERE = folder("profiles") / "fogra39_gloss"
MID, MVIS, PRIMARIES = HERE / "mid.icc", HERE / "mvis.icc", HERE / "primaries.json"

CONTENTS = {
    "empty": b"",
    "text": b"hello\n",
    "tiff": b"II*\0\x08\0\0\0\0\0\0\0\0\0",
    "png": b"\x89PNG\r\n\x1a\n" + bytes(30),
    "exr": b"v/1\x01\x02\0\0\0",
    "json": b"{}",
    "profile": MVIS.read_bytes()[:500],
    "deep": b"[" * 5000,
}


def commands(bad, out, job):
    """Each command with the bad file in one of its places, and the suffix that the file has there."""
    proof = ["proof", job, "--primaries", PRIMARIES, "-o", out]
    profile = ["-p", MID, "-p", MVIS]
    return [
        (".json", ["build", bad, "-o", out]),
        (".json", ["build", PRIMARIES, "--slopes", bad, "-o", out]),
        (".tif", ["build", PRIMARIES, "--for", bad, "-o", out]),
        (".tif", ["apply", bad, *profile, "-o", out / "a.tif"]),
        (".exr", ["apply", bad, *profile, "-o", out / "a.tif"]),
        (".icc", ["apply", job, "-p", bad, "-o", out / "a.tif"]),
        (".png", ["apply", job, "-p", MVIS, "--normals", bad, "-o", out / "a.tif"]),
        (".tif", ["view", bad, "-p", MVIS, "-o", out / "a.html"]),
        (".icc", ["view", job, "-p", bad, "-o", out / "a.html"]),
        (".toml", ["proof", bad, "-o", out]),
        (".tif", ["proof", bad, "--primaries", PRIMARIES, "-o", out]),
        (".png", [*proof, "--height", bad, "--pixel-pitch", "1mm"]),
        (".png", [*proof, "--normals", bad]),
        (".icc", [*proof, "--printer", bad]),
        (".icc", [*proof, "--display", bad]),
        (".csv", ["fit", bad, "-o", out / "p.json"]),
        (".brdf", ["fit", bad, "-o", out / "p.json"]),
        (".tif", ["plan", bad, "--primaries", PRIMARIES]),
        (".json", ["cost", job, "--primaries", bad, "-o", out]),
        (".icc", ["dump", bad]),
        (".icc", ["validate", "--numeric", bad]),
        (".icc", ["diff", bad, MVIS]),
        (".icc", ["xml", bad, "-o", out / "a.xml"]),
        (".xml", ["icc", bad, "-o", out / "a.icc"]),
        (".icc", ["info", "-p", bad]),
    ]


@pytest.mark.parametrize("content", CONTENTS)
def test_files_that_are_something_else(run, tmp_path, content):
    job, out = tmp_path / "job.tif", tmp_path / "out"
    job.write_bytes(seeds.print_jobs()[0])
    out.mkdir()
    bad = tmp_path / "bad"
    for suffix, words in commands(bad, out, job):
        path = bad.with_suffix(suffix)
        path.write_bytes(CONTENTS[content])
        result = run(*(path if word is bad else word for word in words))
        # Exit code 1: the check that was asked for has failed.
        assert result.code == (1 if words[0] == "validate" else 3), (words, result.err)
        assert path.name in result.err + result.out
    assert list(out.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no file without an end here")
@pytest.mark.parametrize("key", ["image", "primaries", "printer", "height"])
def test_jobs_that_name_a_device(run, tmp_path, key):
    """Its reading never ended."""
    (tmp_path / "job.tif").write_bytes(seeds.print_jobs()[0])
    values = {"image": "job.tif", "primaries": str(PRIMARIES), "pixel-pitch": "1mm", key: "/dev/zero"}
    toml = tmp_path / "job.toml"
    toml.write_text("".join(f'{name} = "{value}"\n' for name, value in values.items()))
    result = run("proof", toml, "-o", tmp_path / "out")
    assert result.code == 3
    assert "/dev/zero: is not a regular file" in result.err
    assert sorted(os.listdir(tmp_path)) == ["job.tif", "job.toml"]
