"""Equality of traced expressions: proved in exact arithmetic by identities of algebra, and never
claimed of what differs.
"""

import numpy as np
import pytest

from saltus.taylor.exact_algebra import NoNormalForm, constant, constant_value, normal_form
from saltus.taylor.graph import Expr, combine, number, substitute

X, V, P, Q = (
    Expr("coordinate", (), 0),
    Expr("velocity", (), 0),
    Expr("parameter", (), 0),
    Expr("parameter", (), 1),
)


def provably_equal(one, other, leaves=None):
    """Whether two expressions have one normal form; False where one has none."""
    try:
        return normal_form(one, leaves) == normal_form(other, leaves)
    except NoNormalForm:
        return False


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((X + V) * (X - V), X * X - V * V),
        (P * Q - (P - Q) * X - Q * P, (Q - P) * X),
        (np.sin(P - X), -np.sin(X - P)),
        (np.cosh(P - X) * np.tanh(V - X), -np.cosh(X - P) * np.tanh(X - V)),
        (X / (2 * (P + Q)), 0.5 * X / (Q + P)),
        (X * P / P, X),
        (np.sin(X - X) + np.exp(V - V), X / X),
        ((X + 1) ** 3, X**3 + 3 * X**2 + 3 * X + 1),
        (0.1 * X + 0.2 * X, (number(0.1) + 0) * X + 0.2 * X),
    ],
)
def test_identities_of_algebra_are_proved(one, other):
    assert provably_equal(one, other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (X * X, X),
        (0.1 * X + 0.2 * X, 0.3 * X),  # the doubles 0.1 + 0.2 and 0.3 differ by 2^-54
        (X + 1e-300, X),
        (np.sin(X), X),
        (np.sin(P - X), np.sin(X - P)),
        (np.exp(-X), np.exp(X)),
        (X / 0.0, X / 0.0),  # no number: nothing is proved
        (X - X**3, X),
    ],
)
def test_what_differs_is_not_proved_equal(one, other):
    assert not provably_equal(one, other)


def test_leaves_are_replaced_by_exact_numbers():
    known = {P: constant(0.1), Q: constant(-0.1)}
    assert provably_equal(X * (P + Q), number(0.0), known)
    assert not provably_equal(X * (P + Q), number(0.0), {P: constant(0.1)})
    assert constant_value(normal_form(P * Q + 1, {P: constant(0.5), Q: constant(4.0)})) == 3
    assert constant_value(normal_form(P * X, {P: constant(0.5)})) is None


LEAVES = [X, V, P, *map(number, (0.0, 1.0, -1.0, 0.5, 2.0))]
FUNCTIONS = [np.sin, np.cos, np.tanh, np.exp, np.arctan]


def random_expression(rng, depth):
    if depth == 0 or rng.random() < 0.2:
        return LEAVES[rng.integers(len(LEAVES))]
    if rng.random() < 0.3:
        return FUNCTIONS[rng.integers(len(FUNCTIONS))](random_expression(rng, depth - 1))
    operation = ("add", "sub", "mul", "div")[rng.integers(4)]
    return combine(operation, random_expression(rng, depth - 1), random_expression(rng, depth - 1))


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in range(2, 8))]
)
def test_what_is_proved_equal_has_equal_values(seed):
    """Random pairs of small expressions, and each with its own terms turned round, at a point."""
    rng, at, proved = np.random.default_rng(seed), {X: 0.37, V: -1.21, P: 0.83}, 0
    for _ in range(300):
        one, other = (random_expression(rng, 3) for _ in range(2))
        pairs = [
            (one, other),
            (one * (other - 1), other * one - one),
            (one - other, -(other - one)),
            (one / 2 + one / 2, one),
        ]
        for a, b in pairs:
            first, second = (substitute(combine("add", e, 0.0), at).value for e in (a, b))
            if provably_equal(a, b) and np.isfinite(first) and np.isfinite(second):
                proved += 1
                assert first == pytest.approx(second, rel=1e-9, abs=1e-9 * (1 + abs(first)))
    assert proved > 500
