"""Models from expressions of SymPy have relays, surfaces that are functions, resets, frictions,
distances and coordinates of first order, and move as the same models written as classes.
"""

import pickle
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus

sympy = pytest.importorskip("sympy")
x, v, y, w, k, c, s, r, F = sympy.symbols("x v y w k c s r F")
LOAD = saltus.Load(frequency=0.9, force=saltus.Harmonic(0.4))


def thermostat():
    """T' = -(T - 10) / 10, and 3 more while the heater is on: below 19 on, above 21 off."""
    T, low, high = sympy.symbols("T low high")
    return saltus.from_sympy(
        coordinates=[T],
        first_order=[T],
        force=[-(T - 10) / 10 + sympy.Rational(3, 2) * (1 + s)],
        parameters={low: 19.0, high: 21.0},
        surfaces=[saltus.Relay(name="heater", on="too_cold", off="too_warm")],
        sides={"heater": s},
        functions={"too_cold": low - T, "too_warm": T - high},
        name="ThermostatOfSymbols",
    )


def test_a_relay_switches_at_the_instants_of_its_closed_form():
    """From 20 with the heater on, T = 40 - 20 exp(-t / 10) until 21; then 10 + 11 exp(-t / 10) until
    19; then 40 - 21 exp(-t / 10)."""
    system = saltus.System(model=thermostat())
    motion = saltus.simulate(system, T=20.0, duration=6.0, relays={"heater": True})
    first = 10 * np.log(20 / 19)
    down = 10 * np.log(11 / 9)
    up = 10 * np.log(21 / 19)
    expected = [first, first + down, first + down + up, first + 2 * down + up]
    assert [event.time for event in motion.events] == pytest.approx(expected, abs=1e-11)
    # its numbers are those of the class, and it goes to files and to other processes
    assert system.parameters["model.high"] == 21.0
    assert saltus.System.from_json(system.to_json()) == system
    assert pickle.loads(pickle.dumps(system)) == system
    derivative = saltus.sensitivities(
        system, parameters=["model.low"], T=20.0, duration=6.0, relays={"heater": True}
    )
    # at the end T = 40 - (40 - low) exp(-(6 - t) / 10), and low moves the last event t
    shift = 2 * (-10 / 9) + (-10 / 21)
    later = 6.0 - expected[-1]
    expected_change = np.exp(-later / 10) * (1.0 - (40.0 - 19.0) / 10 * shift)
    assert derivative.parameters[0, 0] == pytest.approx(expected_change, abs=1e-9)


def test_a_neuron_fires_at_the_instants_of_its_closed_form():
    u = sympy.Symbol("u")
    model = saltus.from_sympy(
        coordinates=[u],
        first_order=[u],
        force=[(sympy.Rational(13, 10) - u) / 2],
        surfaces=[
            saltus.Surface(name="threshold", coordinate="u", position=1.0, after_event="fired")
        ],
        resets={"fired": ([0], [0])},
        name="NeuronOfSymbols",
    )
    motion = saltus.simulate(saltus.System(model=model), u=0.0, duration=10.0)
    expected = 2 * np.log(1.3 / 0.3) * np.arange(1, 4)
    assert [event.time for event in motion.events] == pytest.approx(expected, abs=1e-11)


def skyhook():
    """A sprung mass x on a wheel y over a road: its damper is hard while x' (x' - y') > 0."""
    soft, hard = sympy.symbols("soft hard")
    push = (
        soft + (hard - soft) * (1 + s) / 2 * (1 + r) / 2 + (hard - soft) * (1 - s) / 2 * (1 - r) / 2
    ) * (v - w)
    return saltus.from_sympy(
        coordinates=[x, y],
        velocities=[v, w],
        mass=[[1, 0], [0, sympy.Rational(1, 4)]],
        force=[-(x - y) - push, (x - y) + push - 6 * (y - F)],
        parameters={soft: 0.1, hard: 0.9},
        channels={"force": F},
        surfaces=[
            saltus.Surface(name="rising", function="rate"),
            saltus.Surface(name="stretching", function="slip"),
        ],
        sides={"rising": s, "stretching": r},
        functions={"rate": v, "slip": v - w},
        name="SkyhookOfSymbols",
    )


@dataclass(frozen=True, kw_only=True)
class SkyhookByHand(saltus.ContactModel):
    soft: float = 0.1
    hard: float = 0.9
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar = (
        saltus.Surface(name="rising", function="rate"),
        saltus.Surface(name="stretching", function="slip"),
    )

    def rate(self, t, q, velocity, load):
        return velocity[0]

    def slip(self, t, q, velocity, load):
        return velocity[0] - velocity[1]

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, 0.25]]

    def force(self, t, q, velocity, load, sides):
        hard = 0.5 * (1.0 + sides.rising * sides.stretching)
        push = (self.soft + (self.hard - self.soft) * hard) * (velocity[0] - velocity[1])
        stretch = q[0] - q[1]
        return -stretch - push, stretch + push - 6.0 * (q[1] - load.force(t))


def skyhook_by_scipy(duration):
    """The end by DOP853 from switch to switch."""

    def field(t, z, hard):
        push = (0.9 if hard else 0.1) * (z[2] - z[3])
        load = 0.4 * np.sin(0.9 * t)
        stretch = z[0] - z[1]
        return [z[2], z[3], -stretch - push, 4.0 * (stretch + push - 6.0 * (z[1] - load))]

    events = [lambda t, z, hard: z[2], lambda t, z, hard: z[2] - z[3]]
    for event in events:
        event.terminal = True
    t, z, count = 0.0, np.array([0.1, -0.2, 0.3, -0.1]), 0
    signs = np.sign([z[2], z[2] - z[3]])
    while t < duration:
        found = solve_ivp(
            field,
            (t, duration),
            z,
            "DOP853",
            events=events,
            args=(signs.prod() > 0,),
            rtol=1e-13,
            atol=1e-13,
        )
        t, z = found.t[-1], found.y[:, -1]
        for i, times in enumerate(found.t_events):
            if len(times):
                signs[i] = -signs[i]
                count += 1
                # a step beyond the zero, so that it is not found again
                z = solve_ivp(
                    field, (t, t + 1e-9), z, "DOP853", args=(signs.prod() > 0,), rtol=1e-13
                ).y[:, -1]
                t += 1e-9
    return z, count


