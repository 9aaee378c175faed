"""The equations of a periodic orbit: their values against the event-driven flow, their derivatives
against differences.
"""

import math

import numpy as np
import pytest
from orbit_cases import CASES, random_guess, slope
from scipy.integrate import solve_ivp
from shared_systems import hinged, paired, walled

from saltus import OneContactModel, simulate
from saltus.flow import SegmentColumn, SegmentValue
from saltus.flow.one_contact.segments import SHORT
from saltus.orbits.equations.one_contact import OneContactEquations, Segments
from saltus.orbits.signature import Signature
from saltus.systems import Harmonic, Load, System, VelocityReduction

STARTS = {
    "forced": (0.6, 0.1),
    "shaken": (0.5, 0.2),
    "walled": (0.2, 0.9),
    "rocking": (0.01, 0.02),
    "hinged": (1.2, 0.3),
}


def at_impacts(name):
    """A motion, and the problem whose unknowns are its first impacts."""
    system, paths = CASES[name]
    x, v = STARTS[name]
    motion = simulate(system, **{system.model.coordinates[0]: x}, velocity=v, periods=6, tol=1e-14)
    impacts = motion.impacts
    assert len(impacts) >= 4
    count = min(8, len(impacts) // 2 * 2)
    sides = tuple(int(s) for s in impacts.side[:count])
    problem = OneContactEquations(system, Signature(sides, 1), paths)
    phases, speeds = (
        impacts.time[:count] * system.load.frequency,
        np.abs(impacts.velocity_before[:count]),
    )
    return motion, problem, np.stack([phases, speeds], axis=1).ravel()


@pytest.mark.parametrize("name", CASES)
def test_a_motion_solves_the_equation_of_each_of_its_segments(name):
    _, problem, unknowns = at_impacts(name)
    residual = problem.evaluate(unknowns, problem.values).residual.reshape(-1, 2)
    # the last segment closes the period, which the motion does not
    assert np.abs(residual[:-1]).max() < 2e-12


@pytest.mark.parametrize("name", CASES)
def test_extrema_of_segments_are_those_of_the_motion(name):
    motion, problem, unknowns = at_impacts(name)
    extremes = problem.evaluate(unknowns, problem.values, with_extremes=True).extremes
    times = unknowns[::2] / problem.system.load.frequency
    for i in range(len(times) - 1):
        x, _ = motion.at(np.linspace(times[i], times[i + 1], 4001))
        fine = 1e-6  # a parabola between samples
        assert x.max() - 1e-11 <= extremes[i, SegmentColumn.HIGHEST] <= x.max() + fine
        assert x.min() - fine <= extremes[i, SegmentColumn.LOWEST] <= x.min() + 1e-11
        assert extremes[i, SegmentColumn.LOWEST_GAP] > 0.0


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("impacts", [2, 6])
def test_derivatives_of_the_equations_to_unknowns_and_parameters(name, impacts):
    system, paths = CASES[name]
    problem, unknowns = random_guess(np.random.default_rng(impacts), system, paths, impacts)
    values = problem.values
    found = problem.evaluate(unknowns, values)
    jacobian = found.jacobian()
    for j in range(problem.size):
        expected = slope(lambda y: problem.evaluate(y, values).residual, unknowns, j)
        assert np.abs(jacobian[:, j] - expected).max() < 1e-8 * max(1.0, np.abs(expected).max()), (
            f"unknown {j}"
        )
    for j, path in enumerate(paths):
        expected = slope(lambda p: problem.evaluate(unknowns, p).residual, values, j, h=2e-3)
        assert np.abs(found.parameters[:, j] - expected).max() < 1e-8 * max(
            1.0, np.abs(expected).max()
        ), path


def one_segment(name, begin, duration, speed=0.6):
    """A problem of two segments, of which the first goes from phase `begin` over `duration`; the
    function of its length.
    """
    system, paths = CASES[name]
    both = len(system.model.sides) == 2
    problem = OneContactEquations(system, Signature((1, -1) if both else (1, 1), 1), paths)
    return problem, np.array([begin, speed, begin + duration, 0.4])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("duration", [-0.8, -0.01, 0.01])
def test_derivatives_of_short_segments_and_of_segments_backwards_in_time(name, duration):
    problem, unknowns = one_segment(name, 1.0, duration)
    jacobian, values = problem.evaluate(unknowns, problem.values), problem.values
    for j in range(4):
        expected = slope(lambda y: problem.evaluate(y, values).residual, unknowns, j)
        assert np.abs(jacobian.jacobian()[:, j] - expected).max() < 1e-8 * max(
            1.0, np.abs(expected).max()
        )
    for j in range(len(problem.paths)):
        expected = slope(lambda p: problem.evaluate(unknowns, p).residual, values, j)
        assert np.abs(jacobian.parameters[:, j] - expected).max() < 1e-8 * max(
            1.0, np.abs(expected).max()
        )


@pytest.mark.parametrize("name", CASES)
def test_a_segment_of_no_length_is_the_limit_of_its_neighbours(name):
    """The quotient is even in smoothness: at duration 0 everything equals the mean of what it is a
    little before and after.
    """
    h = 1e-3

    def at_duration(duration):
        problem, unknowns = one_segment(name, 1.0, duration)
        equations = problem.evaluate(unknowns, problem.values)
        return np.concatenate(
            [
                equations.residual[:2],
                equations.jacobian()[:2].ravel(),
                equations.parameters[:2].ravel(),
            ]
        )

    near, nearer = ((at_duration(d) + at_duration(-d)) / 2 for d in (h, h / 2))
    assert np.abs(at_duration(0.0) - (4 * nearer - near) / 3).max() < 1e-9


@pytest.mark.parametrize("name", CASES)
def test_derivatives_do_not_jump_where_the_short_segments_begin(name):
    def at_duration(duration):
        problem, unknowns = one_segment(name, 1.0, duration)
        equations = problem.evaluate(unknowns, problem.values)
        return np.concatenate([equations.jacobian()[:2].ravel(), equations.parameters[:2].ravel()])

    limit, scale = at_duration(0.0), SHORT
    for duration in (
        0.5 * scale,
        0.999 * scale,
        1.001 * scale,
        5 * scale,
        -0.999 * scale,
        -1.001 * scale,
    ):
        assert np.abs(at_duration(duration) - limit).max() < 20 * abs(duration) + 1e-9


def test_a_segment_there_and_back_ends_where_it_began():
    """Backwards in time from the end of a smooth motion, on either side and through the contact."""
    system = hinged(edge=0.4)
    problem = OneContactEquations(
        system, Signature((), 1, False, -1), ("load.frequency", "model.edge", "impact.e")
    )
    state = np.array([-0.7, 1.1])
    there = problem.carried(state, 0.5, 9.0, problem.values)
    back = problem.carried(there, 9.0, 0.5, problem.values)
    assert np.abs(back - state).max() < 1e-12
    assert np.abs(there - state).max() > 0.1


SMOOTH = {
    "pair": (paired(), ("load.frequency", "model.coupling"), np.array([0.3, -0.4, 0.2, 0.5])),
    "open": (CASES["forced"][0], CASES["forced"][1], np.array([0.9, 0.2])),
    "wall": (CASES["walled"][0], CASES["walled"][1], np.array([-0.3, 0.1])),
}


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("periods", [1, 3])
def test_derivatives_of_shooting_without_impacts(name, periods):
    system, paths, state = SMOOTH[name]
    problem = OneContactEquations(system, Signature((), periods, False, 1), paths)
    found, values = problem.evaluate(state, problem.values), problem.values
    for j in range(state.size):
        expected = slope(lambda y: problem.evaluate(y, values).residual, state, j)
        assert np.abs(found.jacobian()[:, j] - expected).max() < 1e-8 * max(
            1.0, np.abs(expected).max()
        )
    for j, path in enumerate(paths):
        if path != "impact.e":  # there is no impact: its column is 0 exactly
            expected = slope(lambda p: problem.evaluate(state, p).residual, values, j, h=1e-3)
            assert np.abs(found.parameters[:, j] - expected).max() < 1e-8 * max(
                1.0, np.abs(expected).max()
            ), path
        else:
            assert (found.parameters[:, j] == 0.0).all()


class SteepBelow(OneContactModel):
    """x'' = force - 0.1 x' - x - push: 0.3 above the contact; below it the push turns round within
    0.01 of x = -0.8.
    """

    coordinates = ("x",)
    channels = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        below = (1 - side) / 2
        push = below * 2.0 * np.tanh((x + 0.8) * 400.0) + (1 - below) * 0.3
        return load.force(t) - 0.1 * velocity - x - push


@pytest.mark.parametrize(("side", "start"), [(-1, (-0.2, -1.5)), (1, (0.4, 1.0))])
def test_steps_of_a_segment_are_checked_with_the_equation_of_its_own_side(side, start):
    """Of a force that bends too sharply for a series from afar, against DOP853 with short steps."""
    load = Load(frequency=1.0, force=Harmonic(0.2))
    problem = OneContactEquations(
        System(model=SteepBelow(), load=load, impact=VelocityReduction(0.9)), Signature((), 1)
    )
    spans, sides = np.array([[0.0, 1.5, 0.0]]), np.array([[0, side]])
    followed = problem.follow_segments(Segments(spans, sides, np.array([start])), problem.values)
    model = problem.system.model

    def rate(t, y):
        return [y[1], model.acceleration(t, y[0], y[1], side, load)]

    expected = solve_ivp(
        rate, (0.0, 1.5), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=1e-3
    ).y[:, -1]
    assert followed.ends[
        0, SegmentValue.FIRST_STATE : SegmentValue.FIRST_STATE + 2
    ] == pytest.approx(expected, abs=1e-9)


def test_lowest_gap_inside_a_segment_and_its_instant():
    """The oscillator's free response from an impact dips towards the wall: against the closed form
    on a fine grid.
    """
    system = walled(A=0.0, W=1.0, c=0.02, wall=-0.05, e=0.8)
    problem = OneContactEquations(
        system, Signature((1,), 2), ("load.frequency", "load.force.amplitude", "model.wall")
    )
    speed = 0.5
    extremes = problem.evaluate(
        np.array([0.3, speed]), problem.values, with_extremes=True
    ).extremes[0]
    # x'' + c x' + x = 0 from (wall, -e v)
    c, wall, v = 0.02, -0.05, -0.8 * speed
    w = math.sqrt(1 - c * c / 4)
    times = np.linspace(0.0, 4 * math.pi, 400_001)
    x = np.exp(-c * times / 2) * (
        wall * np.cos(w * times) + (v + c * wall / 2) / w * np.sin(w * times)
    )
    tops = [i for i in range(1, len(x) - 1) if x[i - 1] < x[i] >= x[i + 1]]
    top = max(tops, key=lambda i: x[i])
    assert extremes[SegmentColumn.LOWEST_GAP] == pytest.approx(wall - x[top], abs=1e-9)
    assert extremes[SegmentColumn.LOWEST_GAP] < 0.0
    assert extremes[SegmentColumn.LOWEST_GAP_TIME] - 0.3 == pytest.approx(times[top], abs=4e-5)


def test_parameters_that_leave_the_model_its_meaning_are_refused_by_the_system_and_survive_the_equations():
    """Newton's method may try any numbers; what it converges to is a system again, which refuses
    what has no meaning.
    """
    problem, unknowns = one_segment("forced", 1.0, 2.0)
    for bad in (np.nan, np.inf):
        values = problem.values.copy()
        values[0] = bad
        assert problem.evaluate(unknowns, values) is None
    values = problem.values.copy()
    values[problem.paths.index("load.frequency")] = -1.0
    assert problem.evaluate(unknowns, values) is None
    assert problem.evaluate(np.full(4, np.nan), problem.values) is None
