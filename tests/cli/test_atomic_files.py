"""Files are whole or not there, on a full disk too, and notice when a bit of them is flipped."""

import errno
import os
import random
import subprocess
import sys

import numpy as np
import pytest
import xarray

from saltus import files
from saltus.errors import ParameterError
from saltus.files import (
    check_writable,
    has_checksum,
    read_dataset,
    write_bytes,
    write_dataset,
    write_figure,
    write_text,
)


def small():
    """A dataset with numbers, words and attributes."""
    variables = {
        "wave": ("x", np.sin(np.arange(5.0))),
        "name": ("x", list("abcde")),
        "side": ("x", np.arange(5, dtype="i1")),
    }
    return xarray.Dataset(
        variables, {"x": np.arange(5.0)}, {"kind": "waves", "tol": 1e-12, "window": [0.0, 1.0]}
    )


def test_every_variable_is_in_memory_also_one_with_the_name_of_a_group(tmp_path):
    # small() has a variable of the name of the first group
    groups = {"wave": small(), "other": small()}
    path = write_dataset(tmp_path / "tree.nc", xarray.DataTree.from_dict(groups))
    tree = read_dataset(path)
    path.unlink()
    for name in groups:
        np.testing.assert_array_equal(tree[name]["wave"].values, small()["wave"].values)


def test_the_file_and_its_folders_are_made(tmp_path):
    path = write_text(tmp_path / "a" / "b.txt", "thêta")
    assert path.read_text(encoding="utf-8") == "thêta"
    assert os.listdir(path.parent) == ["b.txt"]


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt, SystemExit, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))]
)
def test_a_failed_write_leaves_what_was_there(tmp_path, monkeypatch, error):
    path = tmp_path / "b.txt"
    path.write_text("old")

    def fail(_):
        raise error

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(type(error) if isinstance(error, OSError) else error):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["b.txt"]


def test_an_interrupt_in_the_middle_of_writing_leaves_no_half_file(tmp_path, started):
    script = (
        "import os, signal, sys; from saltus import files\n"
        "os.fsync = lambda _: (print('half', flush=True), signal.pause())\n"
        f"files.write_text({str(tmp_path / 'out.txt')!r}, 'text')"
    )
    process = started([sys.executable, "-c", script], stdout=subprocess.PIPE)
    assert process.stdout.readline() == "half\n"
    assert len(os.listdir(tmp_path)) == 1
    process.send_signal(2)
    process.communicate(timeout=60)
    assert os.listdir(tmp_path) == []


