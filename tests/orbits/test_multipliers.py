"""The number of an orbit's multipliers, their product by Liouville's formula, and their order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harvesters import Piezo, SwitchedPiezo, shaken

import saltus
from saltus.orbits.orbit import by_falling_modulus

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 1.0]])


def stops(amplitude: float = 0.8, e: float = 0.7, **numbers: float) -> saltus.System:
    return saltus.System(
        model=saltus.TwoStops(**{"stiffness": 0.2, "damping": 0.1} | numbers),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude)),
        impact=saltus.NewtonImpact(e=e),
    )


def pair() -> saltus.System:
    return saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.3, clearance=1.0, damping=0.02),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.2)),
        impact=saltus.NewtonImpact(e=0.6),
    )


def masses(e: float = 0.6) -> saltus.System:
    model = saltus.Structure(
        mass=np.eye(2),
        damping=0.05 * STIFFNESS,
        stiffness=STIFFNESS,
        contacts=[saltus.Contact(name="stop", coordinate=1, position=0.02, sign=-1)],
        forces={"f": 1},
    )
    load = saltus.Load(frequency=0.9, f=saltus.Harmonic(0.02))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=e))


# (system, start, trace of M^-1 C and of the rates of first order, factor of each impact)
CASES = {
    "one coordinate": (stops(), {"x": 0.0}, 0.1, 0.49),
    # M = [[1 + mu, mu], [mu, mu]] and C = diag(c, 0): the trace is c
    "impact pair": (pair(), {"z": 0.0, "x": 0.0, "velocity": (0.0, 0.1)}, 0.02, 0.36),
    "first order": (shaken(Piezo()), {"x": 0.0, "voltage": 0.0}, 0.05 + 1 / 1.4, 0.49),
    "first order jumps": (
        shaken(SwitchedPiezo()),
        {"x": 0.0, "voltage": 0.0},
        0.05 + 1 / 1.4,
        -0.8 * 0.49,
    ),
    "structure": (masses(), {"mode_1": 0.0, "x1": 0.0}, 0.15, 0.36),
}


@pytest.mark.parametrize("name", CASES)
def test_there_are_two_for_each_coordinate_and_their_product_is_liouville_s(name: str) -> None:
    """exp(-T tr(M^-1 C)) with e^2 for each impact, and with what an impact keeps of a voltage: the
    determinant of the map of an impact."""
    system, start, trace, factor = CASES[name]
    orbit = saltus.find_orbit(system, **start)
    assert orbit.impact_count > 0
    model = system.model
    assert len(orbit.multipliers) == 2 * len(model.coordinates) - len(model.first_order)
    expected = math.exp(-trace * orbit.duration) * factor**orbit.impact_count
    product = complex(np.prod(orbit.multipliers))
    assert product == pytest.approx(expected, rel=1e-9)


def test_a_stop_that_takes_all_speed_makes_a_multiplier_0() -> None:
    """As the state just after the impact is at the stop and at rest there; the others are those of
    the map of the motion."""
    orbit = saltus.find_orbit(masses(e=0.0), mode_1=0.0, x1=0.0)
    assert orbit.impact_count > 0
    assert len(orbit.multipliers) == 4
    flow = saltus.sensitivities(orbit.system, **orbit.start(), periods=orbit.period, tol=1e-14)
    expected = by_falling_modulus(np.linalg.eigvals(flow.state).astype(complex))
    np.testing.assert_allclose(orbit.multipliers, expected, rtol=0, atol=1e-7)
    assert abs(orbit.multipliers[3]) < 1e-9 < abs(orbit.multipliers[0])


def test_an_impact_without_speed_has_no_finite_multiplier() -> None:
    """On the side with the impact the map is a root: its derivative is inf, and no large number
    that rounding has made. On the other side the orbit is that of the linear oscillator."""
    system = stops(0.1, stiffness=1.0, left=-3.0).with_({"load.frequency": 0.8})
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.0), "load.force.amplitude", (0.1, 0.4)
    )
    grazing = next(point for point in branch.special if point.kind == "GR")
    there = [orbit for orbit in branch.orbits if orbit.grazes]
    assert len(there) == 2
    assert grazing.parameter == pytest.approx(abs(1.0 - 0.64 + 0.08j), abs=1e-12)
    linear = np.exp(np.roots([1.0, 0.1, 1.0]) * 2 * math.pi / 0.8)
    for orbit in there:
        expected = by_falling_modulus(linear) if not orbit.impact_count else [np.inf, np.inf]
        np.testing.assert_allclose(orbit.multipliers, expected, rtol=0, atol=1e-10)


def test_the_order_of_multipliers_depends_on_no_rounding_and_on_no_processor() -> None:
    """Many pairs of one modulus, as of alike cells, in any order before: sorts that are not stable
    leave them otherwise on other processors."""
    rng = np.random.default_rng(3)
    angles = np.linspace(0.1, 3.0, 20)
    pairs = 0.5 * np.exp(1j * angles)
    moved = np.array([0.9 + 0j, -0.7 + 0j, 0.2 + 0j, 0j, 0j])
    expected = np.concatenate(
        [moved[:2], np.column_stack([pairs, pairs.conj()]).ravel(), moved[2:]]
    )
    for _ in range(20):
        turned = pairs * (1.0 + 1e-14 * rng.normal(size=20))  # both of a pair alike, as of eigvals
        values = rng.permutation(np.concatenate([moved, turned, turned.conj()]))
        np.testing.assert_allclose(by_falling_modulus(values), expected, rtol=0, atol=1e-13)


def test_two_multipliers_are_ordered_as_of_many():
    rng = np.random.default_rng(3)
    for _ in range(500):
        a = complex(*rng.normal(size=2))
        # a number of another modulus, of the same one, and the same up to rounding
        for b in (complex(*rng.normal(size=2)), a.conjugate(), -a, a * (1.0 + 1e-15)):
            several = by_falling_modulus(np.array([a, b, 0.0]))
            np.testing.assert_array_equal(by_falling_modulus(np.array([a, b])), several[:2])
            np.testing.assert_array_equal(by_falling_modulus(np.array([b, a])), several[:2])
