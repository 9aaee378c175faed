"""Structures with relays, surfaces that are functions, and switched forces: beside the same models as
classes, beside DOP853 with events, and what is refused.
"""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus

N = 4
LOAD = saltus.Load(frequency=0.6, drive=saltus.Harmonic(0.3))
PLACE, SPEED = [0.0, 0.1, 0.2, 0.2], [0.1, -0.2, 0.0, 0.3]


def chain(size=N, damping=0.02):
    """The matrices of equal masses between springs, the first of which is fixed."""
    stiffness = 2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    stiffness[-1, -1] = 1.0
    return {"mass": np.eye(size), "stiffness": stiffness, "damping": damping * stiffness}


VALVE = saltus.Relay(name="valve", on="high", off="low")
HIGH = {"x3": 1.0, "constant": -0.3}
LOW = {3: -1.0, "constant": -0.1}


def structure(**more):
    """A damper at the tip that goes on above 0.3 and off below -0.1, and a damper between the first
    two masses that is harder in rebound than in bump."""
    given = {
        "surfaces": [VALVE, saltus.Surface(name="rebound", function="stretching")],
        "functions": {
            "high": HIGH,
            "low": LOW,
            "rate": {"x3_velocity": 1.0},
            "stretching": {"x1_velocity": 1.0, "x0_velocity": -1.0},
        },
        "switched": [
            saltus.SwitchedForce(
                name="damper",
                coordinate=3,
                surface="valve",
                function="rate",
                factor_on=-0.8,
                factor_off=-0.05,
            ),
            saltus.SwitchedForce(
                name="shock",
                coordinate={1: 1.0, 0: -1.0},
                surface="rebound",
                function="stretching",
                factor_on=-0.6,
                factor_off=-0.1,
            ),
        ],
    }
    return saltus.Structure(**chain(), forces={"drive": 0}, **(given | more))


@dataclass(frozen=True, kw_only=True)
class Masses(saltus.ContactModel):
    """The same four masses, with their equations written out."""

    high_at: float = 0.3
    hard: float = 0.8
    rebound: float = 0.6

    coordinates = ("x0", "x1", "x2", "x3")
    channels = ("drive",)
    surfaces = (VALVE, saltus.Surface(name="rebound", function="stretching"))

    def high(self, t, q, v, load):
        return q[3] - self.high_at

    def low(self, t, q, v, load):
        return -q[3] - 0.1

    def stretching(self, t, q, v, load):
        return v[1] - v[0]

    def force(self, t, q, v, load, sides):
        def springs(x):
            return (
                2 * x[0] - x[1],
                2 * x[1] - x[0] - x[2],
                2 * x[2] - x[1] - x[3],
                x[3] - x[2],
            )

        f = [-k - 0.02 * c for k, c in zip(springs(q), springs(v), strict=True)]
        f[0] = f[0] + load.drive(t)
        is_on = 0.5 * (1 + sides.valve)
        f[3] = f[3] - (self.hard * is_on + 0.05 * (1 - is_on)) * v[3]
        hard = 0.5 * (1 + sides.rebound)
        push = (self.rebound * hard + 0.1 * (1 - hard)) * (v[1] - v[0])
        f[0] = f[0] + push
        f[1] = f[1] - push
        return tuple(f)


WRITTEN = saltus.System(model=Masses(), load=LOAD)
START = {
    **{f"x{i}": x for i, x in enumerate(PLACE)},
    "velocity": tuple(SPEED),
    "relays": {"valve": False},
}


def own_start(model):
    return {**model.start(PLACE, SPEED), "relays": {"valve": False}}


def test_motions_and_derivatives_are_those_of_the_class():
    model = structure()
    # x0 is read by a function, and follows from the point and x1
    assert model.coordinates == ("x3", "shock", "x1", "mode_1")
    system = saltus.System(model=model, load=LOAD)
    moved = saltus.sensitivities(
        system,
        **own_start(model),
        periods=6,
        parameters=[
            "load.frequency",
            "model.functions.high.constant",
            "model.switched.damper.factor_on",
            "model.switched.shock.factor_on",
        ],
    )
    written = saltus.sensitivities(
        WRITTEN,
        **START,
        periods=6,
        parameters=["load.frequency", "model.high_at", "model.hard", "model.rebound"],
    )
    ours, theirs = moved.motion, written.motion
    assert len(ours.events) == len(theirs.events) > 20
    assert {event.contact for event in ours.events} == {"valve", "rebound"}
    assert ours.sides == theirs.sides
    times = [[event.time for event in motion.events] for motion in (ours, theirs)]
    assert np.abs(np.subtract(*times)).max() < 1e-11
    assert np.abs(model.displacements(ours.position) - theirs.position).max() < 1e-10
    assert np.abs(model.displacements(ours.velocity) - theirs.velocity).max() < 1e-10
    basis = np.kron(np.eye(2), model.displacements(np.eye(N)))
    signs = np.array([1.0, -1.0, -1.0, -1.0])
    assert np.abs(basis @ moved.parameters * signs - written.parameters).max() < 1e-9
    assert np.abs(basis @ moved.state @ np.linalg.inv(basis) - written.state).max() < 1e-9


