"""Verdicts on motions with several contacts: rest, orbits, chaos; their exponents."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import (
    CellChain,
    NewtonImpact,
    TwoLayer,
    TwoStops,
    classify,
    lyapunov_many,
    lyapunov_spectrum,
)
from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, System


def layers(H, m=0.1, e=(0.0, 0.0), transfer=0.0):
    return System(
        model=TwoLayer(beta0=math.radians(80), damping=0.1, mass_ratio=m),
        load=Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=H)),
        impact=NewtonImpact(e=e, transfer=transfer),
    )


CHAOTIC = System(
    model=TwoStops(stiffness=0.0),
    load=Load(frequency=1.0, force=Harmonic(amplitude=2.0, phase=math.pi / 2)),
    impact=NewtonImpact(e=0.9),
)


def test_a_settled_motion_is_on_the_orbit_that_find_orbit_finds():
    for system in (layers(0.3), layers(0.3, transfer=0.6), layers(0.6, m=0.0)):
        verdict = classify(system, theta_1=0.1, theta_2=0.0, periods=300, transient=100)
        orbit = saltus.find_orbit(system, theta_1=0.1, theta_2=0.0)
        assert (str(verdict.kind), verdict.period) == ("periodic", orbit.period)
        assert verdict.orbit.amplitude == pytest.approx(orbit.amplitude, abs=1e-10)
        assert verdict.evidence["defect"] < 1e-10


def test_small_loads_leave_both_layers_closed():
    verdict = classify(
        layers(0.01), theta_1=0.01, theta_2=-0.02, velocity=(0.0, 0.1), periods=300, transient=100
    )
    assert str(verdict.kind) == "rest"
    assert (verdict.state["theta_1"], verdict.state["theta_2"]) == (0.0, 0.0)


def test_the_exponents_of_an_orbit_are_those_of_its_multipliers_and_closed_contacts_take_directions_away():
    orbit = saltus.find_orbit(layers(0.2, m=0.0, transfer=1.0), theta_1=0.1, theta_2=0.0)
    (first, second), velocity = orbit.state
    found = lyapunov_spectrum(
        orbit.system, theta_1=first, theta_2=second, velocity=velocity, periods=128, transient=0
    )
    expected = np.log(np.abs(orbit.multipliers[:2])) / orbit.duration
    np.testing.assert_allclose(found.values[:2], expected, rtol=0, atol=1e-4)
    assert (found.values[2:] == -np.inf).all()
    assert found.agrees


@pytest.mark.thorough
def test_many_exponents_between_two_walls_are_those_of_one():
    many = lyapunov_many(CHAOTIC, x=[0.1, 0.3], velocity=0.5, periods=1500, transient=50)
    one = lyapunov_spectrum(
        CHAOTIC, x=0.1, velocity=0.5, periods=1500, transient=50, two_trajectories=False
    )
    for row in range(2):  # chaotic motions from other roundings: averages agree within their errors
        apart, error = (
            np.abs(many["exponent"].values[row] - one.values),
            many["error"].values[row] + one.errors,
        )
        assert (apart < error).all()
    assert many["positive"].all()


@dataclass(frozen=True, kw_only=True)
class Bouncing(saltus.ContactModel):
    """A ball over a shaking table."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    contacts = (saltus.Contact(name="table", coordinate={"x": 1.0, "ground": -1.0}),)

    def force(self, t, x, velocity, load):
        return -1.0


def test_exponents_of_many_bounces_on_a_shaking_table_have_the_sum_of_their_loss():
    """An impact a period shrinks areas by e^2; a bounce meets a sin(phase) with a cos(phase) = pi
    (1 - e) / (1 + e).
    """
    system = System(
        model=Bouncing(), load=Load(frequency=1.0, ground=Harmonic(1.0)), impact=NewtonImpact(e=0.6)
    )
    amplitudes = np.array([1.2, 1.25, 1.3])
    many = lyapunov_many(
        system, {"load.ground.amplitude": amplitudes}, x=1.0, velocity=3.0, periods=64
    )
    assert (many.period == 1).all()
    np.testing.assert_allclose(
        many.exponent.sum("index"), 2 * math.log(0.6) / (2 * math.pi), rtol=0, atol=1e-9
    )
    # from the last impact to the end of the period
    thrown = 2 * math.pi - np.arccos(math.pi / 4 / amplitudes)
    height = np.sqrt(amplitudes**2 - (math.pi / 4) ** 2)
    np.testing.assert_allclose(
        many.end_x, height + math.pi * thrown - thrown**2 / 2, rtol=0, atol=1e-8
    )
    np.testing.assert_allclose(many.end_velocity, math.pi - thrown, rtol=0, atol=1e-8)


