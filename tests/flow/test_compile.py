"""Compiled code on disk: made once, shared, safe when two processes make it at once, and never in
the way.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from saltus.flow.programs import compiled as compilation
from saltus.flow.programs.compiled import load_kernel, load_structure
from saltus.systems import Harmonic, Load, System, WallOscillator
from saltus.taylor.cache import cache_directory
from saltus.taylor.generated import functions_text
from saltus.taylor.tracing import trace

SYSTEM = System(model=WallOscillator(damping=0.1), load=Load(force=-0.125))
SCRIPT = """
import sys, json
from saltus.flow import simulate
from saltus.systems import Load, System, WallOscillator
print("ready", flush=True)
sys.stdin.readline()
motion = simulate(System(model=WallOscillator(damping=0.1), load=Load(force=-0.125)), x=0.5, duration=20.0)
print(json.dumps([motion.x, motion.velocity, len(motion.impacts)]))
"""


@pytest.fixture
def fresh(tmp_path):
    """A cache directory that holds the kernel, which is slow to compile, and no structure."""
    load_kernel()
    source, target = cache_directory(), tmp_path / "cache" / "kernels"
    (target / "__pycache__").mkdir(parents=True)
    kernel = Path(
        sys.modules[
            next(name for name in sys.modules if name.startswith("saltus_kernel_"))
        ].__file__
    ).stem
    for path in [*source.glob(f"{kernel}*"), *source.glob(f"__pycache__/{kernel}*")]:
        shutil.copy2(path, target / path.relative_to(source))
    return tmp_path / "cache"


def start(cache):
    environment = {**os.environ, "SALTUS_CACHE_DIR": str(cache)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", SCRIPT], text=True, env=environment, **pipes)


def finish(process):
    out, err = process.communicate("go\n", timeout=120)
    assert process.returncode == 0, err
    return json.loads(out.splitlines()[-1])


def contents(folder):
    return {
        path: (path.stat().st_mtime_ns, path.read_bytes())
        for path in Path(folder).rglob("*")
        if path.is_file()
    }


def test_two_processes_that_compile_at_once_succeed_and_a_third_compiles_nothing(fresh):
    pair = [start(fresh), start(fresh)]
    for process in pair:  # both have imported everything and wait for the word
        assert process.stdout.readline() == "ready\n"
    for process in pair:
        process.stdin.write("go\n")
        process.stdin.flush()
    results = [finish(process) for process in pair]
    made = contents(fresh)
    names = {path.name for path in made}
    assert sum(name.startswith("structure_") and name.endswith(".o") for name in names) == 1
    assert not any(name.endswith(".tmp") for name in names)
    third = finish(start(fresh))
    assert contents(fresh) == made
    assert results == [third, third]


def test_unusable_cache_directory_falls_back_to_a_temporary_one(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(blocked))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    fallback = cache_directory()
    assert fallback.is_relative_to(tmp_path / "temporary")
    assert fallback.is_dir()


def test_read_only_cache_directory_falls_back_to_a_temporary_one(tmp_path, monkeypatch):
    wanted = tmp_path / "cache"
    (wanted / "kernels").mkdir(parents=True)
    writable = os.access
    # As for any user but root, whom no permission stops.
    monkeypatch.setattr(
        os,
        "access",
        lambda path, mode: not Path(path).is_relative_to(wanted) and writable(path, mode),
    )
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(wanted))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert not cache_directory().is_relative_to(wanted)
    assert cache_directory().is_relative_to(tmp_path)


def test_cache_directory_is_the_one_asked_for(tmp_path, monkeypatch):
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    assert cache_directory() == tmp_path / "kernels"


@pytest.fixture
def sources(monkeypatch):
    """The texts handed to the compiler, without compiling them."""
    texts = []

    def keep(kind, functions, traced):
        texts.append(functions_text(functions))
        raise LookupError

    monkeypatch.setattr(compilation, "load_functions", keep)

    def of(system, limits=()):
        with pytest.raises(LookupError):
            load_structure(trace(system, limits))
        return texts[-1]

    return of


def test_structures_with_different_expressions_are_different_files(sources):
    wall = SYSTEM
    texts = {
        sources(wall),
        sources(wall.with_({"load": Load()})),
        sources(wall.with_({"load": Load(frequency=1.0, force=Harmonic(1.0))})),
        sources(wall.with_({"load": Load(frequency=1.0, force=Harmonic(1.0) + 0.5)})),
    }
    assert len(texts) == 4


def test_structures_with_equal_expressions_are_one_file(sources):
    assert sources(SYSTEM) == sources(
        SYSTEM.with_({"load.force": 3.0, "model.wall": -2.0, "impact.e": 0.1})
    )


def test_two_threads_that_load_the_same_code_at_once_both_get_all_of_it():
    """A module is known by its name before it has been executed; a second thread must wait for the
    first one.
    """
    script = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from saltus.flow import simulate\n"
        "from saltus.systems import Load, System, WallOscillator\n"
        "system = System(model=WallOscillator(damping=0.1), load=Load(force=-0.125))\n"
        "with ThreadPoolExecutor(4) as pool:\n"
        "    ends = list(pool.map(lambda _: simulate(system, x=0.5, duration=5.0).x, range(4)))\n"
        "assert len(set(ends)) == 1\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