def test_orbits_and_branches_are_those_of_the_class():
    model = structure()
    load = saltus.Load(frequency=0.6, drive=saltus.Harmonic(1.0))
    ours = saltus.find_orbit(saltus.System(model=model, load=load), **own_start(model))
    theirs = saltus.find_orbit(WRITTEN.with_(load=load), **START)
    assert "valve" in {event.contact for event in ours.motion().events}
    compared = [np.sort_complex(orbit.multipliers) for orbit in (ours, theirs)]
    assert np.abs(np.subtract(*compared)).max() < 1e-8
    balances = [saltus.energies(orbit.motion()) for orbit in (ours, theirs)]
    assert list(balances[0].part.values) == list(balances[1].part.values)
    assert np.abs(np.subtract(*(each.energy.values for each in balances))).max() < 1e-9
    assert abs(balances[0].attrs["defect"]) < 1e-12
    ends = [
        saltus.continue_orbit(orbit, "load.frequency", (0.59, 0.61)).ends
        for orbit in (ours, theirs)
    ]
    assert ends[0] == ends[1]


def by_scipy(on, functions, z, is_on, duration, field):
    """The end by DOP853 from switch to switch of one relay."""
    t, count = 0.0, 0
    while t < duration:
        event = functions[1 if is_on else 0]

        def crossing(t, z, event=event):
            return event(t, z)

        crossing.terminal = True
        crossing.direction = 1.0
        found = solve_ivp(
            field,
            (t, duration),
            z,
            "DOP853",
            events=[crossing],
            rtol=1e-13,
            atol=1e-13,
        )
        t, z = found.t[-1], found.y[:, -1]
        if found.status == 1:
            is_on = not is_on
            on[0] = is_on
            count += 1
    return z, count


def test_an_on_off_damper_is_that_of_dop853_with_events():
    """Modes in loops: only a relay, on a speed, with a mass matrix that is full."""
    given = chain(6)
    given["mass"] = given["mass"] + 0.2 * given["stiffness"]
    relay = saltus.Relay(name="skyhook", on="fast", off="slow")
    model = saltus.Structure(
        **given,
        forces={"drive": 0},
        points={"seat": {5: 1.0, 2: 0.5}},
        surfaces=[relay],
        functions={
            "fast": {"seat_velocity": 1.0, "constant": -0.12},
            "slow": {"seat_velocity": -1.0, "drive": 0.1, "constant": 0.02},
            "rate": {"seat_velocity": 1.0, "x4": 0.3},
        },
        switched=[
            saltus.SwitchedForce(
                name="damper", coordinate="seat", surface="skyhook", function="rate", factor_on=-0.9
            ),
            saltus.SwitchedForce(
                name="bias", coordinate=0, surface="skyhook", factor_on=0.02, factor_off=-0.02
            ),
        ],
    )
    system = saltus.System(model=model, load=LOAD)
    place, speed = np.linspace(0.0, 0.4, 6), np.linspace(0.1, -0.2, 6)
    duration = 60.0
    moved = saltus.simulate(
        system, **model.start(place, speed), relays={"skyhook": False}, duration=duration
    )
    seat = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 1.0])
    on = [False]

    def drive(t):
        return 0.3 * np.sin(0.6 * t)

    def field(t, z):
        u, v = z[:6], z[6:]
        pushed = -given["stiffness"] @ u - given["damping"] @ v
        pushed[0] += drive(t) + (0.02 if on[0] else -0.02)
        if on[0]:
            pushed = pushed - 0.9 * (seat @ v + 0.3 * u[4]) * seat
        return np.concatenate([v, np.linalg.solve(given["mass"], pushed)])

    functions = (
        lambda t, z: seat @ z[6:] - 0.12,
        lambda t, z: -seat @ z[6:] + 0.1 * drive(t) + 0.02,
    )
    end, count = by_scipy(on, functions, np.concatenate([place, speed]), False, duration, field)
    assert len(moved.events) == count > 8
    assert np.abs(model.displacements(moved.position) - end[:6]).max() < 1e-10
    assert np.abs(model.displacements(moved.velocity) - end[6:]).max() < 1e-10


