"""One expression in the place of several has the value of each where that one is chosen, and what
they share is there once.
"""

import math

import numpy as np
import pytest

from saltus.flow.contacts.one_free import CommonForm
from saltus.taylor.graph import Expr, differentiate, ordered, substitute

q, v, t = Expr("coordinate", (), 0), Expr("velocity", (), 0), Expr("time")
a, b, c = (Expr("parameter", (), i) for i in range(3))
FREE = [Expr("free", (), i) for i in range(3)]
CASES = {
    "angles on both sides": [
        a * np.sin(b + q) - c * v,
        b * np.sin(a - q) - v / c,
        np.cos(2 * a + q) * np.sin(a + b - q),
    ],
    "products of sums": [
        (a + np.sin(c * t)) * np.sin(b + q) * v * v,
        np.cos(t) * np.sin(b - q),
        (q + v) * (q - v) / (1 + q * q),
    ],
    "constants among them": [a + 0 * q, q / b, np.sin(a) * np.cos(b)],
    "functions": [
        np.exp(-a * q) * np.sqrt(2 + q * q),
        np.exp(b * v) - 3,
        (2 + q) ** 1.5 / (3 + np.tanh(v)),
    ],
    "of one kind twice": [
        np.exp(q) * 2 + a * np.exp(v + q) - np.exp(2 * q + v),
        np.exp(b * q),
        np.exp(v + a) - np.exp(v - q),
    ],
}


def value(root, leaves):
    """An expression's value: with all leaves replaced by numbers it is one."""
    return substitute(root, leaves).value


def leaves(rng, chosen):
    numbers = {q: rng.uniform(-0.9, 0.9), v: rng.uniform(-0.9, 0.9), t: rng.uniform(-0.9, 0.9)}
    return (
        numbers
        | dict(zip((a, b, c), rng.uniform(0.3, 1.5, 3), strict=True))
        | {f: float(f.value == chosen) for f in FREE}
    )


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("chosen", range(3))
def test_the_common_form_has_the_value_of_what_is_chosen(name, chosen):
    rng, common = np.random.default_rng(3), CommonForm(FREE).of(CASES[name])
    for _ in range(20):
        at = leaves(rng, chosen)
        expected = value(CASES[name][chosen], at)
        assert abs(value(common, at) - expected) < 1e-13 * max(1.0, abs(expected))


def test_angles_that_differ_by_constants_share_one_sine_and_one_cosine():
    common = CommonForm(FREE[:2]).of(
        [np.sin(a + q) * b + np.cos(2 * a + q), c * np.cos(b - q) - np.sin(c - q)]
    )
    functions = [
        node for node in ordered([common]) if node.op in ("sin", "cos") and node.degree is None
    ]
    assert {node.args[0] for node in functions} == {q}
    assert len(functions) == 2


def test_the_integral_of_sines_and_cosines_is_one():
    form, rng = CommonForm(FREE), np.random.default_rng(5)
    integrand = a * np.cos(2 * b - q) - np.sin(q + c) / b + 3.0
    integral = form.integral(integrand, q)
    for _ in range(20):
        at = leaves(rng, 0)
        assert math.isclose(
            value(differentiate(integral, q), at), value(integrand, at), abs_tol=1e-14
        )
    assert form.integral(np.cos(2 * q), q) is None
    assert form.integral(np.cos(q) * v, q) is None
