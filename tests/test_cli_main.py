"""What all commands have in common: help, exit codes, errors in words and as JSON, interruption, pipes."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import tifffile

import iccbrdf
from iccbrdf.cli import COMMANDS, cli
from iccbrdf.errors import LimitError, LinkError, ProfileError, UsageError
from iccbrdf.resources import folder

MVIS = folder("profiles") / "landscape" / "mvis.icc"
PROGRAM = [sys.executable, "-c", "from iccbrdf.cli import main; main()"]


def test_help_lists_every_command(run):
    result = run("--help")
    assert (result.code, result.err) == (0, "")
    for name, text in COMMANDS.items():
        assert re.search(rf"^  {name} +{re.escape(text)}$", result.out, re.MULTILINE)


def examples(help_text: str) -> list[str]:
    """The command lines after the word Examples, with continued lines joined."""
    _, _, epilog = help_text.partition("Example")
    lines = epilog.replace("\\\n", " ").splitlines()
    return [line.strip() for line in lines if line.strip().startswith("iccbrdf ")]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_has_examples_that_parse(run, name):
    result = run(name, "-h")
    assert (result.code, result.err) == (0, "")
    assert max(map(len, result.out.splitlines())) <= 100
    found = examples(result.out)
    assert any(line.split()[1] == name for line in found)
    for line in found:
        _, command, *arguments = shlex.split(line)
        cli.get_command(None, command).make_context(command, arguments)


def test_version(run):
    result = run("--version")
    assert result.code == 0
    assert iccbrdf.__version__ in result.out


def test_without_a_command_help_goes_to_stderr(run):
    result = run()
    assert (result.code, result.out) == (2, "")
    assert "Usage: iccbrdf" in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bild"], "no command 'bild': did you mean 'build'?"),
        (["apply", "a.tif", "--embde"], "'--embde'"),
        (["build"], "Missing argument 'PRIMARIES'"),
        (["dump", "a", "b"], "unexpected extra argument"),
        (["apply", "a.tif", "-o", "b.tif"], "Missing option '-p'"),
        (["apply", "a.tif", "-p", "b.icc"], "Missing option '-o'"),
        (["apply", "a.tif", "-p", "b.icc", "-o", "c.tif", "--workers", "0"], "--workers"),
        (["apply", "a.tif", "-p", "b.icc", "-o", "c.tif", "--exposure", "0"], "--exposure"),
        (["apply", "a.tif", "-p", "b.icc", "-o", "c.tif", "--intent", "vivid"], "'vivid' is unknown"),
    ],
)
def test_usage_errors(run, arguments, message):
    result = run(*arguments)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("iccbrdf: ")
    assert message in result.err
    assert re.search(r"^Try 'iccbrdf( \w+)? --help'\.$", result.err, re.MULTILINE)

    result = run(*arguments, "--json")
    assert result.code == 2
    assert result.json["schema"] == "iccbrdf.error/1"
    assert message in result.json["error"]
    assert result.json["exit_code"] == 2


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (UsageError("wrong"), 2),
        (ProfileError("wrong"), 3),
        (LinkError("wrong"), 3),
        (LimitError("wrong"), 4),
        (OSError(5, "wrong", "a.icc"), 3),
        (KeyboardInterrupt(), 130),
    ],
)
def test_exit_codes_without_a_traceback(run, monkeypatch, error, code):
    def fail(path):
        raise error

    monkeypatch.setattr("iccbrdf.cli.dump.read_profile", fail)
    result = run("dump", "a.icc", "--json")
    assert (result.code, result.json["exit_code"]) == (code, code)
    assert "Traceback" not in result.err
    if code != 130:
        assert "wrong" in result.err


def test_internal_error_shows_where(run, monkeypatch):
    def fail(path):
        raise RuntimeError("surprise")

    monkeypatch.setattr("iccbrdf.cli.dump.read_profile", fail)
    result = run("dump", "a.icc", "--json")
    assert result.code == result.json["exit_code"] == 5
    assert "Traceback" in result.err
    assert "surprise" in result.json["error"]


def test_file_name_that_is_no_text(run):
    result = run("dump", "caf\udce9.icc")
    assert result.code == 3
    assert r"caf\udce9.icc" in result.err


def test_reader_of_the_pipe_may_leave():
    process = subprocess.Popen([*PROGRAM, "dump", MVIS], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait() == 0


def test_interrupt_leaves_nothing(tmp_path, large_image):
    outputs = tmp_path / "outputs"
    outputs.mkdir()
    arguments = [large_image, "-p", MVIS.parent / "mid.icc", "-p", MVIS]
    for name in ("a.tif", "a.png"):
        arguments += ["-o", outputs / name]
    process = subprocess.Popen(
        [*PROGRAM, "apply", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 20
    while len(os.listdir(outputs)) < 2 and time.monotonic() < deadline:
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert (process.returncode, out) == (130, "")
    assert err.strip() == "iccbrdf: interrupted"
    assert os.listdir(outputs) == []


@pytest.fixture
def large_image(tmp_path):
    """An image that takes a second or two."""
    path = tmp_path / "large.tif"
    zeros = np.zeros((64, 2048, 10), np.uint16)
    tifffile.imwrite(path, (zeros for _ in range(32)), shape=(2048, 2048, 10), dtype=np.uint16,
                     rowsperstrip=64, photometric="minisblack", planarconfig="contig")  # fmt: skip
    return path
