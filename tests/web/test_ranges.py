"""What a page refuses is what Python refuses, in the same sentence: the bounds of every number, and
how a page reads them.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from dataclasses import dataclass, field

import numpy as np
import pytest

import saltus
from saltus.flow import PortableMotion
from saltus.web import one_file
from saltus.web.description import description

NODE = shutil.which("node")
Harmonic = saltus.Harmonic
HARD, PULSED = (
    saltus.NewtonImpact(e=0.4),
    saltus.OneSine(amplitude=0.6, frequency=2.0, start=0.5, quantity="acceleration"),
)


@dataclass(frozen=True, kw_only=True)
class Own(saltus.ContactModel):
    """A model of one's own, which declares what its numbers may be and checks nothing itself."""

    stiffness: float = field(default=1.0, metadata=saltus.number_range(above=0.0, at_most=50.0))
    low: float = field(default=-0.5, metadata=saltus.number_range(below="high"))
    high: float = field(default=0.5, metadata=saltus.number_range(at_least=0.1, below=4.0))
    tilt: float = field(
        default=0.1, metadata=saltus.number_range(above=-1.0, below=1.0, unit="rad")
    )
    coordinates = ("x",)
    channels = ("force",)

    @property
    def contacts(self):
        return (
            saltus.Contact(name="low", coordinate="x", position=self.low),
            saltus.Contact(name="high", coordinate="x", position=self.high, sign=-1),
        )

    def force(self, t, x, velocity, load):
        return load.force(t) - self.stiffness * x + np.sin(self.tilt)


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
    "own": saltus.System(
        model=Own(), load=saltus.Load(frequency=1.0, force=Harmonic(0.3)), impact=HARD
    ),
    "smoothed": saltus.System(
        model=saltus.Metainterface(beta0=1.4, smoothing=50.0),
        load=saltus.Load(frequency=0.9, horizontal=Harmonic(0.5)),
    ),
    "structure": saltus.System(
        model=saltus.Structure(
            mass=np.eye(2),
            stiffness=np.diag([1.0, 4.0]),
            forces={"force": [1.0, 0.0]},
            contacts=[
                saltus.Contact(name="tip", coordinate=1, position=0.5, sign=-1, restitution=0.3)
            ],
        ),
        load=saltus.Load(frequency=1.0, force=Harmonic(0.3)),
        impact=HARD,
    ),
}  # with numbers that bound one another: stops, and static and kinetic friction


ENTRIES = {
    name: {
        entry["path"]: entry
        for entry in description(PortableMotion(system))["numbers"]
        if entry["path"] in system.parameters
    }
    for name, system in SYSTEMS.items()
}


