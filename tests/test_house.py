"""The house: what may import what, through which door, and how light the front door is."""

from __future__ import annotations

import ast
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import saltus

SOURCE = Path(saltus.__file__).parent
FILES = sorted(SOURCE.rglob("*.py"))
ROOMS = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))

SHARED = {
    "errors",
    "enumerations",
    "notebook",
    "result",
    "result_tree",
    "checks",
    "kinds",
    "number_ranges",
    "files",
    "progress",
    "branch_tables",
    "_front_door",
}  # what every room may import
# The rooms whose front doors a room may use besides its own; `plots` knows datasets, and from
# `systems` the drawings of mechanisms; `continuation` knows functions and arrays, and from `taylor`
# how its arithmetic is compiled.
MAY_IMPORT = {
    "systems": set(),
    "theory": {"systems"},
    "taylor": {"systems"},
    "bounds": {"systems", "taylor"},
    "flow": {"systems", "taylor", "bounds"},
    "continuation": {"taylor"},
    "orbits": {"systems", "taylor", "bounds", "flow", "continuation"},
    "attractors": {"systems", "taylor", "bounds", "flow", "continuation", "orbits", "sweep"},
    "sweep": set(),
    "studies": {"systems", "theory", "flow", "continuation", "orbits", "attractors", "sweep"},
    "plots": {"systems"},
    "config": {"systems", "flow", "attractors", "sweep", "studies"},
    "web": {"systems", "taylor", "flow", "orbits", "config"},
    "cli": {
        "systems",
        "theory",
        "flow",
        "preparation",
        "taylor",
        "orbits",
        "attractors",
        "sweep",
        "studies",
        "plots",
        "config",
    },
}
# The folders of a room from below: each uses those before it, and those of one floor not each other.
# A file of the room itself has no floor.
FLOORS = {
    "systems": ({"files"}, {"loads"}, {"contracts"}, {"structures"}, {"catalogue"}),
    "flow": (
        {"kernel"},
        {"lane_steps"},
        {"one_contact", "contacts"},
        {"programs"},
        {"motion", "cuda"},
        {"lanes"},
        {"long_time"},
    ),
    "orbits": (
        {"segments"},
        {"contract"},
        {"beyond"},
        {"equations"},
        {"finding"},
        {"branches"},
        {"proofs"},
    ),
}
# of the lanes, and for other processors
TEXTS = {
    f"saltus.taylor.{name}"
    for name in (
        *("lane_memory", "lane_vectors", "load_tables", "vectors"),
        *("elementary", "portable_text", "private_numba", "numba_types"),
    )
}
HEAVY = (
    *("scipy", "numba", "xarray", "matplotlib", "h5netcdf", "zarr", "distributed"),
    *("saltus.flow", "saltus.sweep", "saltus_paper"),
)
# lines, docstrings included, but not their sections


# --- imports -----------------------------------------------------------------


def module_of(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path) for path in FILES}


@cache
def parsed(path: Path) -> ast.Module:
    """A file's tree, not to be changed."""
    return ast.parse(path.read_text())


@cache
def behind_the_door(package: str) -> dict[str, str]:
    """The module of each name that a front door gives, by its stub."""
    stub = SOURCE.parent.joinpath(*package.split("."), "__init__.pyi")
    if not stub.exists():
        return {}
    imports = [
        node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)
    ]
    return {
        a.name: f"{package}.{node.module}" if node.module else package
        for node in imports
        for a in node.names
    }


@cache
def statements(path: Path) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """The import statements of a file, at its top or inside its functions, but not for type
    checking alone.
    """
    typing = [
        node
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
    ]
    checked = {id(inner) for node in typing for part in node.body for inner in ast.walk(part)}
    found = (
        node for node in ast.walk(parsed(path)) if isinstance(node, (ast.Import, ast.ImportFrom))
    )
    return tuple(node for node in found if id(node) not in checked)


