import errno
import os

import pytest

from iccbrdf.errors import LimitError, UsageError
from iccbrdf.files import atomic_output


def test_file_appears_when_whole(tmp_path):
    target = tmp_path / "a.bin"
    with atomic_output(target) as temporary:
        temporary.write_bytes(b"whole")
        assert temporary.parent == tmp_path
        assert not target.exists()
    assert target.read_bytes() == b"whole"
    assert os.listdir(tmp_path) == ["a.bin"]


def write_half(target, failure, **options):
    with atomic_output(target, **options) as temporary:
        temporary.write_bytes(b"half")
        raise failure


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_nothing_is_left_after_a_failure(tmp_path, failure):
    target = tmp_path / "a.bin"
    with pytest.raises(failure):
        write_half(target, failure)
    assert os.listdir(tmp_path) == []


def test_existing_file_survives_a_failed_overwrite(tmp_path):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    with pytest.raises(ValueError, match="stop"):
        write_half(target, ValueError("stop"), overwrite=True)
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.bin"]


def test_overwrite_must_be_asked_for(tmp_path):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    with pytest.raises(UsageError, match=r"a\.bin: exists already.*--force"), atomic_output(target):
        pytest.fail("the block must not run")
    with atomic_output(target, overwrite=True) as temporary:
        temporary.write_bytes(b"new")
    assert target.read_bytes() == b"new"


def test_file_that_comes_into_being_meanwhile_is_kept(tmp_path):
    target = tmp_path / "a.bin"
    with pytest.raises(UsageError, match="exists already"), atomic_output(target):
        target.write_bytes(b"someone else's")
    assert target.read_bytes() == b"someone else's"
    assert os.listdir(tmp_path) == ["a.bin"]


def test_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_bytes(b"old")
    link = tmp_path / "link"
    link.symlink_to("real")
    with atomic_output(link, overwrite=True) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_missing_folder_and_special_file_are_refused(tmp_path):
    missing = tmp_path / "missing"
    with pytest.raises(UsageError, match=r"folder .*missing does not exist"), atomic_output(missing / "a"):
        pytest.fail("the block must not run")
    with pytest.raises(UsageError, match="not a regular file"), atomic_output(tmp_path, overwrite=True):
        pytest.fail("the block must not run")


def test_full_disk_is_a_limit(tmp_path):
    with pytest.raises(LimitError, match="No space left"), atomic_output(tmp_path / "a"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert os.listdir(tmp_path) == []