def test_what_a_killed_process_left_is_removed_and_what_another_writes_is_not(tmp_path):
    (tmp_path / ".motion.pdf.0a1b2c3d4e5f.part").write_text("half")
    other = tmp_path / ".chart.nc.0a1b2c3d4e5f.part"
    with other.open("wb") as file:
        assert files.lock(file)
        write_text(tmp_path / "a.txt", "a")
        assert sorted(os.listdir(tmp_path)) == [other.name, "a.txt"]
    write_text(tmp_path / "a.txt", "a")
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_disk_that_is_full_at_any_byte_is_told(tmp_path):
    """The system lets a file grow to so many bytes only; the process lives, and nothing half is
    there.
    """
    size = len(write_dataset(tmp_path / "whole.nc", small()).read_bytes())
    (tmp_path / "whole.nc").unlink()
    limits, path = (0, 1, size // 2, size - 1), tmp_path / "a.nc"
    script = (
        f"import os, resource, sys, typer; sys.path[:0] = [{os.path.dirname(__file__)!r}]\n"
        "from test_atomic_files import small\n"
        "from saltus.cli.guard import guarded\n"
        "from saltus.files import write_dataset\n"
        "data = small()\n"
        f"for limit in {limits}:\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))\n"
        "    try:\n"
        "        with guarded():\n"
        f"            write_dataset({str(path)!r}, data)\n"
        "    except typer.Exit as end:\n"
        f"        print(end.exit_code, os.listdir({str(tmp_path)!r}))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["2 []"] * len(limits)
    assert done.stderr.splitlines() == [
        f"saltus: {path} cannot be read or written (file too large)"
    ] * len(limits)


# --- checksums ---------------------------------------------------------------


def test_a_dataset_comes_back_and_other_programs_read_it(tmp_path):
    path = write_dataset(tmp_path / "a.nc", small())
    assert has_checksum(path.read_bytes())
    assert read_dataset(path).identical(small())
    with xarray.open_dataset(path) as data:
        assert data.load().identical(small())
    assert path.read_bytes() == write_dataset(tmp_path / "b.nc", small()).read_bytes()
    small().to_netcdf(tmp_path / "foreign.nc", engine="h5netcdf")
    assert read_dataset(tmp_path / "foreign.nc").identical(small())


def flips(content: bytes, count: int):
    """So many copies, each with one bit flipped; the last bits, of the checksum, among them."""
    rng = random.Random(0)
    places = [rng.randrange(8 * len(content)) for _ in range(count)] + list(
        range(8 * len(content) - 8, 8 * len(content))
    )
    for place in places:
        flipped = bytearray(content)
        flipped[place // 8] ^= 1 << place % 8
        yield bytes(flipped)


@pytest.mark.parametrize("count", [300, pytest.param(5000, marks=pytest.mark.thorough)])
def test_a_flipped_bit_is_noticed(tmp_path, count):
    path = write_dataset(tmp_path / "a.nc", small())
    for content in flips(path.read_bytes(), count):
        path.write_bytes(content)
        with pytest.raises(
            ParameterError,
            match=r"a\.nc is damaged: its checksum is not that of its bytes; compute it again",
        ):
            read_dataset(path)


@pytest.mark.parametrize("begin", [8, b"HDF", b"wave", b"kind", -200, -100, -64, -40])
def test_zeroed_bytes_are_noticed_before_hdf5_opens_the_file(tmp_path, begin, monkeypatch):
    path = write_dataset(tmp_path / "a.nc", small())
    content = bytearray(path.read_bytes())
    begin = content.index(begin) if isinstance(begin, bytes) else begin % len(content)
    length = min(64, len(content) - begin)
    content[begin : begin + length] = bytes(length)
    path.write_bytes(content)
    monkeypatch.setattr(xarray, "open_datatree", lambda *_, **__: pytest.fail("opened"))
    with pytest.raises(ParameterError, match="is damaged"):
        read_dataset(path)


@pytest.mark.parametrize("wiped", [103, 150, 400])
@pytest.mark.parametrize("by", [b"", b"\0"])
def test_a_file_that_has_lost_its_checksum_with_its_last_data_is_noticed(tmp_path, wiped, by):
    """Where the 103 bytes of the checksum are cut off and nothing else, the data end where HDF5
    says: they are as before.
    """
    path = write_dataset(tmp_path / "a.nc", small())
    content = path.read_bytes()
    path.write_bytes(content[:-wiped] + by * wiped)
    assert not has_checksum(path.read_bytes())
    if wiped == 103 and not by:
        assert read_dataset(path).identical(small())
    else:
        with pytest.raises(
            ParameterError, match=r"a\.nc is damaged: it has \d+ bytes, and its data end at \d+"
        ):
            read_dataset(path)


@pytest.mark.parametrize("size", [0, 1, 100, 2000, -1, -60, -200])
def test_a_cut_file_is_told(tmp_path, size):
    path = write_dataset(tmp_path / "a.nc", small())
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(ParameterError, match=r"a\.nc is (damaged|not a readable netCDF file)"):
        read_dataset(path)


def test_pictures_are_the_same_bytes_for_the_same_data(tmp_path):
    from matplotlib.figure import Figure

    for name in ("a", "b"):
        figure = Figure()
        figure.add_subplot().plot(np.arange(3.0))
        write_figure(tmp_path / name, figure)
    for kind in ("png", "pdf"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
    assert b"CreationDate" not in (tmp_path / "a.pdf").read_bytes()


# --- folders -----------------------------------------------------------------


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

    # a real folder would let the superuser in
    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    with pytest.raises(ParameterError, match=r"cannot be written to \(permission denied\)"):
        check_writable(tmp_path / "a")


def test_a_size_that_a_file_claims_is_not_allocated(tmp_path):
    """A file of a few kilobytes whose array has never been written, and is of 8 TB if one believes
    it.
    """
    import h5netcdf

    with h5netcdf.File(tmp_path / "vast.nc", "w") as file:
        file.dimensions = {"x": 10**6, "y": 10**6}
        file.create_variable("wave", ("x", "y"), "f8", chunks=(1000, 1000))
    assert (tmp_path / "vast.nc").stat().st_size < 100_000
    with pytest.raises(
        ParameterError,
        match=r"vast\.nc is too large: its arrays need about 8e\+03 GB of memory, and",
    ):
        read_dataset(tmp_path / "vast.nc")


def test_what_has_no_end_is_not_read(tmp_path):
    with pytest.raises(ParameterError, match="/dev/zero is not a readable file"):
        read_dataset("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ParameterError, match="is not a readable file"):
        read_dataset(tmp_path / "pipe")
    assert write_bytes(tmp_path / "empty", b"").read_bytes() == b""


def test_arrays_without_names_of_their_axes_are_read_without_a_warning(tmp_path, recwarn):
    """Other programs leave them out; a remark of h5netcdf's stood before the sentence of the
    user.
    """
    import h5py

    with h5py.File(tmp_path / "other.nc", "w") as file:
        file["plain"] = np.arange(3.0)
    assert read_dataset(tmp_path / "other.nc")["plain"].values.tolist() == [0.0, 1.0, 2.0]
    assert not recwarn.list


def test_a_file_of_more_bytes_than_there_is_memory_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "sparse.nc"
    with path.open("wb") as file:
        file.truncate(1 << 43)
    with pytest.raises(
        ParameterError, match=r"sparse.nc is too large: its bytes need about .* GB of memory"
    ):
        read_dataset(path)