@cache
def imported(path: Path) -> tuple[tuple[int, str, str], ...]:
    """(line, the module as it is written, the module that is reached) of all that a file imports of
    saltus.
    """
    return tuple(found_imports(path))


def found_imports(path: Path) -> Iterator[tuple[int, str, str]]:
    for node in statements(path):
        if isinstance(node, ast.Import):
            yield from (
                (node.lineno, a.name, a.name) for a in node.names if a.name.startswith("saltus")
            )
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "saltus":
            for a in node.names:
                home = behind_the_door(node.module).get(a.name)
                submodule = f"{node.module}.{a.name}"
                is_module = home is None and submodule in MODULES
                yield (
                    (node.lineno, submodule, submodule)
                    if is_module
                    else (node.lineno, node.module, home or node.module)
                )


def room_of(module: str) -> str:
    return [*module.split("."), ""][1]


@pytest.mark.parametrize("room", ROOMS)
def test_imports_run_one_way(room: str) -> None:
    for path in (SOURCE / room).rglob("*.py"):
        foreign = (
            {room_of(reached) for _, _, reached in imported(path)}
            - SHARED
            - MAY_IMPORT[room]
            - {room, ""}
        )
        assert not foreign, f"{path.relative_to(SOURCE)} imports {foreign}"


def floor_of(room: str, module: str) -> int | None:
    """The floor of a module's folder in its room, from below; none for a file of the room."""
    folder = [*module.split("."), "", ""][2]
    return next((level for level, names in enumerate(FLOORS[room]) if folder in names), None)


@pytest.mark.parametrize("room", FLOORS)
def test_the_folders_of_a_room_are_floors(room: str) -> None:
    past = []
    for path in (SOURCE / room).rglob("*.py"):
        module = module_of(path)
        own = floor_of(room, module)
        for line, _, reached in imported(path):
            if room_of(reached) != room or own is None:
                continue
            level = floor_of(room, reached)
            same_folder = reached.split(".")[:3] == module.split(".")[:3]
            if level is not None and level >= own and not same_folder:
                past.append(f"{path.relative_to(SOURCE)}:{line} {reached}")
    assert not past


@pytest.mark.parametrize("room", FLOORS)
def test_every_folder_of_a_room_has_its_floor(room: str) -> None:
    folders = {path.parent.name for path in (SOURCE / room).glob("*/__init__.py")}
    assert folders == set().union(*FLOORS[room])


def test_rooms_import_each_other_through_their_front_doors() -> None:
    past = []
    for path in FILES:
        room = room_of(module_of(path))
        for line, written, reached in imported(path):
            other = room_of(reached)
            inner = (
                other in ROOMS
                and other != room
                and (written != f"saltus.{other}" or reached.endswith(f".{other}"))
            )
            if inner and room in ROOMS and reached not in TEXTS:
                past.append(f"{path.relative_to(SOURCE)}:{line} {reached}")
    assert not past


def test_a_name_that_saltus_gives_has_no_second_door_unless_another_room_needs_it() -> None:
    users = {
        (room, name)
        for room in ROOMS
        for name in behind_the_door(f"saltus.{room}")
        if name in behind_the_door("saltus")
    }
    for path in FILES:
        for node in statements(path):
            if isinstance(node, ast.ImportFrom) and room_of(module_of(path)) != room_of(
                node.module or ""
            ):
                users -= {(room_of(node.module or ""), a.name) for a in node.names}
    assert not users


def test_no_files_import_each_other_in_a_circle() -> None:
    graph = {
        module_of(path): {reached for _, _, reached in imported(path)}
        for path in FILES
        if path.name != "__init__.py"
    }
    graph = {
        module: {other for other in others if other in graph} - {module}
        for module, others in graph.items()
    }
    while free := [module for module, others in graph.items() if not others]:
        graph = {
            module: others - set(free) for module, others in graph.items() if module not in free
        }
    while ends := set(graph) - {other for others in graph.values() for other in others}:
        graph = {module: others for module, others in graph.items() if module not in ends}
    assert not graph, f"circles among {sorted(graph)}"