def test_chaos_between_two_walls_has_the_exponent_of_two_neighbouring_motions():
    verdict = classify(CHAOTIC, x=0.1, velocity=0.5, periods=600, transient=100)
    assert str(verdict.kind) == "chaotic"
    assert verdict.evidence["companions_settled"] == 0
    state, growth, apart = {"x": 0.1, "velocity": 0.5}, [], 1e-8
    direction = np.array([apart, 0.0])
    for _ in range(300):
        one = saltus.simulate(CHAOTIC, **state, periods=1, dense=False)
        x = float(np.clip(state["x"] + direction[0], -1.0, 1.0))
        other = saltus.simulate(
            CHAOTIC, x=x, velocity=state["velocity"] + direction[1], periods=1, dense=False
        )
        change = np.array([other.x - one.x, other.velocity - one.velocity])
        growth.append(math.log(np.linalg.norm(change) / apart))
        direction = change * (apart / np.linalg.norm(change))
        state = {"x": one.x, "velocity": one.velocity}
    mean, spread = np.mean(growth[20:]), np.std(growth[20:]) / math.sqrt(len(growth) - 20)
    exponent, error = (
        verdict.evidence["largest_exponent"],
        verdict.evidence["largest_exponent_error"],
    )
    assert abs(mean / (2 * math.pi) - exponent) < 3 * math.hypot(spread / (2 * math.pi), error / 2)


@pytest.mark.thorough  # seconds of compiling each
@pytest.mark.parametrize("cells", [2, 3, 4])
@pytest.mark.parametrize("coupling", [0.0, 0.3])
def test_a_chain_of_equal_cells_is_classified_and_ends_on_the_orbit_of_one_of_them(cells, coupling):
    """Cells that move alike do not stretch the springs between them, and their events happen at one
    instant: without a spring each cell is a `TwoLayer`, and with one the motion in which all are
    alike is the same and attracts here."""
    load = Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=0.4))
    numbers = {"beta0": math.radians(80), "damping": 0.1, "mass_ratio": 0.2}
    chain = System(
        model=CellChain(cells=cells, coupling=coupling, **numbers), load=load, impact=NewtonImpact()
    )
    start = {
        f"{layer}_{cell}": 0.1 * cell * (layer == "lower")
        for cell in range(1, cells + 1)
        for layer in ("lower", "upper")
    }
    verdict = classify(chain, **start, velocity=(0.0,) * 2 * cells, periods=120, transient=60)
    alone = saltus.find_orbit(
        System(model=TwoLayer(**numbers), load=load, impact=NewtonImpact()),
        theta_1=0.1,
        theta_2=0.0,
    )
    assert (str(verdict.kind), verdict.period) == ("periodic", alone.period)
    # `amplitude` is of the displacement that the load drives: in the chain the upper one alone
    for layer, name in (("lower", "theta_1"), ("upper", "theta_2")):
        for side in ("largest", "smallest"):
            expected = alone.quantity(f"{side}_{name}")
            for cell in range(1, cells + 1):
                found = verdict.orbit.quantity(f"{side}_{layer}_{cell}")
                assert found == pytest.approx(expected, abs=1e-9)
    assert verdict.orbit.signature.impact_count == cells * alone.signature.impact_count
    if coupling == 0.0:  # every cell adds the multipliers of its own
        moduli = np.sort(np.abs(verdict.orbit.multipliers))[-cells:]
        np.testing.assert_allclose(moduli, abs(alone.multipliers[0]), rtol=0, atol=1e-6)


def test_an_orbit_whose_impacts_die_away_is_an_orbit():
    verdict = classify(
        layers(0.3, e=(0.4, 0.4)), theta_1=0.1, theta_2=0.0, periods=300, transient=100
    )
    assert (str(verdict.kind), verdict.period) == ("periodic", 1)
    assert verdict.orbit.defect < 1e-11


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: classify(layers(0.3), theta=0.1), "theta must have 2 values, got 0.1"),
        (
            lambda: classify(layers(0.3), theta_1=0.1, theta_2=0.0, velocity=(0.1,)),
            "velocity must have 2 value(s)",
        ),
        (
            lambda: lyapunov_many(layers(0.3), theta_1=[0.1], theta_2=0.0),
            "lyapunov_many works on models with one coordinate",
        ),
    ],
)
def test_what_has_no_meaning_is_refused_by_name(ask, words):
    with pytest.raises(ParameterError) as refused:
        ask()
    assert words in str(refused.value)