def test_a_skyhook_is_a_product_of_speeds():
    """A seat x on a frame y over a road: the damper is hard while x' (x' - y') > 0, as one function
    or as that of the class with two."""
    given = {
        "mass": [[1.0, 0.0], [0.0, 0.25]],
        "stiffness": [[1.0, -1.0], [-1.0, 7.0]],
        "damping": [[0.1, -0.1], [-0.1, 0.1]],
    }
    slip = {"x_velocity": 1.0, "y_velocity": -1.0}
    model = saltus.Structure(
        **given,
        names=("x", "y"),
        forces={"force": {"y": 6.0}},
        surfaces=[saltus.Surface(name="skyhook", function="both")],
        functions={"both": [{"x_velocity": 1.0}, slip], "slip": slip},
        switched=[
            saltus.SwitchedForce(
                name="damper",
                coordinate={"x": 1.0, "y": -1.0},
                surface="skyhook",
                function="slip",
                factor_on=-0.8,
            )
        ],
    )
    load = saltus.Load(frequency=0.9, force=saltus.Harmonic(0.4))
    system = saltus.System(model=model, load=load)
    assert system.parameters["model.functions.both.1.y_velocity"] == -1.0
    assert saltus.System.from_toml(system.to_toml()) == system
    start = model.start([0.1, -0.2], [0.3, -0.1])
    motion = saltus.simulate(system, **start, duration=30.0)

    def field(t, z, is_hard):
        push = (0.9 if is_hard else 0.1) * (z[2] - z[3])
        stretch = z[0] - z[1]
        road = 0.4 * np.sin(0.9 * t)
        return [z[2], z[3], -stretch - push, 4.0 * (stretch + push - 6.0 * (z[1] - road))]

    events = [lambda t, z, is_hard: z[2], lambda t, z, is_hard: z[2] - z[3]]
    for event in events:
        event.terminal = True
    t, z, count = 0.0, np.array([0.1, -0.2, 0.3, -0.1]), 0
    signs = np.sign([z[2], z[2] - z[3]])
    while t < 30.0:
        found = solve_ivp(
            field,
            (t, 30.0),
            z,
            "DOP853",
            events=events,
            args=(signs.prod() > 0,),
            rtol=1e-13,
            atol=1e-13,
        )
        t, z = found.t[-1], found.y[:, -1]
        for k in range(2):
            if found.status == 1 and len(found.t_events[k]):
                signs[k] = -signs[k]
                count += 1
                # a step beyond the zero, so that it is not found again
                z = solve_ivp(
                    field, (t, t + 1e-9), z, "DOP853", args=(signs.prod() > 0,), rtol=1e-13
                ).y[:, -1]
                t += 1e-9
    assert len(motion.events) == count >= 20
    assert np.abs(model.displacements(motion.position) - z[:2]).max() < 1e-9
    assert np.abs(model.displacements(motion.velocity) - z[2:]).max() < 1e-9


def test_a_motion_slides_along_a_function_as_dry_friction_does():
    """A force that is -0.2 or 0.2 as the speed of the tip is above or below 0 is dry friction."""
    load = saltus.Load(frequency=0.6, drive=saltus.Harmonic(0.35))
    switched = saltus.Structure(
        **chain(3),
        forces={"drive": 0},
        surfaces=[saltus.Surface(name="moves", function="rate")],
        functions={"rate": {"x2_velocity": 1.0}},
        switched=[
            saltus.SwitchedForce(
                name="rub", coordinate=2, surface="moves", factor_on=-0.2, factor_off=0.2
            )
        ],
    )
    rubbing = saltus.Structure(
        **chain(3),
        forces={"drive": 0},
        friction=[saltus.Friction(name="rub", coordinate=2, kinetic=0.2)],
    )
    found = []
    for model, path in (
        (switched, "model.switched.rub.factor_on"),
        (rubbing, "model.friction.rub.kinetic"),
    ):
        derivatives = saltus.sensitivities(
            saltus.System(model=model, load=load),
            **model.start([0.0, 0.1, 0.2], [0.0, 0.3, 0.4]),
            duration=37.0,
            parameters=["load.drive.amplitude", path],
        )
        found.append((model, derivatives))
    kinds = [[str(event.kind) for event in each.motion.events] for _, each in found]
    assert kinds[0].count("stick") == kinds[1].count("stick") > 2
    for what in ("position", "velocity"):
        ends = [m.displacements(getattr(d.motion, what)) for m, d in found]
        assert np.abs(np.subtract(*ends)).max() < 1e-10
    changes = [m.displacements(d.parameters[:3, 0]) for m, d in found]
    assert np.abs(np.subtract(*changes)).max() < 1e-9


