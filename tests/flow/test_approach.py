"""Where motions are going: exact for linear maps, quadratic in the distance for others, nothing
where no orbit is stable.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from saltus.flow import approached, find_recurrence, simulate_many
from saltus.systems import Harmonic, Load, Metainterface, System

POINT = np.array([0.3, -0.7])


def iterated(step, start, count):
    """(1, count, 2): the states of a map."""
    states = [np.asarray(start, dtype=float)]
    for _ in range(count - 1):
        states.append(np.asarray(step(states[-1]), dtype=float))
    return np.array(states)[None]


def spiral(radius, angle):
    """The matrix of a rotation that shrinks, in skew axes."""
    axes = np.array([[1.0, 0.4], [0.0, 0.8]])
    turn = radius * np.array(
        [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    )
    return axes @ turn @ np.linalg.inv(axes)


@pytest.mark.parametrize(
    "matrix",
    [
        spiral(0.93, 2.1),
        spiral(0.2, 0.3),
        np.diag([0.9, -0.4]),
        np.diag([0.9, 0.0]),
        np.array([[0.5, 1.0], [0.0, 0.5]]),
    ],
    ids=["slow spiral", "fast spiral", "node", "singular", "Jordan block"],
)
def test_the_fixed_point_of_a_linear_map_is_found_from_five_states(matrix):
    states = iterated(lambda s: POINT + matrix @ (s - POINT), POINT + np.array([0.02, 0.03]), 5)
    limit, period = approached(states, 1)
    assert period[0] == 1
    assert limit[0] == pytest.approx(POINT, abs=1e-12)


def test_an_orbit_of_two_periods_is_approached_at_the_last_state():
    other, matrix = np.array([-0.4, 0.1]), spiral(0.8, 1.0)
    around = iterated(lambda s: matrix @ s, [0.02, 0.01], 9)[0]
    states = np.where(np.arange(9)[:, None] % 2 == 0, POINT, other) + around
    limit, period = approached(states[None], 2)
    assert period[0] == 2
    assert limit[0] == pytest.approx(POINT, abs=1e-10)


def test_of_a_map_that_bends_the_error_falls_with_the_square_of_the_distance():
    def step(s):
        x, v = s - POINT
        return POINT + np.array([0.6 * x - 0.5 * v + x * x, 0.4 * x + 0.5 * v - x * v])

    errors = []
    for size in (1e-2, 1e-3, 1e-4):
        limit, period = approached(iterated(step, POINT + np.array([size, 0.7 * size]), 5), 1)
        assert period[0] == 1
        errors.append(np.abs(limit[0] - POINT).max())
    assert errors[1] / errors[0] == pytest.approx(1e-2, rel=0.3)
    assert errors[2] / errors[1] == pytest.approx(1e-2, rel=0.3)


@pytest.mark.parametrize(
    "matrix", [np.diag([0.5, 1.001]), np.diag([0.3, -1.2]), spiral(0.99, 1.0), spiral(1.1, 0.4)]
)
def test_what_is_not_surely_stable_is_left_where_it_is(matrix):
    states = iterated(lambda s: POINT + matrix @ (s - POINT), POINT + np.array([0.01, 0.01]), 9)
    limit, period = approached(states, 2)
    assert period[0] == 0
    assert np.array_equal(limit[0], states[0, -1])


def test_a_long_way_and_too_few_states_are_left_alone():
    far = iterated(
        lambda s: POINT + spiral(0.9, 0.2) @ (s - POINT), POINT + np.array([3.0, 4.0]), 5
    )
    few = iterated(
        lambda s: POINT + spiral(0.5, 0.2) @ (s - POINT), POINT + np.array([0.02, 0.01]), 4
    )
    for states in (far, few, np.full((1, 9, 2), np.nan)):
        limit, period = approached(states, 2)
        assert period[0] == 0
        assert np.array_equal(limit[0], states[0, -1], equal_nan=True)


def test_chaos_is_hardly_ever_taken_for_an_approach():
    states = iterated(lambda s: [1.0 - 1.4 * s[0] ** 2 + s[1], 0.3 * s[0]], [0.1, 0.1], 20_000)[
        0, 100:
    ]
    windows = np.lib.stride_tricks.sliding_window_view(states, 9, axis=0).transpose(0, 2, 1)
    _, period = approached(windows, 2)
    assert (period > 0).mean() < 1e-3  # Hénon's map has no stable orbit here


def test_the_orbit_of_a_cell_is_where_its_motion_is_going():
    system = System(
        model=Metainterface(beta0=math.radians(80.0), damping=0.1),
        load=Load(frequency=4.0, horizontal=Harmonic(amplitude=0.05), vertical=-1.5),
    )
    start = np.array([[1.3, 0.0]])
    early = find_recurrence(system, start, 60, kept=9)
    late = find_recurrence(system, start, 2000)
    limit, period = approached(early.states, 2)
    assert not early.periodic[0]
    assert late.period[0] == period[0] == 1
    before, after = (np.abs(state - late.last).max() for state in (early.last, limit))
    assert after < 0.02 * before
    assert simulate_many(system, theta=limit[:, 0], velocity=limit[:, 1], periods=1)[
        "theta"
    ].values == pytest.approx(late.last[:, 0], abs=0.02 * before)
