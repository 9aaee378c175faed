"""Compiled code is run only from a folder of the user's own, and only as it was written; what is
damaged is made again.
"""

import hashlib
import os
import pickle
import random
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from generated_functions import Generated

from saltus.systems import Load, System, VelocityReduction, WallOscillator
from saltus.taylor import cache, generated, load_module, module_name
from saltus.taylor.cache import cache_directory, undamaged

SOURCE = """
from numba import types
from saltus.taylor.private_numba import cached_jit

@cached_jit(types.float64(types.float64))
def doubled(x):
    return 2.0 * x
"""
COMPILED = (".nbc", ".nbi", ".bytecode")
SCRIPT = f"""
import logging; logging.basicConfig(format="%(message)s")
from saltus.taylor.kernels import load_module
print(load_module("safety", {SOURCE!r}).doubled(3.0))
"""


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache and a temporary directory of the test's own."""
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    return tmp_path


def run(home, **more):
    """The printed number and the remarks of a process that loads the module."""
    environment = (
        os.environ
        | {"SALTUS_CACHE_DIR": str(home / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}
        | more
    )
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return float(done.stdout), done.stderr


def run_here(caplog):
    """The number and the remarks when this process loads the module from disk anew."""
    sys.modules.pop(module_name("safety", SOURCE), None)
    caplog.clear()
    try:
        return load_module("safety", SOURCE).doubled(3.0), caplog.text
    finally:
        sys.modules.pop(module_name("safety", SOURCE), None)


def kept(home):
    """What is in the cache, without the files that are only locked."""
    return {
        path: path.read_bytes()
        for path in (home / "cache").rglob("*")
        if path.is_file() and path.suffix != ".lock"
    }


@pytest.mark.parametrize("umask", [0o022, 0o002, 0o000])
def test_a_new_folder_is_the_user_s_alone(home, umask):
    """Whatever the user lets his group do elsewhere; and it is used again."""
    before = os.umask(umask)
    try:
        for _ in range(2):
            assert cache_directory() == home / "cache" / "kernels"
            assert load_module("safety", SOURCE).doubled(3.0) == 6.0
        for folder in (cache_directory(), cache_directory() / "__pycache__"):
            assert folder.stat().st_mode & 0o777 == 0o700
    finally:
        os.umask(before)
        del sys.modules[module_name("safety", SOURCE)]


GROUPS = {100: ("users", []), 1000: ("me", []), 1001: ("me", ["me", "you"]), 0: ("root", [])}


@pytest.mark.parametrize(
    ("owner", "group", "mode", "others_can"),
    [
        *((owner, 100, 0o755, False) for owner in (0, 1000, cache.NOBODY)),
        (1001, 1001, 0o700, True),  # another user's
        (1000, 1000, 0o775, False),  # as where each user has a group of his own
        (0, 0, 0o775, False),
        (1000, 100, 0o775, True),
        (1000, 1001, 0o775, True),
        (1000, 77, 0o775, True),  # a group without a name
        (0, 0, 0o777, True),
        (0, 0, 0o1777, False),  # a temporary directory
    ],
)
def test_a_folder_above_in_which_others_can_rename_is_known(
    monkeypatch, owner, group, mode, others_can
):
    import grp
    import pwd

    groups = {
        number: SimpleNamespace(gr_name=name, gr_mem=members)
        for number, (name, members) in GROUPS.items()
    }
    monkeypatch.setattr(os, "getuid", lambda: 1000)
    monkeypatch.setattr(pwd, "getpwuid", {1000: SimpleNamespace(pw_name="me")}.__getitem__)
    monkeypatch.setattr(grp, "getgrgid", groups.__getitem__)
    found = SimpleNamespace(st_uid=owner, st_gid=group, st_mode=stat.S_IFDIR | mode)
    assert cache._replaceable(found) is others_can


def link(path):
    (path.parent / "elsewhere").mkdir(mode=0o700)
    path.symlink_to(path.parent / "elsewhere")


def open_to_all(path):
    path.mkdir()
    path.chmod(0o777)


@pytest.mark.parametrize("prepare", [link, open_to_all])
@pytest.mark.parametrize("inner", ["", "__pycache__"])
def test_a_folder_in_which_others_can_plant_code_is_not_used(home, prepare, inner):
    folder = home / "cache" / "kernels"
    folder.parent.mkdir()
    if inner:
        folder.mkdir(mode=0o700)
    prepare(folder / inner if inner else folder)
    assert cache_directory() == home / "temporary" / f"saltus-kernels-{os.getuid()}"


def test_a_folder_of_another_user_is_not_used(home, monkeypatch):
    (home / "cache" / "kernels").mkdir(parents=True, mode=0o700)
    other = os.getuid() + 1
    fallback = home / "temporary" / f"saltus-kernels-{other}"
    fallback.mkdir(mode=0o700)  # planted under the name that would be taken
    monkeypatch.setattr(os, "getuid", lambda: other)
    cache._own_folder.cache_clear()
    found = cache_directory()
    assert found not in (home / "cache" / "kernels", fallback)
    assert found.stat().st_mode & 0o777 == 0o700
    assert found == cache_directory()
    cache._own_folder.cache_clear()


def test_another_text_under_the_name_of_a_source_is_not_run(home):
    name = module_name("safety", SOURCE)
    path = cache_directory() / f"{name.removeprefix('saltus_')}.py"
    path.write_text("raise SystemExit('planted')\n")
    assert load_module("safety", SOURCE).doubled(3.0) == 6.0
    assert path.read_text() == SOURCE
    del sys.modules[name]


@pytest.mark.parametrize(
    "change",
    ["flip", "pickle", *(pytest.param(c, marks=pytest.mark.thorough) for c in ("cut", "empty"))],
)
def test_damaged_compiled_code_is_made_again_with_a_remark(home, caplog, change):
    """Every file of the cache in turn; a pickle that runs a command when it is read is not read."""
    assert run_here(caplog) == (6.0, "")
    for path, content in kept(home).items():
        if change == "flip":
            flipped = bytearray(content)
            flipped[len(content) // 2] ^= 1
            path.write_bytes(flipped)
        elif change == "pickle":
            path.write_bytes(pickle.dumps(Planted(str(home / "planted"))))
        else:
            path.write_bytes(content[: len(content) // 2] if change == "cut" else b"")
        value, remarks = run_here(caplog)
        assert value == 6.0
        assert f"{path} is damaged" in remarks
    assert run_here(caplog) == (6.0, "")
    assert not (home / "planted").exists()


def forged(path, planted):
    """What a stranger writes: a pickle that makes a file when it is read, with the digest of its
    bytes.
    """
    content = pickle.dumps(Planted(str(planted)))
    path.write_bytes(content + hashlib.sha256(content).digest())


def test_numba_s_own_setting_of_a_folder_is_not_followed(home):
    """Compiled code lies beside its source, in the folder that was looked at, wherever else numba
    is told to keep it.
    """
    elsewhere = home / "elsewhere"
    elsewhere.mkdir()
    assert run(home, NUMBA_CACHE_DIR=str(elsewhere)) == (6.0, "")
    assert not [path for path in elsewhere.rglob("*") if path.is_file()]
    compiled = {path for path in kept(home) if path.suffix in COMPILED}
    assert {path.parent for path in compiled} == {home / "cache" / "kernels" / "__pycache__"}
    assert len(compiled) == len(COMPILED)


@pytest.mark.parametrize(
    "change",
    [
        "link",
        pytest.param("owner", marks=pytest.mark.skipif(os.getuid() != 0, reason="root alone")),
    ],
)
def test_compiled_code_of_somebody_else_is_not_read(home, caplog, change):
    """As was planted while the folder was open to all, with a digest that is right."""
    assert run_here(caplog) == (6.0, "")
    for path in [path for path in kept(home) if path.suffix in COMPILED]:
        target = home / "forged" if change == "link" else path
        forged(target, home / "planted")
        if change == "link":
            path.unlink()
            path.symlink_to(target)
        else:
            os.chown(path, 12345, 12345)
        value, remarks = run_here(caplog)
        assert value == 6.0
        assert f"{path} is not the user's own; it is compiled again" in remarks
        assert not (home / "planted").exists()
    assert run_here(caplog) == (6.0, "")


def test_a_folder_that_everybody_can_exchange_is_not_used(home):
    """The folder itself is the user's alone, but not the one that it is in."""
    (home / "cache" / "kernels").mkdir(parents=True, mode=0o700)
    (home / "cache").chmod(0o777)
    assert cache_directory() == home / "temporary" / f"saltus-kernels-{os.getuid()}"
    (home / "cache").chmod(0o1777)
    assert cache_directory() == home / "cache" / "kernels"


def test_any_flipped_bit_of_compiled_code_is_noticed(home, caplog):
    """3000 bits of numba's compiled code, of its index and of Python's, each alone."""
    load_module("safety", SOURCE)
    rng = random.Random(0)
    for path in [path for path in kept(home) if path.suffix in COMPILED]:
        content = path.read_bytes()
        assert undamaged(str(path)) == content[:-32]  # what stands before the digest
        for _ in range(1000):
            place, flipped = rng.randrange(8 * len(content)), bytearray(content)
            flipped[place // 8] ^= 1 << place % 8
            path.write_bytes(flipped)
            assert undamaged(str(path)) is None
            assert not path.exists()
    del sys.modules[module_name("safety", SOURCE)]


def test_a_cache_that_was_moved_is_read_where_it_is(home):
    assert run(home) == (6.0, "")
    (home / "cache").rename(home / "moved")
    assert run(home, SALTUS_CACHE_DIR=str(home / "moved")) == (6.0, "")
    assert not (home / "cache").exists()


class Planted:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (Path(self.path),)


def test_of_processes_that_want_the_same_code_at_once_one_compiles_it(home):
    environment = os.environ | {
        "SALTUS_CACHE_DIR": str(home / "cache"),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    script = SCRIPT.replace("print(", "function = ").replace(".doubled(3.0))", ".doubled") + (
        "print(sum(function.stats.cache_misses.values()), function(3.0))"
    )
    begun = [
        subprocess.Popen(
            [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=environment
        )
        for _ in range(3)
    ]
    said = [process.communicate()[0].split() for process in begun]
    assert sorted(misses for misses, _ in said) == ["0", "0", "1"]
    assert {value for _, value in said} == {"6.0"}


def objects(home, system):
    """The object files of a structure, which is loaded as if it had not been before, and a
    coefficient of its series.
    """
    generated._loaded.clear()
    made = Generated(system)
    return list((home / "cache" / "kernels").glob("structure_*.o")), made.coefficients(
        0.0, 0.1, 0.2, 6
    )[0, 5]


@pytest.mark.parametrize("change", ["flip", "cut", "link"])
def test_a_damaged_object_file_is_made_again_with_a_remark(home, caplog, change):
    system = System(
        model=WallOscillator(damping=0.1), load=Load(frequency=1.0), impact=VelocityReduction(0.8)
    )
    (path,), value = objects(home, system)
    content = path.read_bytes()
    assert undamaged(str(path)) == content[:-32]
    assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0
    if change == "link":
        target = home / "elsewhere.o"
        target.write_bytes(content)
        path.unlink()
        path.symlink_to(target)
    else:
        middle = len(content) // 2
        path.write_bytes(
            content[:middle]
            + (bytes([content[middle] ^ 1]) + content[middle + 1 :] if change == "flip" else b"")
        )
    assert objects(home, system) == ([path], value)
    assert f"{path} is {'not the user' if change == 'link' else 'damaged'}" in caplog.text
    assert path.read_bytes() == content


def test_an_object_file_is_named_by_the_processor_and_by_llvm_s_version(home, monkeypatch):
    system = System(
        model=WallOscillator(damping=0.1), load=Load(frequency=1.0), impact=VelocityReduction(0.8)
    )
    (first,), value = objects(home, system)
    generated.written_by.cache_clear()
    monkeypatch.setattr(generated, "made_for", lambda: "another machine")
    both, again = objects(home, system)
    assert len(both) == 2
    assert first in both
    assert again == value
    generated.written_by.cache_clear()
