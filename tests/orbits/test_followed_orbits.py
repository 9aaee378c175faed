"""Orbits that are followed as whole motions, with dry friction or impacts that die away: closed
forms, branches, files.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

import saltus
from saltus.orbits import solved_near
from saltus.orbits.beyond.symmetry import nearest
from saltus.orbits.equations.whole_motion import WholeMotionEquations


def rubbed(frequency: float = 0.7, friction: float = 0.2, **numbers: float) -> saltus.System:
    """A mass on ground that stands still under a harmonic force of amplitude 1."""
    model = saltus.BeltOscillator(
        **({"kinetic": friction, "static": friction, "belt_speed": 0.0} | numbers)
    )
    return saltus.System(
        model=model, load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=1.0))
    )


def den_hartog(frequency: float, friction: float) -> float:
    """The amplitude of the motion that never sticks (1931)."""
    vee, you = 1 / (1 - frequency**2), sin(pi / frequency) / (frequency * (1 + cos(pi / frequency)))
    return sqrt(vee**2 - (you * friction) ** 2)


@pytest.fixture(scope="module")
def branch() -> saltus.Branch:
    """Orbits from frequency 0.55 to 0.95."""
    orbit = saltus.find_orbit(rubbed(), x=0.5, velocity=0.0)
    return saltus.continue_orbit(orbit, "load.frequency", (0.55, 0.95))


def test_a_branch_has_den_hartogs_amplitudes(branch: saltus.Branch) -> None:
    """All along it, to 1e-10."""
    assert [end.parameter for end in branch.ends] == pytest.approx([0.55, 0.95])
    for orbit in branch.orbits:
        expected = den_hartog(orbit.frequency, 0.2)
        assert abs(orbit.amplitude - expected) < 1e-10 * expected
        assert orbit.defect < 1e-11


def test_multipliers_are_those_of_differences() -> None:
    """Of a motion that sticks twice a period: one multiplier is lost with the speed, the other one
    is that of direct motions.
    """
    system = rubbed(0.3, 0.4, damping=0.1)
    orbit = saltus.find_orbit(system, x=0.2, velocity=0.1)
    kinds = {str(event.kind) for event in orbit.motion().events}
    assert {"stick", "slip"} <= kinds
    assert np.abs(orbit.multipliers).min() < 1e-12
    x, v = orbit.state

    def after(dx: float, dv: float) -> np.ndarray:
        motion = saltus.simulate(system, x=x + dx, velocity=v + dv, periods=1, tol=1e-14)
        return np.array([motion.x, motion.velocity])

    step = 1e-5
    slopes = [
        (after(step * (i == 0), step * (i == 1)) - after(-step * (i == 0), -step * (i == 1)))
        / (2 * step)
        for i in (0, 1)
    ]
    expected = np.abs(np.linalg.eigvals(np.array(slopes).T))
    assert abs(np.abs(orbit.multipliers).max() - expected.max()) < 1e-8


def test_its_derivative_to_a_parameter_is_that_of_the_closed_form(branch: saltus.Branch) -> None:
    """The tangent of the branch, between neighbouring points, and frequency with a section that
    stays at its phase.
    """
    problem = branch.orbits[len(branch.orbits) // 2].equations
    orbit = branch.orbits[len(branch.orbits) // 2]
    unknowns, value, step = orbit.solution.unknowns, orbit.solution.values, 1e-6
    ahead, behind = (problem.evaluate(unknowns, value + s * step).residual for s in (1, -1))
    assert (
        np.abs((ahead - behind) / (2 * step) - orbit.solution.evaluation.parameters[:, 0]).max()
        < 1e-6
    )


def test_an_orbit_whose_motion_cannot_be_followed_is_not_confirmed(
    branch: saltus.Branch, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As at an event that appears or is lost, where rounding decides: the distance is infinite, and
    a diagram goes on.
    """

    def refused(*_: object, **__: object) -> None:
        raise saltus.MotionError("no choice is consistent")

    orbit = branch.orbits[0]
    assert orbit.defect < 1e-11
    vars(orbit).pop("defect")
    monkeypatch.setattr(saltus.PeriodicOrbit, "motion", refused)
    assert orbit.defect == np.inf
    vars(orbit).pop("defect")


def test_branches_are_read_from_files(branch: saltus.Branch) -> None:
    """With the phase of their section."""
    again = saltus.orbits.orbits_of(branch.to_xarray())
    assert [orbit.amplitude for orbit in again] == [orbit.amplitude for orbit in branch.orbits]


def test_power_is_what_the_force_gives() -> None:
    """On an orbit friction and damping take what the force gives."""
    orbit = saltus.find_orbit(rubbed(0.4, 0.3, damping=0.05), x=0.5, velocity=0.0)
    motion = orbit.motion(tol=1e-14)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    ends = np.unique(
        np.concatenate(
            [np.linspace(motion.start, motion.time, 60), [event.time for event in motion.events]]
        )
    )
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    t = (middle[:, None] + half[:, None] * nodes).ravel()
    given = (
        float(np.dot((half[:, None] * weights).ravel(), np.sin(0.4 * t) * motion.at(t)[1]))
        / orbit.duration
    )
    assert abs(saltus.mean_dissipated_power(orbit) - given) < 1e-11


def test_verdicts_and_attractors_know_these_orbits() -> None:
    """A regular motion, and all motions end on it."""
    system = rubbed(0.6, 0.3, damping=0.05)
    assert str(saltus.classify(system, x=0.1, velocity=0.2, periods=300).kind) == "periodic"
    found = saltus.find_attractors(system, starts=12, seed=2)
    assert [(str(member.kind), member.period) for member in found] == [("periodic", 1)]


