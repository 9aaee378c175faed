"""Files are whole or not there."""

import os
import signal
import subprocess
import sys

import pytest

from saltus.errors import ParameterError
from saltus.files import check_writable, write_atomically, write_text


def test_the_file_and_its_folders_are_made(tmp_path):
    path = write_text(tmp_path / "a" / "b.txt", "thêta")
    assert path.read_text(encoding="utf-8") == "thêta"
    assert os.listdir(path.parent) == ["b.txt"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_a_failed_writer_leaves_what_was_there(tmp_path, error):
    path = tmp_path / "b.txt"
    path.write_text("old")

    def writer(part):
        part.write_text("half")
        raise error

    with pytest.raises(error):
        write_atomically(path, writer)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["b.txt"]


def test_the_temporary_file_keeps_the_suffix_and_the_folder(tmp_path):
    seen = []
    write_atomically(tmp_path / "b.png", lambda part: (seen.append(part), part.touch()))
    assert seen[0].suffix == ".png"
    assert seen[0].parent == tmp_path


def test_an_interrupt_in_the_middle_of_writing_leaves_no_half_file(tmp_path, started):
    script = (
        "import signal, sys; from saltus.files import write_atomically\n"
        "def writer(part):\n    part.write_text('half'); print('half', flush=True); signal.pause()\n"
        f"write_atomically({str(tmp_path / 'out.txt')!r}, writer)"
    )
    process = started([sys.executable, "-c", script], stdout=subprocess.PIPE)
    assert process.stdout.readline() == "half\n"
    assert len(os.listdir(tmp_path)) == 1
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert os.listdir(tmp_path) == []


def test_check_writable_leaves_nothing_behind(tmp_path):
    check_writable(tmp_path / "a" / "b")
    check_writable(tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_folder_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(ParameterError, match="is a file; name another with --output"):
            check_writable(folder)


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    import tempfile

    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)  # a real folder would let the superuser in
    with pytest.raises(ParameterError, match=r"cannot be written to \(permission denied\)"):
        check_writable(tmp_path / "a")