def tried(system, entries, rng):
    """Values of each number about its own and about its bounds, from near and from far."""
    for path, value in system.parameters.items():
        bounds = [entries[path]["range"].get(side, {}) for side in ("least", "most")]
        ends = [
            end
            for bound in bounds
            for end in (bound.get("end"), system.parameters.get(bound.get("of")))
            if end is not None
        ]
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
        asked.append(
            {
                "entries": list(ENTRIES[name].values()),
                "values": dict(system.parameters),
                "tried": list(tried(system, ENTRIES[name], rng)),
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


def test_an_end_is_a_number_or_another_number_of_the_system():
    for name in ("cell", "block", "stops", "pair"):
        (path,) = [path for path in ENTRIES[name] if path.startswith("impact.e")]
        declared = ENTRIES[name][path]["range"]
        assert declared["least"] == {"end": 0.0, "taken": True}
        assert declared["most"] == {"end": 1.0, "taken": True}
    stops = ENTRIES["stops"]
    assert stops["model.left"]["range"]["most"] == {"of": "model.right", "taken": False}
    assert stops["model.right"]["range"]["least"] == {"of": "model.left", "taken": False}
    angle = ENTRIES["cell"]["model.beta0"]["range"]
    assert angle["least"] == {"end": 0.0, "taken": False}
    assert angle["most"] == {"end": math.pi, "taken": False}


def test_numbers_that_can_have_one_value_here():
    only = {
        name: [path for path, entry in entries.items() if "only" in entry["range"]]
        for name, entries in ENTRIES.items()
    }
    assert only == {
        "cell": [],
        "block": [],
        "stops": [],
        "pair": [],
        "belt": ["impact.e"],
        "own": [],
        "smoothed": [
            "model.stiffness_ratio",
            "model.mass_ratio",
            "model.dissipation_ratio",
            "impact.e",
        ],
        "structure": [],
    }


@pytest.mark.parametrize("name", SYSTEMS)
def test_sliders_of_systems_without_dimensions_reach_1_or_twice_the_value(name):
    for entry in ENTRIES[name].values():
        reach = math.pi if entry["unit"] == "rad" else max(1.0, 2.0 * abs(entry["value"]))
        ends = entry["value"] - reach, entry["value"] + reach
        assert (entry["low"], entry["high"]) == pytest.approx(ends), entry["path"]


def stiff(length=1.0, **changes):
    """A mass of 1 kg on a spring of 1e4 N/m at a wall, under 5 N at 120 rad/s, where a metre is
    `length`: the force moves it by 0.7 mm.
    """
    numbers = {"wall": 2e-3 * length, "damping": 0.1, "stiffness": 1e4} | changes
    return saltus.System(
        model=saltus.WallOscillator(**numbers),
        load=saltus.Load(frequency=120.0, force=Harmonic(5.0 * length)),
        impact=saltus.NewtonImpact(e=0.1),
    )


def entries_of(system):
    return {entry["path"]: entry for entry in description(PortableMotion(system))["numbers"]}


def ends(entry):
    return entry["low"], entry["high"]


def test_sliders_in_si_units_reach_twice_the_value():
    found = entries_of(stiff())
    assert ends(found["model.wall"]) == pytest.approx((-2e-3, 6e-3))
    assert ends(found["model.damping"]) == pytest.approx((-0.1, 0.3))
    assert ends(found["load.frequency"]) == pytest.approx((-120.0, 360.0))
    assert ends(found["load.force.mean"]) == pytest.approx(
        (-5.0, 5.0)
    )  # as the amplitude beside it
    assert ends(found["impact.e"]) == pytest.approx((-0.9, 1.1))  # which its bounds cut, as ever


def test_a_slider_of_0_reaches_as_far_as_the_system_moves_in_any_unit():
    for length in (1.0, 1e3, 1e6):  # m, mm, um
        system = stiff(length, wall=0.0)
        low, high = ends(entries_of(system)["model.wall"])
        # the load moves the equilibrium by 2 F / (m Omega^2), from one end of its swing to the other
        assert (low, high) == (-high, pytest.approx(2.0 * 5.0 / 120.0**2 * length, rel=0.06))
        (coordinate,) = description(PortableMotion(system))["model"]["coordinates"]
        assert coordinate["reach"] == pytest.approx(
            [2.0 * high, 2.0 * high * 120.0], rel=0.1
        )  # two digits


def test_a_declared_unit_says_what_a_slider_of_0_measures():
    @dataclass(frozen=True, kw_only=True)
    class Offset(saltus.ContactModel):
        stiffness: float = 1e4
        offset: float = field(default=0.0, metadata=saltus.number_range(unit="m"))
        speed: float = field(default=0.0, metadata=saltus.number_range(unit="m/s"))
        unknown: float = 0.0
        coordinates = ("x",)
        channels = ("force",)
        contacts = (saltus.Contact(name="wall", coordinate="x", position=-2e-3),)

        def force(self, t, x, velocity, load):
            drag = 2.0 * (velocity - self.speed) + self.unknown
            return load.force(t) - self.stiffness * (x - self.offset) - drag

    system = saltus.System(
        model=Offset(), load=saltus.Load(frequency=120.0, force=Harmonic(5.0)), impact=HARD
    )
    found = entries_of(system)
    length = saltus.systems.natural_units(system).length
    assert length < 0.01
    assert found["model.offset"]["high"] == pytest.approx(length, rel=0.06)
    assert found["model.speed"]["high"] == pytest.approx(length * 120.0, rel=0.06)
    assert ends(found["model.unknown"]) == (-1.0, 1.0)
