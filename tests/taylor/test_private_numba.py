"""What is private of numba: where it is missing, and on the oldest and the newest numba that
pyproject.toml allows.
"""

import ast
import json
import os
import re
import subprocess
import sys
import threading
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest

import saltus
from saltus.taylor import cache_directory, entry_point, load_module, pointer, private_numba

SOURCE = Path(saltus.__file__).parents[1]
SYSTEM = """
import json, saltus
wall = saltus.WallOscillator(damping=0.1, wall=0.4)
load = saltus.Load(frequency=1.3, force=saltus.Harmonic(0.7))
system = saltus.System(model=wall, load=load, impact=saltus.VelocityReduction(0.8))
motion = saltus.simulate(system, x=0.1, velocity=0.2, periods=5)
"""
MOTION = SYSTEM + "print(json.dumps([motion.x, motion.velocity, len(motion.impacts)]))"
BOTH = (
    SYSTEM + "many = saltus.simulate_many(system, x=[0.1], velocity=0.2, periods=5,"
    " threads=1)\nprint(json.dumps([motion.x, motion.velocity, len(motion.impacts),"
    " float(many.x[0]), float(many.velocity[0])]))"
)


def run(script, cache, *paths):
    """The numbers that a script prints, in a process of its own."""
    environment = os.environ | {
        "SALTUS_CACHE_DIR": str(cache),
        "PYTHONPATH": os.pathsep.join(map(str, [*paths, SOURCE])),
    }
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=False
    )
    assert result.returncode == 0, result.stderr[-4000:]
    return json.loads(result.stdout.splitlines()[-1])


WITHIN = """
from numba import float64
from saltus.taylor.private_numba import cached_jit, jit
@jit
def twice(x):
    return 2.0 * x
@cached_jit(float64(float64))
def four_times(x):
    return twice(twice(x))
@cached_jit(float64(float64))
def eight_times(x):
    return four_times(twice(x))
"""


def test_machine_code_is_made_only_of_what_is_called_from_outside(tmp_path, monkeypatch):
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    made = load_module("within", WITHIN)
    assert (made.four_times(1.5), made.eight_times(1.5)) == (6.0, 12.0)
    (inner,), (outer,) = made.twice.overloads.values(), made.four_times.overloads.values()
    engine = outer.library.codegen._engine
    assert engine.is_symbol_defined(outer.fndesc.llvm_func_name)
    assert not engine.is_symbol_defined(inner.fndesc.llvm_func_name)
    assert numba.njit(lambda x: 3.0 * x)(2.0) == 6.0  # what others compile is theirs to call


REFERENCE = """
import numpy as np
from numba import float64
from saltus.taylor.private_numba import cached_jit, jit, lean_jit
from saltus.taylor.numba_types import by_reference
@lean_jit
def element(both, i):
    first, (second, factor) = both
    return factor * (first[i] + second[i])
@lean_jit
def total_with(arrays, n):
    both, total = by_reference(arrays), element(arrays, 0)
    for i in range(1, n):
        total += element(both, i)
    return total
@jit
def count_from(first, n):
    return np.arange(first, n) + 0.0
@cached_jit(float64(float64))
def total(x):
    n = int(x)
    return total_with((count_from(0, n), (np.ones(n), 2.0)), n)
"""


def test_a_tuple_by_reference_has_the_tuples_values_and_a_function_is_compiled_once_for_all_numbers(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    made = load_module("reference", REFERENCE)
    assert made.total(5.0) == 2.0 * (0 + 1 + 2 + 3 + 4 + 5)
    assert len(made.count_from.overloads) == len(made.total_with.overloads) == 1
    assert len(made.element.overloads) == 2  # of a tuple, and by reference, for every i


WITHOUT = [("NUMBA_DISABLE_JIT", "1"), ("NUMBA_NUM_THREADS", "0"), ("NUMBA_NUM_THREADS", "two")]
COMMANDS = ["simulate", "run", "doctor"]


@pytest.mark.parametrize(
    ("name", "value", "command"),
    [  # each once; all pairs are thorough, as each is a process of its own
        pytest.param(*each, command, marks=() if i == j else pytest.mark.thorough)
        for i, each in enumerate(WITHOUT)
        for j, command in enumerate(COMMANDS)
    ],
)
def test_an_environment_without_a_compiler_is_refused_in_a_sentence(name, value, command, tmp_path):
    study = SOURCE.parent / "examples" / "metainterface.toml"
    arguments = [] if command == "doctor" else [study, "--output", tmp_path / "results"]
    done = subprocess.run(
        [sys.executable, "-m", "saltus", command, *arguments],
        capture_output=True,
        text=True,
        env=os.environ | {name: value, "PYTHONPATH": str(SOURCE)},
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"saltus: the environment has {name}")
    assert "Traceback" not in done.stderr


def allowed():
    """The oldest numba and the bound that its versions stay below."""
    dependencies = tomllib.loads((SOURCE.parent / "pyproject.toml").read_text())["project"][
        "dependencies"
    ]
    (found,) = [
        re.fullmatch(r"numba>=([\d.]+),<([\d.]+)", text)
        for text in dependencies
        if text.startswith("numba")
    ]
    return found.groups()


def install(requirement, folder):
    """Put a numba, and the NumPy that goes with it, into a folder that Python can be told of; skip
    where that cannot be had.
    """
    command = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--only-binary=:all:",
        "--target",
        str(folder),
        requirement,
    ]
    for python in (sys.executable, "python3"):
        result = subprocess.run([python, *command], capture_output=True, text=True, check=False)
        if result.returncode == 0:
            return
    pytest.skip(f"pip cannot install {requirement} here: {result.stderr.strip()[-300:]}")


