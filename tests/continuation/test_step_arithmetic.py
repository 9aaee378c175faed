"""The compiled arithmetic of a step, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_continuation import Explicit

from saltus.continuation import arithmetic
from saltus.continuation.step_arithmetic import as_floats

ALL = np.ones(3, dtype=bool)


def newton_step(matrix, right, units, scaled, longest=math.inf, bounded=ALL):
    """The step from a place of ones, and its largest component."""
    step = np.empty(3)
    moved = arithmetic().newton_step(
        *as_floats(matrix, right, np.ones(3), units), bounded, scaled, longest, step
    )
    return step, moved


# a matrix that needs its rows exchanged, with a solution in whole numbers
MATRIX = np.array([[0.0, 2.0, 1.0], [1.0, 1.0, 1.0], [4.0, -2.0, 3.0]])
SOLUTION = np.array([1.0, -2.0, 5.0])


def test_a_step_solves_its_equations_and_is_shortened():
    step, moved = newton_step(MATRIX, MATRIX @ SOLUTION, np.ones(3), False)
    assert step == pytest.approx(SOLUTION, abs=1e-14)
    assert moved == pytest.approx(5.0)
    step, moved = newton_step(MATRIX, MATRIX @ SOLUTION, np.ones(3), False, longest=1.0)
    assert step == pytest.approx(SOLUTION / 5.0, abs=1e-15)
    assert moved == pytest.approx(1.0)


def test_a_step_in_units_does_not_depend_on_them():
    """Powers of two change no digit."""
    units = 2.0 ** np.array([40, -30, 3])
    rows = 2.0 ** np.array([-50, 20, 0])
    plain, _ = newton_step(MATRIX, MATRIX @ SOLUTION, np.ones(3), True)
    matrix = rows[:, None] * MATRIX / units
    step, moved = newton_step(matrix, rows * (MATRIX @ SOLUTION), units, True)
    assert (step == plain * units).all()
    assert moved == pytest.approx(5.0)


def test_unknowns_without_a_bound_may_move_by_as_much_as_the_largest_is():
    bounded = np.array([True, False, False])
    step = np.empty(3)
    place = np.array([0.0, 0.0, 10.0])
    numbers = (MATRIX, MATRIX @ SOLUTION, place, np.ones(3), bounded, False, 1.0, step)
    arithmetic().newton_step(*numbers)
    assert step == pytest.approx(SOLUTION, abs=1e-14)  # 5 of 10, and 1 that is bounded


def test_singular_equations_have_no_step():
    matrix = np.ones((3, 3))
    for scaled in (False, True):
        assert math.isnan(newton_step(matrix, np.ones(3), np.ones(3), scaled)[1])
        assert math.isnan(newton_step(MATRIX * math.nan, np.ones(3), np.ones(3), scaled)[1])
    assert arithmetic().scaled_determinant(np.zeros((2, 2)), np.ones(2)) == 0.0


def test_many_small_pivots_are_no_singular_matrix():
    """Their product is 0, as of equations in small units, and the matrix is not singular."""
    count = 160
    step = np.empty(count)
    solution = np.linspace(1.0, 2.0, count)
    ones = np.ones(count)
    numbers = (1e-3 * np.eye(count), 1e-3 * solution, ones, ones, ones > 0.0, False, 10.0, step)
    assert arithmetic().newton_step(*numbers) == pytest.approx(2.0)
    assert step == pytest.approx(solution, rel=1e-14)


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def test_maps_of_segments_are_multiplied():
    """Rotations about angles that add up, each given by equations in other units."""
    angles = [0.3, 1.1, -0.4]
    there = np.array([np.diag([2.0, 5.0]) @ rotation(angle) for angle in (0.2, 0.7, 1.9)])
    here = -there @ np.array([rotation(angle) for angle in angles])
    product = np.empty((2, 2))
    assert arithmetic().product_of_maps(here, there, product)
    assert product == pytest.approx(rotation(sum(angles)), abs=1e-15)
    assert arithmetic().product_of_areas(here, 2.0 * there) == pytest.approx(0.25**3)
    there[1] = 0.0
    assert not arithmetic().product_of_maps(here, there, product)


@pytest.mark.parametrize("count", [1, 2, 6])
def test_blocks_lie_where_the_unknowns_of_their_segments_do(count):
    here, there = np.arange(8.0 * count).reshape(2, count, 2, 2)
    matrix = np.zeros((2 * count, 2 * count + 1))
    arithmetic().fill_blocks(here, there, -1.0, matrix)
    unknowns = np.arange(1.0, 2.0 * count + 1.0).reshape(count, 2)
    later = np.roll(unknowns, -1, axis=0)
    later[-1] *= -1.0
    expected = np.einsum("sij,sj->si", here, unknowns) + np.einsum("sij,sj->si", there, later)
    assert (matrix[:, :-1] @ unknowns.ravel() == expected.ravel()).all()
    assert not matrix[:, -1].any()


def test_a_determinant_has_rows_of_length_one_in_units():
    one, other = 0.3, 1.7
    units = np.array([1e-3, 1e5])
    rows = np.array([[math.cos(one), math.sin(one)], [math.cos(other), math.sin(other)]])
    matrix = np.diag([1e-8, 7.0]) @ rows / units
    found = arithmetic().scaled_determinant(matrix, units)
    assert found == pytest.approx(math.sin(other - one), rel=1e-13)


def test_the_arc_of_a_circle_is_its_angle():
    def on_circle(angle):
        return np.array([math.cos(angle), math.sin(angle)])

    for angle in (0.1, 0.05):
        arc = arithmetic().arc_length(
            np.ones(2), on_circle(0.0), on_circle(0.5 * math.pi), on_circle(angle),
            on_circle(0.5 * math.pi + angle),
        )  # fmt: skip
        assert arc == pytest.approx(angle, abs=0.1 * angle**5)
        assert arc != pytest.approx(angle, abs=1e-4 * angle**5)


def look(begin, end, near=(), arcs=()):
    values = np.array(near, dtype=float).reshape(len(near), 1)
    given = np.array([begin]), np.array([end]), values, np.array([0.0, 1.0, *arcs])
    return arithmetic().where_to_look(*given, 1.0, 0.1, 17)


def test_two_zeros_that_the_values_at_both_ends_hide_are_looked_for():
    def dips(x):
        return (x - 0.5) ** 2 - 0.01

    near = [dips(-0.5), dips(1.5)]
    assert look(dips(0.0), dips(1.0), near, (-0.5, 1.5)) == pytest.approx(0.5)
    assert math.isnan(look(1.0, 2.0, [0.0, 3.0], (-1.0, 2.0)))  # a straight line
    assert math.isnan(look(1.0, -1.0))  # which shows its only zero
    # the parabola through three points is not certain, and has its least value halfway
    assert look(0.1, 0.1, [2.1], (-1.0,)) == pytest.approx(0.5)
    assert math.isnan(look(math.nan, 1.0))
    assert math.isnan(look(math.inf, 1.0))


def test_values_are_expected_on_the_parabola_through_the_last_three():
    arcs = np.array([0.0, 0.4, 1.0])
    values = np.array([[2.0 * x * x - x + 3.0, 1.0] for x in arcs])

    def is_expected(value, *guides):
        found = np.array([value, 100.0])
        return arithmetic().is_expected(values, arcs, found, 1.5, np.array(guides), 0.5)

    assert is_expected(6.0, True, False)  # the parabola's value there
    assert is_expected(11.9, True, False)
    assert not is_expected(12.1, True, False)
    assert not is_expected(6.0, True, True)  # the second function is no constant
    assert not is_expected(math.nan, True, False)


def test_equations_may_be_given_in_whole_numbers():
    """Compiled code would take them for floats of the same bits."""
    line = Explicit(lambda z: z[1] - 2 * z[0], lambda z: np.array([-2, 1]))
    point = line.solve(np.array([1, 3]), np.array([1, 0]))
    assert point.place == pytest.approx([1.0, 2.0], abs=1e-15)
    assert point.tangent == pytest.approx(np.array([1.0, 2.0]) / math.sqrt(5.0), abs=1e-15)
    (floats,) = as_floats(np.array([3, 4]))
    assert floats.tolist() == [3.0, 4.0]
