"""The loop of a continuation on curves whose points, folds and ends are known in closed form."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from saltus.continuation import (
    STEPS,
    Corrected,
    CurveEnd,
    Cut,
    End,
    EndReason,
    EquationCurve,
    Events,
    Point,
    both_ways,
    located,
    newton,
)

# whose name pytest would take for that of a test
from saltus.continuation import TestFunction as Function

FOLD = Function("fold", lambda point: float(point.tangent[-1]))


@dataclass(frozen=True)
class Values:
    """Equations at a place."""

    residual: np.ndarray
    matrix: np.ndarray

    def derivatives(self) -> np.ndarray:
        return self.matrix


@dataclass(frozen=True, eq=False)
class Explicit(EquationCurve[Point]):
    """A curve given by functions of a place, with all weights 1."""

    function: Callable[[np.ndarray], np.ndarray]
    slopes: Callable[[np.ndarray], np.ndarray]
    size: int = 2
    count: int = 1

    @property
    def weights(self):
        return np.ones(self.size)

    def evaluate(self, place, thorough):
        return Values(np.atleast_1d(self.function(place)), np.atleast_2d(self.slopes(place)))

    def point_at(self, found, tangent):
        return Point(self, found.place, tangent, found.iterations)

    def start(self, *place):
        """The point at a place, to be followed along the kernel of the derivatives."""
        place = np.array(place, dtype=float)
        return self.along_kernel(Corrected(place, self.evaluate(place, True), 0))


class Folds(Events):
    """Folds, and nothing else."""

    keeps_special = True

    def tests(self, point):
        return (FOLD,)


def circle():
    return Explicit(lambda z: z @ z - 1.0, lambda z: 2.0 * z)


def cubic():
    """p = y - y^3, with folds at y = +-1 / sqrt(3)."""
    return Explicit(
        lambda z: z[1] - z[0] + z[0] ** 3, lambda z: np.array([3.0 * z[0] ** 2 - 1.0, 1.0])
    )


WIDE = {"p": (-9.0, 9.0)}


def test_a_loop_closes_in_its_first_point_with_both_folds():
    found = both_ways(circle().start(0.6, 0.8), Folds, WIDE)
    assert found.ends == (End(CurveEnd.CLOSED), End(CurveEnd.CLOSED))
    assert found.points[0] is found.points[-1]
    assert sorted(zero.point.parameter for zero in found.special) == pytest.approx(
        [-1.0, 1.0], abs=1e-13
    )
    assert not found.missed
    places = np.array([point.place for point in found.points])
    assert np.abs(np.hypot(*places.T) - 1.0).max() < 1e-13
    turned = np.unwrap(np.arctan2(places[:, 1], places[:, 0]))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize("longest", [0.02, 0.1, 0.5])
def test_folds_do_not_depend_on_the_step(longest):
    found = both_ways(
        cubic().start(0.0, 0.0), Folds, {"p": (-1.0, 1.0)}, steps=replace(STEPS, longest=longest)
    )
    size = 2.0 / 3.0**1.5
    assert sorted(zero.point.parameter for zero in found.special) == pytest.approx(
        [-size, size], abs=1e-14
    )
    for zero in found.special:
        assert zero.evidence.before * zero.evidence.after < 0.0
        assert zero.evidence.bracket < 1e-10
    assert {end.parameter for end in found.ends} == {-1.0, 1.0}
    assert {end.reason for end in found.ends} == {CurveEnd.BOUND}


def test_all_solutions_at_a_value():
    found = both_ways(cubic().start(0.0, 0.0), Folds, {"p": (-1.0, 1.0)})
    roots = np.sort(np.roots([1.0, 0.0, -1.0, 0.2]).real)
    assert sorted(point.place[0] for point in found.solved_at(0.2)) == pytest.approx(
        roots, abs=1e-13
    )
    assert [point.parameter for point in found.solved_at(found.points[-1].parameter)] == [
        found.points[-1].parameter
    ]
    assert found.solved_at(1.5) == []


def test_two_parameters_and_which_bound_is_met():
    """The line where a plane cuts a sphere, from bound to bound."""
    sphere = Explicit(
        lambda z: np.array([z @ z - 1.0, z[0] - 0.1 * z[1]]),
        lambda z: np.array([2.0 * z, [1.0, -0.1, 0.0]]),
        size=3,
        count=2,
    )
    bounds = {"one": (-2.0, 0.5), "other": (-2.0, 2.0)}
    found = both_ways(sphere.start(0.0, 0.0, 1.0), Events, bounds)
    assert [str(end) for end in found.ends] == ["bound one = 0.5"] * 2
    assert [point.parameters[0] for point in (found.points[0], found.points[-1])] == [0.5, 0.5]
    assert all(abs(point.place @ point.place - 1.0) < 1e-13 for point in found.points)


def test_a_start_on_a_bound_is_followed_inwards_only():
    line = Explicit(lambda z: z[0] - z[1], lambda z: np.array([1.0, -1.0]))
    found = both_ways(line.start(1.0, 1.0), Events, {"p": (0.0, 1.0)})
    assert sorted(point.parameter for point in found.points)[-2] < 1.0
    assert {end.parameter for end in found.ends} == {0.0, 1.0}


def test_progress_is_the_share_of_the_range_that_was_seen():
    heard = []
    line = Explicit(lambda z: z[0] - z[1], lambda z: np.array([1.0, -1.0]))
    both_ways(
        line.start(0.5, 0.5), Events, {"p": (0.0, 1.0)}, progress=lambda *told: heard.append(told)
    )
    shares = [share for share, _ in heard]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert {"p = 0", "p = 1"} <= {what for _, what in heard}


class Corner(Events):
    """y = p for p < 0, y = 2 p beyond: the equations change at 0."""

    def __init__(self):
        self.beyond = Explicit(lambda z: z[0] - 2.0 * z[1], lambda z: np.array([1.0, -2.0]))

    def cut(self, point, ahead):
        if point.curve is self.beyond or ahead.place[0] <= 0.0:
            return None
        corner = located(Function("corner", lambda point: float(point.place[0])), point, ahead)
        return Cut(corner.point, corner)

    def across(self, run, cut):
        start = self.beyond.start(*cut.point.place)
        return start if start.tangent[-1] > 0.0 else start.turned()


def test_a_step_is_cut_where_the_equations_change_and_goes_on_with_others():
    line = Explicit(lambda z: z[0] - z[1], lambda z: np.array([1.0, -1.0]))
    found = both_ways(line.start(-1.0, -1.0), Corner, {"p": (-1.0, 1.0)})
    (corner,) = found.special
    assert (corner.kind, corner.point.parameter) == ("corner", pytest.approx(0.0, abs=1e-14))
    assert max(point.place[0] for point in found.points) == pytest.approx(2.0, abs=1e-13)
    assert found.solved_at(0.5)[0].place[0] == pytest.approx(1.0, abs=1e-13)


class Wall(Events):
    """A barrier beyond 1 that cannot be located, as it has no value there."""

    def barrier(self, point):
        return Function("wall", lambda point: 1.0 if point.parameter <= 1.0 else -math.inf)


def test_what_lies_outside_the_bounds_is_no_event():
    line = Explicit(lambda z: z[0] - z[1], lambda z: np.array([1.0, -1.0]))
    inside, outside = (
        both_ways(line.start(0.0, 0.0), Wall, {"p": (-1.0, high)}) for high in (1.0, 2.0)
    )
    assert inside.ends == (End(CurveEnd.BOUND, -1.0), End(CurveEnd.BOUND, 1.0))
    assert outside.ends[1].reason is CurveEnd.NOT_LOCATED


def test_where_no_step_is_short_enough_the_end_says_so():
    spike = Explicit(
        lambda z: z[1] - abs(z[0]) ** 0.5,
        lambda z: np.array([-0.5 * np.sign(z[0]) / max(abs(z[0]), 1e-300) ** 0.5, 1.0]),
    )
    found = both_ways(spike.start(1.0, 1.0), Events, WIDE, steps=replace(STEPS, most_points=2000))
    assert {end.reason for end in found.ends} == {CurveEnd.NO_STEP, CurveEnd.BOUND}
    assert min(abs(point.parameter) for point in found.points) < 1e-9


def test_reasons_are_data_and_their_text_is_a_sentence():
    class Mine(EndReason):
        NEAR = "comes near {detail} at {parameter:.3g}, a {kind}"

    end = End(Mine.NEAR, 0.123456, "fold", "another")
    assert str(end) == "comes near another at 0.123, a fold"
    assert end.reason.code == "near"
    assert end == End(Mine.NEAR, 0.123456, "fold", "another")


def test_newton_takes_what_rounding_leaves_and_refuses_what_diverges():
    def evaluate(place, thorough):
        return Values(place**2 - 2.0, np.diag(2.0 * place))

    def linear(found, place):
        return found.matrix, -found.residual

    found = newton(evaluate, linear, np.array([1.0, 3.0]), 12)
    assert found.place == pytest.approx([math.sqrt(2.0)] * 2, abs=1e-15)
    assert newton(evaluate, linear, np.array([1.0, 3.0]), 2) is None
    assert newton(evaluate, linear, np.array([0.0, 1.0]), 12) is None
    assert newton(lambda place, thorough: None, linear, np.array([1.0]), 12) is None


@pytest.mark.parametrize("power", [0.5, 0.6, 1.0, 3.0])
def test_a_zero_is_located_from_the_side_on_which_the_function_is_a_power(power):
    """Beyond it the function says no more than its sign, and still few points are asked for."""
    zero, asked = 0.3712345678901234, []

    def value(point: Point) -> float:
        away = zero - float(point.place[0])
        asked.append(away)
        return away**power * (2.0 + away) if away > 0.0 else -1e-300

    line = Explicit(lambda place: place[1], lambda place: np.array([0.0, 1.0]))
    begin, end = (line.solve(np.array([x, 0.0]), np.array([1.0, 0.0])) for x in (0.0, 1.0))
    found = located(Function("border", value, 1e-12, one_sided=True), begin, end)
    # and never beyond, where other equations hold
    assert 0.0 <= zero - found.point.place[0] < 1e-12
    assert found.evidence.bracket < 2e-12
    assert len(asked) < 26  # bisection to this width takes 40


def test_a_zero_that_is_met_exactly_has_a_bracket_without_width():
    """The other places are far from it: rounding decides whether a value is 0 or next to it."""
    line = Explicit(lambda place: place[1], lambda place: np.array([0.0, 1.0]))
    begin, end = (line.solve(np.array([x, 0.0]), np.array([1.0, 0.0])) for x in (-1.0, 3.0))
    found = located(Function("line", lambda point: float(point.place[0])), begin, end)
    assert found.evidence.value == 0.0
    assert found.evidence.brackets == (0.0,)
    assert found.evidence.before * found.evidence.after < 0.0


def test_a_zero_is_located_to_rounding_where_rounding_moves_the_points_beside_it():
    """The last brackets are narrower than what rounding leaves of the unknowns: a point that lies
    off by this is on the curve.
    """

    def rounded(place: np.ndarray) -> float:
        return float(place[1] + 6e-14 * (int(place[0] * 2.0**53) // 2 % 2))

    line = Explicit(rounded, lambda place: np.array([0.0, 1.0]))
    begin, end = (line.solve(np.array([x, 0.0]), np.array([1.0, 0.0])) for x in (0.0, 1.0))
    for zero in np.linspace(0.1, 0.9, 57).tolist():
        found = located(
            Function(
                "zero", lambda point, at=zero: math.expm1(2.0 * (float(point.place[0]) - at)), 1e-15
            ),
            begin,
            end,
        )
        assert found is not None
        assert abs(found.point.place[0] - zero) < 1e-14


def test_a_zero_beside_which_rounding_leaves_no_more_points_is_in_the_bracket_of_the_last_two():
    """As beside a grazing of an orbit with an excursion of hardly any duration; a wider gap in a
    curve may hide another curve.
    """
    zero = 0.3
    for width, narrow in ((1e-9, True), (1e-4, False)):
        asked = list[float]()

        def broken(place: np.ndarray, width: float = width, asked: list[float] = asked) -> float:
            near = [x for x in asked if abs(x - zero) < width]
            asked.append(float(place[0]))
            return float(place[1] if not near or not min(near) < zero < max(near) else 1e-3)

        line = Explicit(broken, lambda place: np.array([0.0, 1.0]))
        begin, end = (line.solve(np.array([x, 0.0]), np.array([1.0, 0.0])) for x in (0.0, 1.0))
        found = located(
            Function("zero", lambda point: math.expm1(2.0 * (float(point.place[0]) - zero)), 1e-15),
            begin,
            end,
        )
        assert found is None or abs(found.point.place[0] - zero) < 2e-9
        assert (found is not None) == narrow


def test_a_corrector_that_goes_round_at_a_kink_is_given_up():
    """Newton's method jumps to and fro between both branches of 1 + abs(x), which has no zero,
    until it is told not to.
    """
    asked = []

    def kinked(place: np.ndarray) -> float:
        asked.append(place)
        return 1e-3 * (1.0 + abs(place[0] / 1e-3 - 0.5))

    curve = Explicit(kinked, lambda place: np.array([np.sign(place[0] / 1e-3 - 0.5), 0.0]))
    guess, along = np.array([0.0, 0.0]), np.array([0.0, 1.0])
    assert curve.solve_within(guess, along, 1.0) is None
    assert len(asked) <= 3
    asked.clear()
    assert curve.solve(guess, along) is None
    assert len(asked) == curve.iterations + 1
    asked.clear()
    assert curve.solve_within(guess, along, 1e-4) is None  # farther than it may go
    assert len(asked) == 1