@pytest.mark.thorough
@pytest.mark.parametrize("which", ["oldest", "newest"])
def test_motions_are_the_same_on_every_numba_allowed(which, tmp_path):
    oldest, bound = allowed()
    install(f"numba=={oldest}.*" if which == "oldest" else f"numba<{bound}", tmp_path / "packages")
    version = run(
        "import json, numba; print(json.dumps(numba.__version__))", tmp_path, tmp_path / "packages"
    )
    assert version.startswith(f"{oldest}.") if which == "oldest" else version >= numba.__version__
    there = run(BOTH, tmp_path / "cache", tmp_path / "packages")
    assert there == pytest.approx(run(BOTH, cache_directory().parent), rel=1e-12, abs=1e-12)


CALLED = """
import json, sys
from numba import float64, njit
from saltus.taylor import entry_point, function_type, pointer
square = njit(float64(float64))(lambda x: x * x)
twice = njit(float64(function_type(float64(float64)), float64))(lambda f, x: f(f(x)))
call, address, begun = entry_point(twice), pointer(square), []
sys.setprofile(lambda frame, event, argument: begun.append(event))
called = call(address, 3.0)
sys.setprofile(None)
print(json.dumps(["call" in begun, called, twice(address, 3.0)]))
"""


def test_a_function_is_called_through_its_address_without_a_line_of_python():
    """In which a Ctrl-C would become another error."""
    result = subprocess.run(
        [sys.executable, "-c", CALLED], capture_output=True, text=True, check=True
    )
    assert json.loads(result.stdout) == [False, 81.0, 81.0]
    assert not result.stderr


CALLER = """
from saltus.taylor.numba_types import function_type
@cached_jit(float64(function_type(float64(float64)), float64))
def call(f, x):
    return f(f(x))
"""
PARTS = {  # and the methods of each that are called, or replaced in a class that inherits from it
    "rtsys": ["initialize"],
    "FunctionCache": ["__init__", "_load_overload", "_guard_against_spurious_io_errors"],
    "IndexDataCacheFile": ["__init__", "_load_index", "_load_data", "_open_for_write"],
    "NativeLowering": [],
    "JITCodeLibrary": ["__init__", "add_ir_module", "_get_module_for_linking"],
    "register_pass": [],
    "CompilerBase": ["__init__", "compile_extra"],
    "DefaultPassBuilder": ["define_nopython_pipeline"],
}
# absent, and with another method; the other ways are thorough, as functions are compiled anew for
# each
CHANGES = [
    pytest.param(part, how, marks=() if how in ("absent", *methods[-1:]) else pytest.mark.thorough)
    for part, methods in PARTS.items()
    for how in ("absent", "a function", *methods)
]


@pytest.fixture
def unused(tmp_path, monkeypatch):
    """numba as if saltus had not used it yet, with an empty cache."""
    parts = [private_numba._kept, private_numba._with_digests, private_numba._linked_only]
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(private_numba, "_plain", threading.Event())
    for part in parts:
        part.cache_clear()
    yield
    for part in parts:
        part.cache_clear()


def changed(part, how):
    """A part of numba as another version may have it; None: the version does not have it."""
    if how == "a function":
        return lambda: None
    if isinstance(part, type):
        return type(part.__name__, (part,), {how: lambda self: None})
    return SimpleNamespace(**{how: lambda: None})


@pytest.mark.parametrize(("name", "how"), CHANGES)
def test_with_another_private_part_functions_are_compiled_in_the_plain_way(
    name, how, unused, monkeypatch, caplog
):
    whole = private_numba._private

    def other(module, wanted):
        if wanted == name and how == "absent":
            raise AttributeError(wanted)
        return changed(whole(module, wanted), how) if wanted == name else whole(module, wanted)

    monkeypatch.setattr(private_numba, "_private", other)
    for _ in range(2):  # compiled, and from the cache
        made = load_module("within", WITHIN + CALLER)
        given = pointer(made.four_times)
        assert [
            made.eight_times(1.5),
            entry_point(made.call)(given, 1.25),
            made.call(given, 2.5),
        ] == [12.0, 20.0, 40.0]
        del sys.modules[made.__name__]
    assert private_numba.is_plain()
    assert len(caplog.messages) == 1
    assert "plain way" in caplog.text


def test_where_addresses_are_kept_otherwise_they_are_had_in_the_documented_way(unused):
    made = load_module("within", WITHIN + CALLER)
    made.four_times.get_compile_result = lambda: None  # takes another number of arguments
    made.call.overloads = {}
    assert entry_point(made.call)(pointer(made.four_times), 1.25) == 20.0
    del sys.modules[made.__name__]


@pytest.mark.thorough
def test_motions_are_the_same_in_numba_s_plain_way(tmp_path):
    plain = "from saltus.taylor import private_numba; private_numba.be_plain()\n" + BOTH
    assert run(plain, tmp_path) == run(BOTH, cache_directory().parent)


def test_what_is_private_of_numba_is_imported_in_one_file():
    """By name, or by its name in a string; `numba`, `numba.extending` and `numba.types` are
    public.
    """
    found = set()
    for path in (SOURCE / "saltus").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            names += (
                [node.value]
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
                else []
            )
            if any(re.fullmatch(r"numba\.(?!extending$|types$)[\w.]+", name) for name in names):
                found.add(path.name)
    assert found == {"private_numba.py"}