@pytest.mark.parametrize(
    "path", ["model.functions.high.constant", "model.switched.shock.factor_on"]
)
def test_numbers_of_functions_and_forces_have_paths(path):
    model = structure()
    system = saltus.System(model=model, load=LOAD)
    start = own_start(model)
    derivative = saltus.sensitivities(system, parameters=[path], periods=3, **start)
    value = system.get(path)
    step = 1e-6
    apart = [
        saltus.simulate(system.with_({path: value + h}), periods=3, **start) for h in (step, -step)
    ]
    for number, what in enumerate(("position", "velocity")):
        one, other = (np.asarray(getattr(motion, what)) for motion in apart)
        expected = (one - other) / (2 * step)
        found = derivative.parameters[number * N : (number + 1) * N, 0]
        assert np.abs(found - expected).max() < 1e-7


@pytest.mark.parametrize("text", ["json", "toml"])
def test_a_structure_with_switched_forces_is_read_back_as_it_was_written(text):
    system = saltus.System(model=structure(), load=LOAD)
    written = getattr(system, f"to_{text}")()
    assert getattr(saltus.System, f"from_{text}")(written) == system
    assert pickle.loads(pickle.dumps(system)) == system
    other = system.with_({"model.functions.high.x3": 0.9})
    assert other != system
    assert other.with_({"model.functions.high.x3": 1.0}) == system


def test_names_of_terms_tell_structures_of_equal_numbers_apart():
    """The second one has the code of the first if its names are not among what tells them apart."""
    ends = []
    for term in ("x1_velocity", "x0_velocity"):
        model = structure(
            functions={
                "high": HIGH,
                "low": LOW,
                "rate": {"x3_velocity": 1.0},
                "stretching": {"x2_velocity": 1.0, term: -1.0},
            }
        )
        motion = saltus.simulate(
            saltus.System(model=model, load=LOAD), periods=2, **own_start(model)
        )
        ends.append(model.displacements(motion.position))
    assert structure() == structure()
    assert np.abs(np.subtract(*ends)).max() > 1e-4


def test_a_switch_without_effect_changes_nothing():
    model = saltus.Structure(**chain(), forces={"drive": 0}, contacts=[STOP])
    with_relay = structure(
        contacts=[STOP],
        surfaces=[VALVE],
        functions={"high": HIGH, "low": LOW, "rate": {"x3_velocity": 1.0}},
        switched=[
            saltus.SwitchedForce(
                name="damper", coordinate=3, surface="valve", function="rate", factor_on=0.0
            )
        ],
    )
    law = saltus.NewtonImpact(0.6)
    plain = saltus.simulate(
        saltus.System(model=model, load=LOAD, impact=law), **model.start(PLACE, SPEED), periods=8
    )
    relayed = saltus.simulate(
        saltus.System(model=with_relay, load=LOAD, impact=law), **own_start(with_relay), periods=8
    )
    assert len(relayed.impacts) == len(plain.impacts) > 2
    assert len(relayed.events) > len(plain.events)
    ends = [m.displacements(x.position) for m, x in ((model, plain), (with_relay, relayed))]
    assert np.abs(np.subtract(*ends)).max() < 1e-11


STOP = saltus.Contact(name="stop", coordinate=2, position=0.25, sign=-1)


