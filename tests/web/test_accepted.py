"""What a page refuses is what Python refuses, in the same sentence: the bounds of every number, and
how a page reads them.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess

import numpy as np
import pytest

import saltus
from saltus.web import one_file
from saltus.web.accepted import accepted

NODE = shutil.which("node")
Harmonic = saltus.Harmonic
HARD, PULSED = (
    saltus.NewtonImpact(e=0.4),
    saltus.OneSine(amplitude=0.6, frequency=2.0, start=0.5, quantity="acceleration"),
)
SYSTEMS = {
    "cell": saltus.System(
        model=saltus.Metainterface(beta0=math.radians(80), damping=0.1),
        load=saltus.Load(
            frequency=0.9, horizontal=[Harmonic(0.5), Harmonic(0.1, order=3)], vertical=-0.5
        ),
    ),
    "block": saltus.System(
        model=saltus.RockingBlock(alpha=0.2),
        load=saltus.Load(ground_horizontal=PULSED),
        impact=saltus.VelocityReduction(0.9),
    ),
    "stops": saltus.System(
        model=saltus.TwoStops(left=-0.5, right=1.25),
        load=saltus.Load(frequency=1.0, force=Harmonic(0.3)),
        impact=HARD,
    ),
    "belt": saltus.System(
        model=saltus.BeltOscillator(kinetic=0.2, static=0.3),
        load=saltus.Load(frequency=1.0, force=Harmonic(0.3)),
    ),
    "pair": saltus.System(
        model=saltus.ImpactPair(clearance=0.5),
        load=saltus.Load(frequency=1.0, force=Harmonic(0.3)),
        impact=HARD,
    ),
}  # with numbers that bound one another: stops, and static and kinetic friction


BOUNDS = {name: accepted(system) for name, system in SYSTEMS.items()}


def tried(system, bounds, rng):
    """Values of each number about its own and about its bounds, from near and from far."""
    for path, value in system.parameters.items():
        ends = [bound["end"] for side in ("least", "most") if (bound := bounds[path].get(side))]
        near = [x + s * d for x in (value, *ends) for s in (-1, 1) for d in (0.0, 1e-3, 0.3, 4.0)]
        far = [*rng.normal(0.0, 3.0, 3), *rng.normal(0.0, 300.0, 3), -1e9, 1e9]
        for x in (*near, *far):
            yield path, float(round(x) if path.endswith(".order") and abs(x) < 1e8 and x > 0 else x)


def python_says(system, path, value):
    """Python's sentence, or None where it takes the value; a page has 1 for 1.0."""
    try:
        system.with_({path: int(value) if value.is_integer() else value})
    except saltus.SaltusError as error:
        return str(error)
    return None


ASK = """
import { refusedNumbers } from "%s/checks.js";
const said = JSON.parse(%r).map(({ entries, values, tried }) => tried.map(([path, value]) =>
  refusedNumbers(entries, { ...values, [path]: value })));
console.log(JSON.stringify(said));
"""


@pytest.mark.filterwarnings("ignore:phase = ")  # which nobody means in degrees
@pytest.mark.skipif(NODE is None, reason="node is not installed here")
def test_the_page_refuses_what_python_refuses_in_the_same_sentence():
    rng = np.random.default_rng(1)
    asked = []
    for name, system in SYSTEMS.items():
        entries = [{"path": path, "accepted": bounds} for path, bounds in BOUNDS[name].items()]
        asked.append(
            {
                "entries": entries,
                "values": dict(system.parameters),
                "tried": list(tried(system, BOUNDS[name], rng)),
            }
        )
    script = ASK % (one_file.PAGE.as_uri(), json.dumps(asked))
    command = [
        str(NODE),
        "--no-warnings",
        "--experimental-default-type=module",
        "--input-type=module",
        "-e",
        script,
    ]
    answers = json.loads(
        subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    )
    refused, counted = 0, 0
    for (name, system), given, answer in zip(SYSTEMS.items(), asked, answers, strict=True):
        for (path, value), said in zip(given["tried"], answer, strict=True):
            expected = python_says(system, path, value)
            counted += 1
            refused += expected is not None
            assert (said and said["message"]) == expected, (name, path, value)
    assert counted > 1000
    assert 200 < refused < counted - 200


def test_the_ends_of_a_restitution_are_0_and_1_whatever_else_is_1():
    """The order of a harmonic is 1, too, and takes no fractions."""
    for name in ("cell", "block", "stops", "pair"):
        (path,) = [path for path in BOUNDS[name] if path.startswith("impact.e")]
        for side, end in (("least", 0.0), ("most", 1.0)):
            bound = BOUNDS[name][path][side]
            assert (bound["end"], bound["taken"], bound.get("of")) == (end, True, None)


def test_bounds_that_move_with_another_number_name_it():
    stops, cell = BOUNDS["stops"], BOUNDS["cell"]
    assert stops["model.left"]["most"]["of"] == "model.right"
    assert stops["model.right"]["least"]["of"] == "model.left"
    for side, end in (("least", 0.0), ("most", math.pi)):
        assert (cell["model.beta0"][side]["end"], cell["model.beta0"][side]["taken"]) == (
            end,
            False,
        )
    assert (cell["impact.e"]["most"]["end"], cell["impact.e"]["most"]["taken"]) == (1.0, True)