@pytest.mark.parametrize(
    "package",
    ["saltus", *(f"saltus.{room}" for room in ROOMS if behind_the_door(f"saltus.{room}"))],
)
def test_every_name_of_a_front_door_is_there_and_no_file_hides_it(package: str) -> None:
    door = __import__(package, fromlist=["_"])
    assert sorted(door.__all__) == sorted(set(door.__all__))
    for name in door.__all__:
        assert getattr(door, name) is not None
    if package != "saltus":
        folder = SOURCE.parent.joinpath(*package.split("."))
        assert not [
            name
            for name in door.__all__
            if (folder / f"{name}.py").exists() or (folder / name).is_dir()
        ]


def test_a_wrong_public_name_is_answered_with_the_near_ones() -> None:
    with pytest.raises(AttributeError, match="no 'Motoin'; did you mean 'Motion'"):
        _ = saltus.flow.Motoin
    with pytest.raises(AttributeError, match="no 'simulat'; did you mean 'simulate'"):
        _ = saltus.simulat


# --- models ------------------------------------------------------------------

GENERIC = ("taylor", "bounds", "flow", "continuation", "orbits", "attractors", "studies", "sweep")
SPECIAL = {"Metainterface", "RockingBlock", "TwoLayer", "WallOscillator", "beta0"}