def test_a_reduced_structure_of_all_modes_is_the_whole_one():
    parts = {
        "surfaces": [saltus.Relay(name="valve", on="high", off="low")],
        "functions": {
            "high": {"tip": 1.0, "constant": -0.3},
            "low": {"tip": -1.0, "constant": -0.1},
            "rate": {"x3_velocity": 1.0, "x2_velocity": -1.0},
        },
        "switched": [
            saltus.SwitchedForce(
                name="damper", coordinate="tip", surface="valve", function="rate", factor_on=-0.8
            )
        ],
        "points": {"tip": {3: 1.0, 2: -1.0}},
        "forces": {"drive": 0},
    }
    whole = saltus.Structure(**chain(), **parts)
    # x2 follows from the point and x3, which are kept
    reduced = saltus.Structure.reduced(**chain(), modes=2, **parts)
    assert "x2" in reduced.points
    ends = []
    for model in (whole, reduced):
        motion = saltus.simulate(
            saltus.System(model=model, load=saltus.Load(frequency=0.6, drive=saltus.Harmonic(1.0))),
            **own_start(model),
            periods=4,
        )
        assert len(motion.events) > 1
        ends.append(model.displacements(motion.position))
    assert np.abs(np.subtract(*ends)).max() < 1e-9


def force_of(**more):
    given = {"name": "damper", "coordinate": 3, "surface": "valve", "function": "rate"}
    return saltus.SwitchedForce(**(given | more))


FUNCTIONS = {"high": HIGH, "low": LOW, "rate": {"x3_velocity": 1.0}}
GOOD = {"surfaces": [VALVE], "functions": FUNCTIONS, "switched": [force_of()]}
REFUSED = {
    "functions must be a dict of sums by their names": {"functions": 3},
    "functions: 'force' is not a name for a function": {"functions": {"force": HIGH}},
    "functions: 'own_class' is not a name for a function": {"functions": {"own_class": HIGH}},
    "functions.rate must be a sum such as": {"functions": {**FUNCTIONS, "rate": "x3"}},
    "functions.rate: 'x9' is no displacement, no rate such as 'x0_velocity', no channel": {
        "functions": {**FUNCTIONS, "rate": {"x9": 1.0}}
    },
    "functions.rate: there is no row 9; the rows are 0 to 3": {
        "functions": {**FUNCTIONS, "rate": {9: 1.0}}
    },
    "functions.rate has the term 'x3' twice": {
        "functions": {**FUNCTIONS, "rate": {"x3": 1.0, 3: 1.0}}
    },
    "functions.rate.x3 must be finite": {"functions": {**FUNCTIONS, "rate": {"x3": np.nan}}},
    "functions.rate: 'x1' is a displacement and a channel; give one another name": {
        "functions": {**FUNCTIONS, "rate": {"x1": 1.0}},
        "forces": {"x1": 0},
    },
    "functions.more is named by no part": {"functions": {**FUNCTIONS, "more": HIGH}},
    "surfaces.valve names 'low', which is none of the functions (high, rate)": {
        "functions": {name: FUNCTIONS[name] for name in ("high", "rate")}
    },
    "switched.damper names 'speed', which is none of the functions (high, low, rate)": {
        "switched": [force_of(function="speed")]
    },
    "switched.damper is switched by 'gate', which is none of the surfaces (valve)": {
        "switched": [force_of(surface="gate")]
    },
    "switched has 'damper' twice": {"switched": [force_of(), force_of()]},
    "switched.damper: no row is called 'tip'": {"switched": [force_of(coordinate="tip")]},
    "switched: a SwitchedForce needs a name and a coordinate and a surface": {
        "switched": [{"name": "damper", "coordinate": 3}]
    },
    "switched must be of class SwitchedForce": {"switched": [VALVE]},
    "surfaces: a Relay needs a name and a on and a off": {
        "surfaces": [{"name": "v", "on": "high"}]
    },
    "surfaces.valve: a Structure does not follow an after_event": {
        "surfaces": [saltus.Relay(name="valve", on="high", off="low", after_event="kicked")]
    },
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_what_is_no_switched_structure_is_refused(sentence):
    with pytest.raises(saltus.ParameterError) as error:
        saltus.Structure(**{**chain(), "forces": {"drive": 0}, **GOOD, **REFUSED[sentence]})
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"factor_on": "much"}, "factor_on of the switched force 'damper' must be a finite number"),
        ({"factor_off": np.inf}, "factor_off of the switched force 'damper' must be"),
        ({"surface": 3}, "surface of a SwitchedForce must be a text, got 3"),
        ({"name": ""}, "name of a SwitchedForce must be a text, got ''"),
        ({"function": 1.0}, "function of a SwitchedForce must be a text, got 1.0"),
    ],
)
def test_what_is_no_switched_force_is_refused(given, sentence):
    with pytest.raises(saltus.ParameterError) as error:
        force_of(**given)
    assert sentence in str(error.value)
