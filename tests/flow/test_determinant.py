"""The flow contracts areas by (product of the impacts' e^2) exp(-C [c T_lower / (1+m) + T_upper])
(numerics.md, section 5).
"""

import math

import numpy as np
import pytest
from shared_systems import forced

from saltus.flow import simulate

STEP = 1e-3
# Central differences of order 8: their error is of order STEP^8.
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
DURATION = 8.0


def end(system, state):
    motion = simulate(system, theta=state[0], velocity=state[1], duration=DURATION, tol=1e-15)
    return motion, np.array([motion.theta, motion.velocity])


def jacobian(system, state):
    """d(theta, theta')(T) / d(theta, theta')(0), and whether all the motions it needs have as many
    crossings.
    """
    columns, counts = [], set()
    for direction in np.eye(2):
        column = np.zeros(2)
        for n, weight in WEIGHTS.items():
            for sign in (1, -1):
                motion, value = end(system, state + sign * n * STEP * direction)
                column += sign * weight * value / STEP
                counts.add(len(motion.impacts))
        columns.append(column)
    return np.array(columns).T, len(counts) == 1


def random_case(rng):
    numbers = {
        "beta0": rng.uniform(0.6, 2.4),
        "C": rng.uniform(0.0, 0.3),
        "m": rng.uniform(0.0, 1.0),
        "k": rng.uniform(0.5, 2.0),
        "c": rng.uniform(0.0, 2.0),
        "V": rng.uniform(-0.8, 0.3),
        "H": rng.uniform(0.0, 0.8),
        "W": rng.uniform(0.6, 2.0),
        "e": rng.choice([1.0, rng.uniform(0.5, 1.0)]),
    }
    return numbers, np.array([rng.choice([-1, 1]) * rng.uniform(0.2, 1.0), rng.uniform(-0.7, 0.7)])


def predicted(numbers, motion):
    """From the crossing times and the sides between them."""
    bounds = np.concatenate([[0.0], motion.impacts.time, [DURATION]])
    sides = np.append(motion.impacts.side, motion.side)
    spent = {s: np.diff(bounds)[sides == s].sum() for s in (1, -1)}
    exponent = numbers["C"] * (numbers["c"] * spent[1] / (1 + numbers["m"]) + spent[-1])
    return numbers["e"] ** (2 * len(motion.impacts)) * math.exp(-exponent)


def test_the_determinant_of_the_flow_is_the_product_of_its_impacts_and_of_its_damping():
    rng, used, kinds = np.random.default_rng(11), 0, set()
    for _ in range(120):
        numbers, state = random_case(rng)
        system = forced(**numbers)
        motion, _ = end(system, state)
        speeds = np.abs(motion.impacts.velocity_before)
        # near a grazing the flow has no Taylor series of 8 STEP
        if len(motion.impacts) < 1 or speeds.min() < 0.15:
            continue
        matrix, smooth = jacobian(system, state)
        if not smooth or np.abs(matrix).max() > 20:
            continue
        # rounding of the end states, 1e-14 or so, over STEP and times the other entries
        assert np.linalg.det(matrix) == pytest.approx(
            predicted(numbers, motion), abs=1e-10 * (1 + np.abs(matrix).max() ** 2)
        )
        used += 1
        kinds.add((numbers["e"] < 1, len(motion.impacts)))
    assert used >= 30
    assert len(kinds) >= 6


def test_after_rest_the_determinant_is_zero():
    system = forced(e=0.3, H=0.25, W=0.05, C=0.3)
    states = [np.array([0.05, 0.0]), np.array([0.05 + STEP, 0.0]), np.array([0.05, STEP])]
    motions = [end(system, s)[0] for s in states]
    # rest, then release before the end
    assert all(any(e.kind == "rest" for e in m.events) and m.side != 0 for m in motions)
    ends = np.array([[m.theta, m.velocity] for m in motions])
    # over STEP, a derivative below 1e-12
    np.testing.assert_allclose(ends, ends[[0, 0, 0]], rtol=0, atol=1e-15)