def words(tree: ast.AST) -> Iterator[str]:
    """The names, attributes and texts of a file's code; those of docstrings are no code."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.alias):
            yield node.name
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) < 80
        ):
            yield from node.value.replace(".", " ").split()


@pytest.mark.parametrize("room", GENERIC)
def test_generic_code_knows_no_special_model(room: str) -> None:
    known = {
        path.name: SPECIAL & set(words(parsed(path))) for path in (SOURCE / room).rglob("*.py")
    }
    assert not {name: found for name, found in known.items() if found}


# --- words ---------------------------------------------------------------------


def test_docstrings_have_the_sections_of_numpy() -> None:
    """One style for all: a heading with a line under it, and never a heading with a colon."""
    files = [
        path
        for path in FILES
        if re.search(
            r"^ *(Args|Parameters|Returns|Yields|Raises|Examples):$", path.read_text(), re.M
        )
    ]
    assert not files


@pytest.mark.parametrize(
    "path", [p for p in FILES if p.name == "__init__.py"], ids=lambda p: str(p.relative_to(SOURCE))
)
def test_every_room_says_what_is_in_it(path: Path) -> None:
    assert len(ast.get_docstring(parsed(path)) or "") > 40


# --- weight ------------------------------------------------------------------


def test_one_motion_needs_no_lanes_and_an_ensemble_no_dask() -> None:
    start = (
        "import sys, saltus; s = saltus.System(model=saltus.WallOscillator(damping=0.1), "
        "load=saltus.Load(force=0.3))"
    )
    ask = "print([m for m in ('saltus.flow.lanes', 'xarray', 'dask') if m in sys.modules])"
    motion, ensemble = (
        "saltus.simulate(s, x=0.5, duration=1.0)",
        "saltus.simulate_many(s, x=[0.5, 0.4], duration=1.0)",
    )
    command = [sys.executable, "-c", "; ".join([start, motion, ask, ensemble, ask])]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert result.stdout.split("\n")[:2] == ["[]", "['saltus.flow.lanes', 'xarray']"]


@pytest.mark.parametrize(
    "statement", ["import saltus", "import saltus.cli", "from saltus import Metainterface, System"]
)
def test_the_front_door_is_light(statement: str) -> None:
    loaded = f"{statement}; import sys; print([m for m in {HEAVY!r} if m in sys.modules])"
    result = subprocess.run(
        [sys.executable, "-c", loaded], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


def test_the_help_of_the_command_line_imports_no_numpy() -> None:
    """It took twice as long with it; what other packages add to the commands is imported too."""
    program = (
        "import sys; from typer.testing import CliRunner; import saltus.cli; from "
        "saltus.cli.app import app;"
    )
    shown = (
        f"{program} CliRunner().invoke(app, ['--help'], catch_exceptions=False); "
        "print('numpy' in sys.modules)"
    )
    result = subprocess.run(
        [sys.executable, "-c", shown], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "False"


SCRIPTS = sorted((SOURCE.parents[1] / "examples").glob("*.py"))
LONGEST = {
    "chaos.py",
    "basins.py",
    "response_spectrum.py",
    "erosion.py",
    "ten_masses.py",
    "soft_stop.py",
    "beam_on_stop.py",
    "beam_on_hard_stop.py",
    "large_beam_with_stop.py",
    "identification.py",
    "overturning_spectrum.py",
    "rubbing_absorber.py",
    "stribeck.py",
    "preloaded_stop.py",
    "backlash.py",
    "design_grid.py",
    "cell_chain.py",
    "shaken_table.py",
    "belt.py",
    "smoothing.py",
    "falling_block.py",
    "bilinear.py",
    "orbits.py",
    "harvester.py",
    "piezo_harvester.py",
    "elastic_bar.py",
    "overturning.py",
}  # seconds each; the gallery of `make docs` runs all of them


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.name)
def test_examples_are_short(script: Path) -> None:
    text = script.read_text()
    title, line = (ast.get_docstring(ast.parse(text)) or "\n").splitlines()[:2]
    assert line == "=" * len(title)  # or the gallery's page has a warning, which ends `make docs`
    assert "assert " in text


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.name)
def test_pictures_of_examples_are_shown(script: Path) -> None:
    """`plt.show` and the gallery know figures of pyplot alone."""
    for node in ast.walk(ast.parse(script.read_text())):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "saltus.plot":
            assert {keyword.arg for keyword in node.keywords} & {"ax", "figure"}, node.lineno


@pytest.mark.parametrize(
    "script",
    [
        pytest.param(path, marks=pytest.mark.thorough if path.name in LONGEST else ())
        for path in SCRIPTS
    ],
    ids=lambda p: p.name,
)
def test_examples_end_in_an_assertion_that_holds(
    script: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    if script.name == "in_jax.py":
        pytest.importorskip("optax")  # and with it JAX, which the tests do not install
    monkeypatch.chdir(script.parent)
    monkeypatch.syspath_prepend(script.parent)
    runpy.run_path(str(script), run_name="__main__")
    pyplot.close("all")


def test_every_test_that_is_named_for_contributors_is_there() -> None:
    """`tests/file.py::name`, and `::name` of the file before it."""
    page, file, found = (SOURCE.parents[1] / "CONTRIBUTING.md").read_text(), "", 0
    for named in re.findall(r"`(tests/\S+\.py)?::(\w+)`", page):
        file = named[0] or file
        assert f"\ndef {named[1]}(" in (SOURCE.parents[1] / file).read_text(), f"{file}::{named[1]}"
        found += 1
    assert found > 20


# --- order -------------------------------------------------------------------


def bare_sorts(tree: ast.Module) -> list[int]:
    """The lines of calls of `argsort` and `argpartition` that leave the order of equal numbers to
    the processor."""
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return [
        call.lineno
        for call in calls
        if getattr(call.func, "attr", getattr(call.func, "id", "")) in ("argsort", "argpartition")
        and not any(
            word.arg == "kind" and getattr(word.value, "value", None) == "stable"
            for word in call.keywords
        )
    ]


def test_every_sort_of_places_is_stable():
    """NumPy's default orders equal numbers by the width of the processor's vectors."""
    assert bare_sorts(ast.parse("np.argsort(a)\nb.argsort(kind='quicksort')")) == [1, 2]
    found = {
        str(path.relative_to(SOURCE)): lines
        for path in FILES
        if (lines := bare_sorts(parsed(path)))
    }
    assert not found