def test_a_mass_that_sticks_for_good_is_refused() -> None:
    """It may do so anywhere near, so there is no orbit to follow."""
    with pytest.raises(saltus.MotionError, match="sticks for good"):
        saltus.find_orbit(rubbed(0.5, 1.5), x=0.1, velocity=0.0)


def test_an_orbit_whose_impacts_die_away_is_that_of_the_engine_for_one_contact() -> None:
    """A mass that is pulled off a stop in every period, bounces and rests: a `WallOscillator`, or
    one stop.
    """
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=1.5, mean=1.0))
    law, numbers = saltus.VelocityReduction(0.4), {"stiffness": 0.2, "damping": 0.1}
    wall = saltus.System(model=saltus.WallOscillator(wall=0.0, **numbers), load=load, impact=law)
    stops = saltus.System(
        model=saltus.TwoStops(left=-50.0, right=0.0, **numbers),
        load=load,
        impact=saltus.NewtonImpact(e=0.4),
    )
    expected, orbit = saltus.find_orbit(wall, x=-0.5), saltus.find_orbit(stops, x=-0.5)
    assert abs(orbit.amplitude - expected.amplitude) < 1e-12
    assert np.abs(orbit.multipliers).max() < 1e-12  # after rest nothing is left of a start
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (1.4, 1.6))
    for value, point in (
        (branch.orbits[0].system.get("load.force.amplitude"), branch.orbits[0]),
        (1.6, branch.orbits[-1]),
    ):
        there = saltus.find_orbit(wall.with_({"load.force.amplitude": value}), x=-0.5)
        assert abs(point.amplitude - there.amplitude) < 1e-11


def test_both_layers_have_orbits_whose_impacts_die_away() -> None:
    """With a restitution: found, and repeated by direct simulation; two multipliers are lost with
    the layer that rests.
    """
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1, mass_ratio=0.2)
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.4))
    orbit = saltus.find_orbit(
        saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.3)),
        theta_1=0.1,
        theta_2=0.0,
    )
    assert orbit.signature.section is not None
    assert orbit.defect < 1e-11
    assert (np.sort(np.abs(orbit.multipliers))[:2] < 1e-12).all()


@pytest.mark.thorough
def test_a_period_doubling_where_impacts_die_away_lies_on_its_curve() -> None:
    """Of both layers with e = 0.5: a branch under another vertical load, of orbits found there, has
    it where the curve is.
    """
    amplitude = "load.horizontal.amplitude"
    load = saltus.Load(frequency=0.5, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.1055))
    model, impact = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1), saltus.NewtonImpact(e=0.5)
    orbit = saltus.find_orbit(
        saltus.System(model=model, load=load, impact=impact), theta_1=0.05, theta_2=0.0
    )
    assert orbit.signature.section is not None
    (flip,) = saltus.continue_orbit(orbit, amplitude, (0.1055, 0.1062)).special
    assert flip.kind == "PD"
    curve = saltus.continue_special(flip, "load.vertical", (-0.5005, -0.4985))
    assert [end.parameter for end in curve.ends] == [-0.5005, -0.4985]
    (there,) = curve.at("load.vertical", -0.499)
    near = there.system.get(amplitude)
    assert abs(near - flip.parameter) > 1e-4
    beside = saltus.find_orbit(
        there.system.with_({amplitude: near - 2e-4}), theta_1=0.05, theta_2=0.0
    )
    (again,) = saltus.continue_orbit(beside, amplitude, (near - 2e-4, near + 1e-4)).special
    assert (again.kind, again.parameter) == ("PD", pytest.approx(near, abs=1e-12))


def beside_an_event(orbit: saltus.PeriodicOrbit) -> saltus.PeriodicOrbit:
    """The orbit with its state just before an event, which soon comes there along a branch."""
    times = np.unique([event.time for event in orbit.motion().events])
    longest = int(np.argmax(np.diff(times)))
    time = times[longest] + 0.979 * np.diff(times)[longest]
    phase, state = time * orbit.frequency % (2 * pi), np.concatenate(orbit.motion().at(time))
    problem, values = orbit.equations, orbit.solution.values
    assert isinstance(problem, WholeMotionEquations)
    found = saltus.PeriodicOrbit.near(
        problem.with_signature(replace(orbit.signature, section=phase)), state, values
    )
    assert found is not None
    return found


@pytest.mark.thorough
def test_a_section_that_moves_to_another_forcing_period_does_not_turn_a_branch_round() -> None:
    """Of orbits of three periods: the branch goes through its fold from bound to bound, though its
    sections move. The state at the section after that is on the motion from the one before, by
    which a loop is seen to close."""
    load = saltus.Load(frequency=2.56, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=1.0))
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1, mass_ratio=0.01)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.5))
    orbit = solved_near(system, "load.frequency", np.array([0.0, -0.073, 0.0, -0.096]), 3)
    assert orbit is not None
    branch = saltus.continue_orbit(beside_an_event(orbit), "load.frequency", (2.5, 2.57))
    assert [end.parameter for end in branch.ends] == [2.57, 2.57]
    rates = np.diff(branch.parameters)
    assert np.count_nonzero(np.diff(np.sign(rates[rates != 0.0]))) == 1
    assert [str(point.kind) for point in branch.special].count("LP") == 1
    moved = [
        pair
        for pair in pairwise(branch.points)
        if pair[0].orbit.signature.section != pair[1].orbit.signature.section
    ]
    same = [(before, after) for before, after in moved if before.parameter == after.parameter]
    assert same
    for before, after in same:
        assert np.abs(before.place - after.place).max() > 1e-3
        np.testing.assert_allclose(
            nearest(before, before.place, after), after.place, rtol=0, atol=1e-9
        )
