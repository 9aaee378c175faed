"""A disk that is full, or cannot be written to: a clear error, and a store that is whole."""

import errno
import os
import shutil
import subprocess

import pytest

from saltus.errors import SweepError
from saltus.sweep import run, status
from saltus.sweep import store as stores


def _own_disks() -> bool:
    """Whether this system lets a user mount a disk of memory in a name space of his own."""
    if not shutil.which("unshare"):
        return False
    return (
        subprocess.run(["unshare", "-rm", "true"], capture_output=True, check=False).returncode == 0
    )


@pytest.mark.skipif(not _own_disks(), reason="needs user name spaces")
def test_a_disk_that_is_full_is_told_and_the_store_goes_on_once_there_is_room(script, tmp_path):
    process = script("fill_disk", tmp_path, before=("unshare", "-rm"))
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    sentence, counts, parts, same = out.splitlines()
    assert "(no space left on device); the chunks before it are kept" in sentence
    assert "the same call continues from there" in sentence
    done, total = map(int, counts.split())
    assert 0 < done < total == 120
    assert parts == "0"
    assert same == "True"


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_the_file_that_did_not_fit_is_not_there(waves_plan, tree, tmp_path, monkeypatch, code):
    """The system fails in the middle of the fourth chunk's file."""
    plan, store = waves_plan(), tmp_path / "store"
    written, original = [], stores.write_durably

    def fails(path, content):
        if path.parents[2].name == "height":  # height/c/0/0
            written.append(path)
        if len(written) == 4:
            raise OSError(code, os.strerror(code))
        original(path, content)

    monkeypatch.setattr(stores, "write_durably", fails)
    with pytest.raises(
        SweepError, match=f"{os.strerror(code).lower()}.*; the chunks before it are kept"
    ):
        run(plan, store)
    assert status(store).done == 3
    monkeypatch.undo()
    run(plan, store)
    run(plan, tmp_path / "undisturbed")
    assert tree(store) == tree(tmp_path / "undisturbed")


def test_a_write_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        stores.write_durably(tmp_path / "c" / "0", b"x" * 100)
    assert list((tmp_path / "c").iterdir()) == []
