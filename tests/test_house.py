"""The house: what may import what, how light the door is, and that every public name is there."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import saltus
from saltus import flow

SOURCE = Path(saltus.__file__).parent

# A room may import the front doors of the rooms in its list, and what every room shares; `plots` knows datasets only.
SHARED = {"errors", "checks", "files", "progress", "provenance", "_front_door"}
MAY_IMPORT = {
    "systems": set(),
    "theory": {"systems"},
    "taylor": {"systems"},
    "bounds": {"systems", "taylor"},
    "flow": {"systems", "taylor", "bounds"},
    "orbits": {"systems", "taylor", "flow"},
    "attractors": {"systems", "taylor", "bounds", "flow", "orbits"},
    "sweep": set(),
    "studies": {"systems", "theory", "flow", "orbits", "attractors", "sweep"},
    "plots": set(),
    "config": {"systems", "flow"},
    "paper": {"systems", "theory", "flow", "orbits", "attractors", "sweep", "studies", "plots"},
    "cli": {"systems", "theory", "flow", "orbits", "attractors", "sweep", "studies", "plots", "config", "paper"},
}
HEAVY = (
    *("scipy", "numba", "xarray", "matplotlib", "pydantic", "h5netcdf", "zarr", "distributed"),
    *("saltus.flow", "saltus.sweep", "saltus.paper"),
)


def imported_rooms(path: Path) -> set[str]:
    """The rooms of saltus that a file imports, at its top or inside its functions, but not for type checking alone."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    names = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
    names += [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
    return {name.split(".")[1] for name in names if name.startswith("saltus.")} - SHARED


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_imports_run_one_way(room: str) -> None:
    for path in (SOURCE / room).rglob("*.py"):
        foreign = imported_rooms(path) - MAY_IMPORT[room] - {room}
        assert not foreign, f"{path.relative_to(SOURCE)} imports {foreign}"


@pytest.mark.parametrize("name", saltus.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(saltus, name) is not None


@pytest.mark.parametrize("name", flow.__all__)
def test_every_name_of_the_flow_is_there(name: str) -> None:
    assert getattr(flow, name) is not None


def test_one_motion_needs_no_lanes_and_an_ensemble_no_dask() -> None:
    start = "import sys, saltus; s = saltus.System(model=saltus.WallOscillator(damping=0.1), load=saltus.Load(force=0.3))"
    ask = "print([m for m in ('saltus.flow.ensemble', 'xarray', 'dask') if m in sys.modules])"
    motion, ensemble = "saltus.simulate(s, x=0.5, duration=1.0)", "saltus.simulate_many(s, x=[0.5, 0.4], duration=1.0)"
    command = [sys.executable, "-c", "; ".join([start, motion, ask, ensemble, ask])]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert result.stdout.split("\n")[:2] == ["[]", "['saltus.flow.ensemble', 'xarray']"]


def test_a_wrong_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no 'Motoin'"):
        _ = flow.Motoin
    with pytest.raises(AttributeError, match="no 'simulat'"):
        _ = saltus.simulat


@pytest.mark.parametrize("statement", ["import saltus", "import saltus.cli", "from saltus import Metainterface, System"])
def test_the_door_is_light(statement: str) -> None:
    loaded = f"{statement}; import sys; print([m for m in {HEAVY!r} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


@pytest.mark.parametrize("script", sorted((SOURCE.parents[1] / "examples").glob("*.py")), ids=lambda p: p.name)
def test_examples_are_short_and_end_in_an_assertion_that_holds(script: Path) -> None:
    text = script.read_text()
    assert text.count("\n") <= 60
    assert "assert " in text
    environment = os.environ | {"PYTHONWARNINGS": "error::RuntimeWarning"}
    result = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=environment, cwd=script.parent)
    assert result.returncode == 0, result.stderr