def test_a_semi_active_damper_moves_as_by_scipy_and_as_the_class():
    at = {"x": 0.1, "y": -0.2, "velocity": [0.3, -0.1], "duration": 30.0}
    found, by_hand = (
        saltus.simulate(saltus.System(model=model, load=LOAD), **at)
        for model in (skyhook(), SkyhookByHand())
    )
    ends = [np.concatenate(motion.at(30.0)).ravel() for motion in (found, by_hand)]
    expected, count = skyhook_by_scipy(30.0)
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)
    assert ends[0] == pytest.approx(expected, abs=1e-9)
    assert len(found.events) == len(by_hand.events) == count >= 20


def test_frictions_normal_forces_and_distances_are_those_of_classes():
    mu, g = sympy.symbols("mu g")

    @dataclass(frozen=True, kw_only=True)
    class Sliding(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ("force",)
        frictions: ClassVar = (
            saltus.Friction(name="floor", coordinate="x", kinetic=0.2, static=0.3),
        )

        def normal_forces(self, t, q, velocity, load):
            return (2.0 + 0.5 * q * q,)

        def force(self, t, q, velocity, load):
            return load.force(t) * 3.0 - q

    sliding = saltus.from_sympy(
        coordinates=[x],
        velocities=[v],
        force=[3 * F - x],
        parameters={mu: 0.2, g: 2.0},
        channels={"force": F},
        frictions=[saltus.Friction(name="floor", coordinate="x", kinetic=mu, static=mu * 3 / 2)],
        normal_forces=[g + x**2 / 2],
        name="SlidingOfSymbols",
    )
    at = {"x": 0.4, "velocity": 0.2, "duration": 25.0}
    one, other = (
        saltus.simulate(saltus.System(model=model, load=LOAD), **at)
        for model in (sliding, Sliding())
    )
    assert [str(event.kind) for event in one.events] == [str(event.kind) for event in other.events]
    assert "stick" in {str(event.kind) for event in one.events}
    assert np.ravel(one.at(25.0)) == pytest.approx(np.ravel(other.at(25.0)), abs=1e-10)

    # a ball that falls on the curve y = x^2 / 4 from x = 1 where it is 0.25 high: sqrt(2 h) later
    ball = saltus.from_sympy(
        coordinates=[x, y],
        velocities=[v, w],
        force=[0, -1],
        parameters={k: 0.25},
        contacts=[saltus.Contact(name="bowl", distance="height")],
        functions={"height": y - k * x**2},
        name="BallInABowlOfSymbols",
    )
    system = saltus.System(model=ball, impact=saltus.NewtonImpact(e=0.5))
    motion = saltus.simulate(system, x=1.0, y=0.75, duration=1.5)
    assert motion.impacts.time[0] == pytest.approx(1.0, abs=1e-11)


GOOD = {
    "coordinates": [x],
    "velocities": [v],
    "force": [-x],
    "parameters": {k: 1.0},
    "name": "RefusedParts",
}
VALVE = saltus.Relay(name="valve", on="high", off="low")
REFUSED = {
    "the relay 'valve' names 'low', which is none of the functions (high)": {
        "surfaces": [VALVE],
        "functions": {"high": x - 1},
    },
    "functions.spare is named by no part": {
        "surfaces": [VALVE],
        "functions": {"high": x - 1, "low": -x, "spare": x},
    },
    "has the after_event 'kicked', which is none of the resets (there are none)": {
        "surfaces": [saltus.Surface(name="gate", coordinate="x", after_event="kicked")],
    },
    "resets.kicked must have the coordinates and the velocities after the event": {
        "surfaces": [saltus.Surface(name="gate", coordinate="x", after_event="kicked")],
        "resets": {"kicked": ([x, x], [v])},
    },
    "resets.kicked is the after_event of no surface": {"resets": {"kicked": ([x], [v])}},
    "sides has 'gate', which is none of the surfaces (there are none)": {"sides": {"gate": s}},
    "functions: 'mass_matrix' is not a name for a method": {
        "surfaces": [saltus.Surface(name="gate", function="mass_matrix")],
        "functions": {"mass_matrix": x},
    },
    "functions.high has 'v', which is none of": {
        "contacts": [saltus.Contact(name="wall", distance="high")],
        "functions": {"high": v},
    },
    "functions.high is named by parts that take it of other arguments": {
        "contacts": [saltus.Contact(name="wall", distance="high")],
        "surfaces": [saltus.Surface(name="gate", function="high")],
        "functions": {"high": x},
    },
    "surfaces must be a list of Surface or Relay": {
        "surfaces": [saltus.Contact(name="a", coordinate="x")]
    },
    "functions must be a dictionary such as": {"functions": [x]},
    "surfaces.gate.position has 'x', which is none of": {
        "surfaces": [saltus.Surface(name="gate", coordinate="x", position=x)],
    },
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_parts_that_name_nothing_are_refused(sentence):
    with pytest.raises(saltus.ParameterError) as error:
        saltus.from_sympy(**{**GOOD, **REFUSED[sentence]})
    assert sentence in str(error.value)
