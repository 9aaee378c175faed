"""The page's modules without a browser: in node where it is installed, and their exports and
geometry against Python's.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import stand_in

import saltus
from saltus.web import one_file

HERE = Path(__file__).parent
NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="node is not installed here")


def node(script: str) -> object:
    """What a script for node prints as JSON; it may import the page's modules as `page/name.js`."""
    address = one_file.PAGE.as_uri()
    script = script.replace('"page/', f'"{address}/')
    command = [
        str(NODE),
        "--no-warnings",
        "--experimental-default-type=module",
        "--input-type=module",
        "-e",
        script,
    ]
    return json.loads(
        subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    )


@needs_node
def test_the_modules_do_what_their_own_tests_say():
    done = subprocess.run(
        [str(NODE), "--test", str(HERE / "modules.test.mjs")],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


def test_all_modules_are_joined_in_the_order_of_their_imports():
    text = one_file.joined(HERE / "stand_in_boot.js")
    names = [line.split()[1] for line in text.splitlines() if line.startswith("const module_")]
    assert len(names) == len(set(names)) > 15
    assert names.index("module_numbers") < names.index("module_plot") < names.index("module_main")
    assert not [line for line in text.splitlines() if line.startswith(("import ", "export "))]


def test_texts_of_a_study_are_never_markup():
    hostile = stand_in.wall() | {"title": '</script><script>alert("1")</script>{{script}}'}
    page = stand_in.page_of(hostile)
    assert "<script>alert" not in page
    # the description, the engine, the worker, the joined modules and what unpacks them
    assert page.count("<script") == 5
    assert "default-src 'none'" in page


@needs_node
@pytest.mark.parametrize(
    ("beta0", "theta_1", "theta_2"),
    [(1.4, 0.0, 0.0), (1.4, 0.6, 0.0), (1.1, 0.3, -1.2), (2.0, 1.9, -0.2)],
)
def test_the_cell_on_the_page_is_that_of_unit_cell(beta0, theta_1, theta_2):
    base = 1.7
    cell = saltus.UnitCell(beta0=beta0, alpha0=math.atan2(math.sin(beta0), base - math.cos(beta0)))
    layout = cell.layout(theta_1, theta_2).points
    script = (
        'import { cellPoints } from "page/cell_drawing.js"; '
        "console.log(JSON.stringify(cellPoints(%r, %r, %r)));"
    )
    drawn = node(script % (beta0, theta_1, theta_2))
    names = {
        "lowerLeft": "lower_left",
        "middleRight": "middle_right",
        "upperLeft": "upper_left",
        "upperRight": "upper_right",
    }
    for ours, theirs in {**names, "mass1": "mass_1", "mass2": "mass_2"}.items():
        np.testing.assert_allclose(drawn[ours], layout[theirs], atol=1e-12)
    for layer in (1, 2):
        ends = [layout[f"slider_{layer}_in"], layout[f"slider_{layer}_out"]]
        # a square root at a closed layer
        np.testing.assert_allclose(drawn[f"slider{layer}"], ends, atol=1e-7)


EXPORT = """
import { asPython, asToml } from "page/exports.js";
import { firstState, prepared } from "page/description.js";
const description = prepared(%s);
const state = firstState(description);
state.values = { ...state.values, ...%s };
state.start = { ...state.start, ...%s };
console.log(JSON.stringify([asToml(description, state), asPython(description, state)]));
"""


def described(system: saltus.System, **start: float) -> dict:
    """What the exports need of a description, for any system."""
    coordinates = [
        {"name": name, "velocity": f"{name}_velocity", "unit": "1"}
        for name in system.model.coordinates
    ]
    parts = {
        "model": {
            "name": type(system.model).__name__,
            "coordinates": coordinates,
            "parameters": [],
        },
        "load": [],
    }
    return parts | {
        "start": {"time": 0.0, **start},
        "study": {"system": json.loads(system.to_json()), "simulate": {"periods": 3}},
    }


STOPS = saltus.System(
    model=saltus.TwoStops(left=-0.5, right=1.25),
    load=saltus.Load(frequency=0.7, force=[0.25, saltus.Harmonic(0.3, phase=0.5, order=3)]),
    impact=saltus.NewtonImpact(e=0.7),
)
BLOCK = saltus.System(
    model=saltus.RockingBlock(alpha=0.3),
    load=saltus.Load(
        frequency=2.0,
        ground_horizontal=saltus.HalfSine(amplitude=0.5, frequency=2.0, quantity="acceleration"),
        ground_vertical=0.0,
    ),
    impact=saltus.InelasticImpact(),
)


@needs_node
@pytest.mark.parametrize(
    ("system", "values", "start"),
    [
        (
            STOPS,
            {"load.force.1.amplitude": 1e-7, "model.damping": 0.1 + 0.2, "impact.e": 1.0},
            {"x": -1 / 3, "x_velocity": 2.0},
        ),
        (
            BLOCK,
            {"model.alpha": 0.25, "load.ground_horizontal.amplitude": 2.0, "load.frequency": 1.5},
            {"theta": 0.05},
        ),
    ],
)
def test_an_exported_study_and_exported_python_make_the_same_system(
    tmp_path, system, values, start
):
    given = json.dumps(described(system, **start)), json.dumps(values), json.dumps(start)
    toml, python = node(EXPORT % given)
    (tmp_path / "study.toml").write_text(toml)
    study = saltus.load_study(tmp_path / "study.toml")
    assert study.system == system.with_(values)
    made: dict = {}
    exec(python, made)
    assert made["system"] == system.with_(values)
    motion = study.run()
    assert (made["motion"].time, made["motion"].velocity) == (motion.time, motion.velocity)
    first = made["motion"].to_xarray()[system.model.coordinates[0]].values[0]
    assert first == start[system.model.coordinates[0]]
