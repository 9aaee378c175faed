"""Plain curves F(y, p) = 0 whose folds, crossings and ends are known in closed form: what is
delicate in following any curve.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from test_continuation import FOLD, Explicit, Folds

from saltus.continuation import STEPS, Course, CurveEnd, End, Events, both_ways

# whose name pytest would take for that of a test
from saltus.continuation import TestFunction as Function


def bordered_determinant(point):
    """The determinant of the derivatives with the tangent below them: it changes its sign where two
    curves cross.
    """
    return float(
        np.linalg.det(
            np.vstack([point.curve.evaluate(point.place, True).derivatives(), point.tangent])
        )
    )


CROSSING = Function("crossing", bordered_determinant, singular=True)


class FoldsAndCrossings(Folds):
    def tests(self, point):
        return (FOLD, CROSSING)


def kinds(course: Course) -> list[str]:
    return [str(zero.kind) for zero in course.special]


def largest_residual(course: Course) -> float:
    return max(
        float(np.abs(point.curve.evaluate(point.place, True).residual).max())
        for point in course.points
    )


@pytest.mark.parametrize("a", [1e-1, 1e-2, 1e-3])
def test_both_folds_of_a_narrow_pair_are_found(a):
    """p = y^3 - a y turns at y = +-sqrt(a / 3), where p = -+2 (a / 3)^(3/2): 1e-5 apart for the
    least a, in steps of 0.1.
    """
    curve = Explicit(
        lambda z: z[1] - z[0] ** 3 + a * z[0], lambda z: np.array([a - 3.0 * z[0] ** 2, 1.0])
    )
    found = both_ways(curve.start(0.8, 0.8**3 - a * 0.8), Folds, {"p": (-1.0, 1.0)})
    size = 2.0 * (a / 3.0) ** 1.5
    assert sorted(zero.parameter for zero in found.special) == pytest.approx(
        [-size, size], abs=1e-13
    )
    assert {end.parameter for end in found.ends} == {-1.0, 1.0}


@pytest.mark.parametrize("width", [1e-3, 1e-4])
def test_two_zeros_between_which_another_function_vanishes_are_both_found(width):
    """The first function is 1 but between two zeros that no step is short enough to see; the
    zero of the second one lies between them, as an LP beside an NS.
    """
    zeros = 0.4123 - width, 0.4123 + 0.5 * width

    def between(point):
        first, last = (math.tanh((point.parameter - zero) / (0.1 * width)) for zero in zeros)
        return first * last

    class Both(Events):
        def tests(self, point):
            second = Function("second", lambda at: at.parameter - 0.4123)
            return (Function("first", between), second)

    line = Explicit(lambda z: z[1] - z[0], lambda z: np.array([-1.0, 1.0]))
    found = both_ways(line.start(0.0, 0.0), Both, {"p": (-1.0, 1.0)})
    assert kinds(found) == ["first", "second", "first"]
    assert [zero.parameter for zero in found.special] == pytest.approx(
        [zeros[0], 0.4123, zeros[1]], abs=1e-10
    )


@pytest.mark.parametrize("shift", [0.0, 0.0137, 0.0291, 0.0333])
def test_two_special_points_of_one_step_have_a_point_between_them(shift):
    """What holds between them, such as a stability, is seen at no other point of the curve."""
    zeros = 0.4 + shift, 0.41 + shift

    class Both(Events):
        keeps_special = True

        def tests(self, point):
            return tuple(
                Function(str(zero), lambda at, zero=zero: at.parameter - zero) for zero in zeros
            )

    line = Explicit(lambda z: z[1] - z[0], lambda z: np.array([-1.0, 1.0]))
    found = both_ways(line.start(0.0, 0.0), Both, {"p": (-1.0, 1.0)})
    assert [zero.parameter for zero in found.special] == pytest.approx(zeros, abs=1e-12)
    values = found.parameters
    assert (np.diff(values) > 0.0).all()
    inside = values[(values > zeros[0] + 1e-3) & (values < zeros[1] - 1e-3)]
    assert len(inside) == 1
    assert largest_residual(found) < 1e-12


def test_a_cusp_is_no_fold():
    """p = y^3: p stands still at 0 and goes on."""
    curve = Explicit(lambda z: z[1] - z[0] ** 3, lambda z: np.array([-3.0 * z[0] ** 2, 1.0]))
    found = both_ways(curve.start(0.9, 0.9**3), Folds, {"p": (-1.0, 1.0)})
    # a double zero of the test function is none, or a pair that rounding makes
    assert len(found.special) in (0, 2)
    assert all(abs(zero.parameter) < 1e-12 for zero in found.special)
    assert found.points[0].place[0] * found.points[-1].place[0] == pytest.approx(-1.0, abs=1e-12)


def test_a_pitchfork_is_gone_through_on_its_stem():
    """y (p - y^2) = 0 from p = -0.93 along y = 0: one crossing, at p = 0, though the equations are
    singular there.
    """
    curve = Explicit(
        lambda z: z[0] * (z[1] - z[0] ** 2), lambda z: np.array([z[1] - 3.0 * z[0] ** 2, z[0]])
    )
    found = both_ways(curve.start(0.0, -0.93), FoldsAndCrossings, {"p": (-1.0, 1.0)})
    assert kinds(found) == ["crossing"]
    assert abs(found.special[0].parameter) < 1e-12
    assert max(abs(point.place[0]) for point in found.points) < 1e-12
    assert {end.parameter for end in found.ends} == {-1.0, 1.0}


def test_a_pitchfork_turns_on_its_fork():
    """p = y^2 through p = 0: a fold and the crossing at one point."""
    curve = Explicit(
        lambda z: z[0] * (z[1] - z[0] ** 2), lambda z: np.array([z[1] - 3.0 * z[0] ** 2, z[0]])
    )
    found = both_ways(curve.start(0.9, 0.81), FoldsAndCrossings, {"p": (-1.0, 1.0)})
    assert sorted(kinds(found)) == ["crossing", "fold"]
    assert max(abs(zero.parameter) for zero in found.special) < 1e-10
    assert [end.parameter for end in found.ends] == [1.0, 1.0]
    assert sorted(point.place[0] for point in (found.points[0], found.points[-1])) == pytest.approx(
        [-1.0, 1.0], abs=1e-12
    )


@pytest.mark.parametrize("e", [1e-1, 1e-3])
def test_an_imperfect_pitchfork_has_one_fold_on_its_lower_part(e):
    """y p - y^3 + e = 0: p = 3 (e / 2)^(2/3) at y = -(e / 2)^(1/3); the upper part has none."""
    curve = Explicit(
        lambda z: z[0] * z[1] - z[0] ** 3 + e, lambda z: np.array([z[1] - 3.0 * z[0] ** 2, z[0]])
    )
    below = -0.9
    lower = both_ways(curve.start(below, below**2 - e / below), Folds, {"p": (-1.0, 1.0)})
    upper = both_ways(curve.start(0.9, 0.81 - e / 0.9), Folds, {"p": (-1.0, 1.0)})
    (fold,) = lower.special
    assert fold.parameter == pytest.approx(3.0 * (e / 2.0) ** (2.0 / 3.0), abs=1e-13)
    assert fold.point.place[0] == pytest.approx(-((e / 2.0) ** (1.0 / 3.0)), abs=1e-6)
    assert not upper.special
    assert min(point.place[0] for point in upper.points) > 0.0


@pytest.mark.parametrize("radius", [1e-1, 1e-2, 1e-3])
def test_a_small_isola_closes(radius):
    """A circle around (0.3, 0.5), smaller than the first step of most curves would be."""
    curve = Explicit(
        lambda z: ((z[0] - 0.3) ** 2 + (z[1] - 0.5) ** 2) / radius**2 - 1.0,
        lambda z: 2.0 * np.array([z[0] - 0.3, z[1] - 0.5]) / radius**2,
    )
    found = both_ways(
        curve.start(0.3 + 0.6 * radius, 0.5 + 0.8 * radius), Folds, {"p": (-1.0, 1.0)}
    )
    assert [end.reason for end in found.ends] == [CurveEnd.CLOSED] * 2
    assert sorted(zero.parameter for zero in found.special) == pytest.approx(
        [0.5 - radius, 0.5 + radius], abs=1e-12
    )
    assert found.points[0] is found.points[-1]


@pytest.mark.parametrize(("gap", "longest"), [(1e-1, 0.1), (1e-2, 0.1), (1e-3, 0.01)])
def test_two_branches_that_nearly_meet_are_kept_apart(gap, longest):
    """y^2 = p^2 + gap^2: the upper branch goes round its corner and does not cross to the lower
    one, if steps are no longer than some ten times the gap."""
    curve = Explicit(
        lambda z: z[0] ** 2 - z[1] ** 2 - gap**2, lambda z: 2.0 * np.array([z[0], -z[1]])
    )
    found = both_ways(
        curve.start(math.hypot(0.8, gap), -0.8),
        Folds,
        {"p": (-1.0, 1.0)},
        replace(STEPS, longest=longest),
    )
    assert min(point.place[0] for point in found.points) >= gap * (1.0 - 1e-12)
    assert {end.parameter for end in found.ends} == {-1.0, 1.0}
    assert not found.special
    assert found.solved_at(0.0)[0].place[0] == pytest.approx(gap, abs=1e-12)


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 1e-4])
def test_no_long_step_jumps_between_two_branches_that_nearly_meet(gap):
    """The same curves with steps of any length, from five starts: where a step changes the sign of
    the determinant and no crossing is located, it has jumped, and is taken again.
    """
    curve = Explicit(
        lambda z: z[0] ** 2 - z[1] ** 2 - gap**2, lambda z: 2.0 * np.array([z[0], -z[1]])
    )
    for first in (-0.71, -0.777, -0.8, -0.83, -0.9):
        for longest in (0.05, 0.1, 0.3):
            found = both_ways(
                curve.start(math.hypot(first, gap), first),
                FoldsAndCrossings,
                {"p": (-1.0, 1.0)},
                replace(STEPS, longest=longest),
            )
            assert min(point.place[0] for point in found.points) >= gap * (1.0 - 1e-12)
            assert not found.special
            assert not found.missed


class Limited(Folds):
    """Equations that hold up to y = 0.5 only."""

    def barrier(self, point):
        return Function("barrier", lambda point: 0.5 - float(point.place[0]))

    def across(self, run, cut):
        return End(CurveEnd.NO_STEP, cut.point.parameter, detail="curve")


def test_a_barrier_ends_a_step_where_it_is_met_even_beyond_a_fold():
    """On p = y^2 from y = -0.9: through the fold at 0, up to the barrier at y = 0.5, where p =
    0.25.
    """
    curve = Explicit(lambda z: z[1] - z[0] ** 2, lambda z: np.array([-2.0 * z[0], 1.0]))
    found = both_ways(
        curve.start(-0.9, 0.81), Limited, {"p": (-1.0, 1.0)}, steps=replace(STEPS, longest=0.5)
    )
    assert kinds(found) in (["fold", "barrier"], ["barrier", "fold"])
    by_kind = {str(zero.kind): zero for zero in found.special}
    assert by_kind["barrier"].point.place == pytest.approx([0.5, 0.25], abs=1e-12)
    assert abs(by_kind["fold"].parameter) < 1e-13
    assert max(point.place[0] for point in found.points) <= 0.5 + 1e-12


@pytest.mark.parametrize("beyond", [1e-3, 1e-6])
def test_a_curve_that_turns_just_within_a_bound_goes_on_and_one_that_turns_just_beyond_ends(beyond):
    """The unit circle between bounds a little outside and a little inside of +-1."""
    circle = Explicit(lambda z: z @ z - 1.0, lambda z: 2.0 * z)
    inside = both_ways(circle.start(0.6, 0.8), Folds, {"p": (-1.0 - beyond, 1.0 + beyond)})
    outside = both_ways(circle.start(0.6, 0.8), Folds, {"p": (-1.0 + beyond, 1.0 - beyond)})
    assert [end.reason for end in inside.ends] == [CurveEnd.CLOSED] * 2
    assert sorted(zero.parameter for zero in inside.special) == pytest.approx(
        [-1.0, 1.0], abs=1e-13
    )
    assert {end.parameter for end in outside.ends} == {-1.0 + beyond, 1.0 - beyond}
    assert {end.reason for end in outside.ends} == {CurveEnd.BOUND}
    assert all(point.place[0] > 0.0 for point in outside.points)


def test_a_start_on_a_bound_from_which_the_curve_turns_back_is_no_end():
    """p = y^2 from (0, 0), with 0 as the bound: both halves lead inwards."""
    curve = Explicit(lambda z: z[1] - z[0] ** 2, lambda z: np.array([-2.0 * z[0], 1.0]))
    found = both_ways(curve.start(0.0, 0.0), Events, {"p": (0.0, 1.0)})
    assert [end.parameter for end in found.ends] == [1.0, 1.0]
    assert sorted(point.place[0] for point in (found.points[0], found.points[-1])) == pytest.approx(
        [-1.0, 1.0], abs=1e-12
    )


@pytest.mark.parametrize("slope", [10.0, 100.0, 1000.0])
def test_steep_parts_need_short_steps_alone(slope):
    """y = tanh(slope p): the points stay on the curve, and their number grows slowly with the
    slope.
    """
    curve = Explicit(
        lambda z: z[0] - np.tanh(slope * z[1]),
        lambda z: np.array([1.0, -slope * (1.0 - np.tanh(slope * z[1]) ** 2)]),
    )
    found = both_ways(curve.start(np.tanh(-0.9 * slope), -0.9), Folds, {"p": (-1.0, 1.0)})
    assert not found.special
    assert largest_residual(found) < 1e-10
    assert {end.parameter for end in found.ends} == {-1.0, 1.0}
    assert len(found.points) < 400


def test_the_number_of_points_is_an_end():
    spiral = Explicit(lambda z: z @ z - 1.0, lambda z: 2.0 * z)
    found = both_ways(
        spiral.start(0.6, 0.8), Folds, {"p": (-2.0, 2.0)}, steps=replace(STEPS, most_points=7)
    )
    assert [end.reason for end in found.ends] == [CurveEnd.MOST_POINTS] * 2
    assert "more than 7 points" in str(found.ends[0])
