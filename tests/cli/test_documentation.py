"""The tables of the pages are those of the code (that the code on them runs: tests/pages)."""

import dataclasses
import inspect
import re
from pathlib import Path

import numpy as np
from shared_systems import forced

import saltus
from saltus.bounds.capture import capture_speed
from saltus.config import load_study
from saltus.systems import IMPACTS, MODELS

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "study.md").read_text(encoding="utf-8")
ORBITS = "".join(
    (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("orbits", "spectra")
)
ENSEMBLES = (ROOT / "docs" / "ensembles.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


def test_the_first_study_can_be_run(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(BLOCKS[0])
    assert load_study(path).run().stop is saltus.Stop.HORIZON


def test_every_way_to_write_a_channel(tmp_path):
    (tmp_path / "quake.csv").write_text("0,0\n1,1\n2,0\n")
    path = tmp_path / "study.toml"
    for line in BLOCKS[1].splitlines():
        path.write_text(
            f'[model]\ntype = "Metainterface"\nbeta0 = 1\n[load]\nfrequency = 2\n{line}\n'
        )
        assert len(load_study(path).system.load.channels) == 1


def test_the_models_table_is_that_of_the_classes():
    rows = {
        row[0]: row
        for row in re.findall(
            r"^\| `(\w+)` \| ([^|]*)\| ([^|]*)\| ([^|]*)\| ([^|]*)\|$", TEXT, re.MULTILINE
        )
    }
    assert set(rows) == {
        name
        for name, cls in MODELS.items()
        if cls.__module__.startswith("saltus.")
        and cls.__module__ != "saltus.systems.structures.from_symbols"  # made by other tests
    }
    for name, (_, needs, optional, channels, coordinates) in rows.items():
        model = MODELS[name]
        # of a structure, from its matrices or by `reduced`
        following = ("coefficients", "records", "form", "basis")
        named = re.findall(r"`(\w+)`", re.sub(r"\([^)]*\)", "", needs + optional))
        assert named == [f.name for f in dataclasses.fields(model) if f.name not in following]
        # else their number is in the model's numbers
        if not isinstance(vars(model).get("coordinates"), property):
            assert re.findall(r"`(\w+)`", coordinates) == list(model.coordinates)
        if "the same" not in channels and name != "Structure":
            assert re.findall(r"`(\w+)`", channels) == list(model.channels)


def test_the_impact_laws_are_all_named():
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*)\| [^|]*\|$", TEXT, re.MULTILINE))
    for name, law in IMPACTS.items():
        assert re.findall(r"`(\w+)`", rows[name]) == [f.name for f in dataclasses.fields(law)]


# --- Python ------------------------------------------------------------------


def section(title):
    return ENSEMBLES.split(f"\n## {title}\n")[1].split("\n## ")[0]


def test_the_arguments_of_simulate_many_are_all_there():
    named = re.findall(
        r"`(\w+)`", " ".join(re.findall(r"^\| (`[^|]*)\|", section("Arguments"), re.MULTILINE))
    )
    arguments = set(inspect.signature(saltus.simulate_many).parameters) - {"system", "coordinates"}
    assert set(named) - {"theta", "x", "theta_1", "theta_2"} == arguments


def test_the_variables_and_the_stops_of_an_ensemble_are_all_there():
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.2),
        load=saltus.Load(frequency=3.0, ground_horizontal=saltus.Harmonic(amplitude=0.1)),
        impact=saltus.VelocityReduction(0.9),
    )
    ensemble = saltus.simulate_many(
        block,
        theta=[0.01, 0.02],
        velocity=[0.0, 0.1],
        time=[0.0, 1.0],
        periods=2,
        sample=("state", "extrema", "impact_count", "speed"),
        until=("rest", "settled"),
        sensitivities=(),
    )
    tables = section("What is returned").split("| `stop` | |")
    variables, stops = (
        re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`[^|]*)\|", t, re.MULTILINE)))
        for t in tables
    )
    assert set(variables) == set(ensemble)
    assert stops == ensemble.stop.attrs["flag_meanings"].split()


def test_the_thresholds_of_capture_are_those_of_the_system_above():
    numbers = np.array(
        re.findall(
            r"^\| ([\d.]+) \| ([\d.e-]+) \| ([\d.e-]+) \|$", section("Ending early"), re.MULTILINE
        ),
        dtype=float,
    )
    assert len(numbers) == 5
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.05), vertical=-0.5),
    )
    paths = {"load.horizontal.amplitude": numbers[:, :1], "impact.e": np.array([1.0, 0.9])}
    np.testing.assert_allclose(capture_speed(system, paths), numbers[:, 1:], rtol=0.05)


# --- orbits ------------------------------------------------------------------


def orbits_section(title):
    return ORBITS.split(f"\n## {title}\n")[1].split("\n## ")[0]


def first_cells(text):
    return re.findall(r"`([^`]+)`", " ".join(re.findall(r"^\| (`[^|]*)\|", text, re.MULTILINE)))


def test_the_attributes_of_an_orbit_are_all_there():
    orbit = saltus.find_orbit(forced(), theta=0.3)
    named = first_cells(orbits_section("One orbit"))
    assert len(named) > 15
    for name in named:
        assert hasattr(orbit, name.removesuffix("()"))


def test_the_kinds_of_special_points_are_all_there():
    from saltus.orbits import SpecialKind

    named = set(first_cells(orbits_section("A branch").split("| `ends` | |")[0]))
    assert named - {"kind"} == {kind for kind in SpecialKind if kind.codimension == 1}


def test_the_options_of_a_diagram_are_all_there():
    from saltus import bifurcation_diagram, response_spectrum

    options = set(inspect.signature(bifurcation_diagram).parameters) - {"system", "path"}
    rows = dict(
        re.findall(
            r"^\| (`[^|]*)\|([^|]*)\|[^|]*\|$", orbits_section("Spectra and diagrams"), re.MULTILINE
        )
    )
    named = {
        name: default.strip()
        for cell, default in rows.items()
        for name in re.findall(r"`(\w+)`", cell)
    }
    assert options <= set(named)
    bounds = [
        inspect.signature(f).parameters["bounds"].default
        for f in (response_spectrum, bifurcation_diagram)
    ]
    assert named["bounds"] == ", ".join(f"({low:g}, {high:g})" for low, high in bounds)
    for name in ("max_period", "repelling", "step"):
        assert named[name] == f"{inspect.signature(bifurcation_diagram).parameters[name].default:g}"


def test_the_nodes_and_variables_of_a_diagram_are_all_there():
    from saltus import response_spectrum

    tree = response_spectrum(forced(), bounds=(0.8, 1.0), max_period=1, values=[0.9], starts=8)
    _, rest = orbits_section("Spectra and diagrams").split("| node | |")
    nodes, variables = rest.split("| variable of a branch |")
    assert set(first_cells(nodes)) == set(tree.children)
    assert set(first_cells(variables)) - {"releases", "rests"} == set(
        saltus.branch_of(tree, 0).data_vars
    )


def test_the_gallery_lists_every_example_under_its_title():
    header = (ROOT / "examples" / "GALLERY_HEADER.rst").read_text(encoding="utf-8")
    listed = re.findall(r":doc:`([^<]+) <(\w+)>`", header)
    titles = {
        path.stem: inspect.cleandoc(path.read_text(encoding="utf-8").lstrip('"')).splitlines()[0]
        for path in (ROOT / "examples").glob("*.py")
        if path.stem != "in_jax"  # the site is built without JAX
    }
    assert len(listed) == len(titles)
    assert {name: title for title, name in listed} == titles
