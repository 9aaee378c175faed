"""Interval bounds of traced expressions: they hold for every value of the leaves, and are no wider
than they need to be.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.bounds.intervals import Interval, enclose
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.taylor.graph import Expr, combine, power
from saltus.taylor.tracing import trace

LEAVES = [Expr("coordinate", (), 0), Expr("velocity", (), 0), Expr("time")]
ONE_OPERAND = ("sin", "cos", "exp", "tanh", "sinh", "cosh", "sqrt", "log")
UNDERFLOW = mp.mpf("1e-300")  # what the bounds leave out
TWO_OPERANDS = ("add", "sub", "mul", "div", "maximum", "minimum")
NOTHING = mp.mpc(0, 1)  # stands for no value
MPMATH = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y if y else NOTHING,
    "maximum": lambda x, y: x + y if isinstance(x + y, mp.mpc) else max(x, y),
    "minimum": lambda x, y: x + y if isinstance(x + y, mp.mpc) else min(x, y),
    # what has no value is not greater
    "greater": lambda x, y: mp.mpf(not isinstance(x + y, mp.mpc) and x > y),
    "less_equal": lambda x, y: mp.mpf(x <= y),
    "pow": mp.power,
} | {name: getattr(mp, name) for name in ONE_OPERAND}


def exactly(node, values):
    """The expression at one point, to 40 digits; of `where` only the branch that is taken, as the
    other may have no value.
    """
    if node.op == "number":
        return mp.mpf(node.value)
    if not node.args:
        return values[LEAVES.index(node)]
    if node.op == "where":
        return exactly(node.args[1 if exactly(node.args[0], values) else 2], values)
    return MPMATH[node.op](*(exactly(a, values) for a in node.args))


def graphs():
    numbers = st.floats(-3, 3).map(lambda x: Expr("number", (), float(x)))
    leaf = st.integers(0, 2).map(lambda i: LEAVES[i]) | numbers

    def grow(below):
        one = st.builds(lambda op, x: combine(op, x), st.sampled_from(ONE_OPERAND), below)
        two = st.builds(
            lambda op, x, y: combine(op, x, y), st.sampled_from(TWO_OPERANDS), below, below
        )
        chosen = st.builds(
            lambda x, y, a, b: combine("where", combine("greater", x, y), a, b),
            below,
            below,
            below,
            below,
        )
        return one | two | chosen | st.builds(lambda x, n: power(x, n), below, st.integers(-2, 4))

    return st.recursive(leaf, grow, max_leaves=12)


ranges = st.tuples(st.floats(-4, 4), st.sampled_from([0.0, 1e-9, 0.01, 0.5, 3.0]))


@settings(deadline=None, max_examples=150)
@given(graphs(), st.tuples(ranges, ranges, ranges), st.integers(0, 2**32 - 1))
def test_bounds_hold_at_every_point(root, boxes, seed):
    spans = {
        leaf: Interval(lo, lo + width) for leaf, (lo, width) in zip(LEAVES, boxes, strict=True)
    }
    (bounds,) = enclose([root], spans.__getitem__)
    fractions = np.vstack([np.zeros(3), np.ones(3), np.random.default_rng(seed).random((6, 3))])
    if not (np.isfinite(bounds.lo) and np.isfinite(bounds.hi)):
        return
    with mp.workdps(40):
        low, high = mp.mpf(float(bounds.lo)) - UNDERFLOW, mp.mpf(float(bounds.hi)) + UNDERFLOW
        for x in fractions:
            ends = [(mp.mpf(float(s.lo)), mp.mpf(float(s.hi))) for s in spans.values()]
            values = [lo + mp.mpf(f) * (hi - lo) for (lo, hi), f in zip(ends, x, strict=True)]
            value = exactly(root, values)
            assert not isinstance(value, mp.mpc)
            assert low <= value <= high


@pytest.mark.parametrize("op", ONE_OPERAND)
def test_a_point_has_tight_bounds_on_both_sides_of_its_value(op):
    for x in (0.3, 1.7, 2.9, 5.5):
        (bounds,) = enclose([combine(op, LEAVES[0])], lambda _, x=x: Interval(x))
        value = float(getattr(mp, op)(mp.mpf(x)))
        assert bounds.lo <= value <= bounds.hi
        assert bounds.hi - bounds.lo <= 1e-13 * max(1.0, abs(value))


@pytest.mark.parametrize(("op", "function"), [("sin", np.sin), ("cos", np.cos), ("cosh", np.cosh)])
def test_the_range_of_a_function_that_turns_is_its_range(op, function):
    rng = np.random.default_rng(3)
    lo = rng.uniform(-20, 20, 300) if op != "cosh" else rng.uniform(-2, 2, 300)
    hi = lo + rng.uniform(0, 8 if op != "cosh" else 3, 300)
    (bounds,) = enclose([combine(op, LEAVES[0])], lambda _: Interval(lo, hi))
    samples = function(np.linspace(lo, hi, 20001))
    assert (bounds.lo <= samples.min(axis=0)).all()
    assert (bounds.hi >= samples.max(axis=0)).all()
    assert bounds.lo == pytest.approx(samples.min(axis=0), abs=1e-6)
    assert bounds.hi == pytest.approx(samples.max(axis=0), abs=1e-6)


def test_a_square_is_never_negative():
    x = LEAVES[0]
    (square,) = enclose([x * x], lambda _: Interval(-1.0, 2.0))
    assert square.lo == 0.0
    assert 4.0 <= square.hi < 4.0 + 1e-14


def test_what_is_multiplied_by_zero_is_exactly_zero():
    x, y, _ = LEAVES
    spans = {x: Interval(0.0), y: Interval(-1e6, 1e6)}
    (bounds,) = enclose([x * combine("sin", y) * 3.7 + x / 0.3], spans.__getitem__)
    assert bounds.lo == bounds.hi == 0.0


@pytest.mark.parametrize(
    ("root", "lo", "hi"),
    [
        (combine("sqrt", LEAVES[0]), -1.0, 1.0),
        (combine("log", LEAVES[0]), -1.0, 1.0),
        (1.0 / LEAVES[0], -1.0, 1.0),
        (1.0 / LEAVES[0], 0.0, 1.0),
        (power(LEAVES[0], 1.5), -0.1, 1.0),
    ],
)
def test_outside_its_domain_an_operation_proves_nothing(root, lo, hi):
    (bounds,) = enclose([root], lambda _: Interval(lo, hi))
    assert not (bounds.lo > -1e300 and bounds.hi < 1e300)


@pytest.mark.parametrize("op", ["sin", "cos", "exp", "tanh", "cosh"])
def test_what_is_made_of_nothing_known_is_not_known(op):
    x = LEAVES[0]
    for root in (
        combine(op, combine("sqrt", x)),
        combine(op, combine("log", x)),
        combine(op, 1.0 / x) + x,
    ):
        (bounds,) = enclose([root], lambda _: Interval(-1.0, 1.0))
        assert np.isnan(bounds.lo)
        assert np.isnan(bounds.hi)


def test_powers_with_an_exponent_that_is_not_whole_are_bounded():
    (bounds,) = enclose(
        [power(LEAVES[0], 1.5)], lambda _: Interval(np.array([0.0, 0.25]), np.array([1.0, 4.0]))
    )
    assert bounds.lo == pytest.approx([0.0, 0.125], rel=1e-13)
    assert bounds.hi == pytest.approx([1.0, 8.0], rel=1e-13)


def test_a_comparison_that_is_open_leaves_both_branches_and_a_closed_one_its_own():
    x, y, _ = LEAVES
    root = combine("where", combine("greater", x, 0.5), y, -y)
    spans = {
        x: Interval(np.array([0.6, 0.0, 0.0]), np.array([1.0, 0.5, 1.0])),
        y: Interval(2.0, 3.0),
    }
    (bounds,) = enclose([root], spans.__getitem__)
    assert bounds.lo == pytest.approx([2.0, -3.0, -3.0], rel=1e-15)
    assert bounds.hi == pytest.approx([3.0, -2.0, 3.0], rel=1e-15)


def test_the_bounds_of_a_model_hold_its_accelerations():
    """Sampled through the model's own numbers, over boxes of time, state and parameters at once."""
    rng = np.random.default_rng(8)
    load = Load(
        frequency=1.0,
        horizontal=Harmonic(0.3, phase=0.4) + Harmonic(0.1, order=3),
        vertical=-0.5,
        ground_vertical=Harmonic(0.02),
    )
    system = System(
        model=Metainterface(beta0=1.3, damping=0.1, mass_ratio=0.3, stiffness_ratio=1.2), load=load
    )
    traced, (root,) = trace(system), trace(system).acceleration
    low = np.array(list(system.parameters.values()))
    low[traced.parameters.index("load.frequency")] = 1.7
    for side in (1, -1):
        centre = np.array([0.4 * side, 0.2, 2.0])
        width = rng.uniform(0, 0.3, (200, 3))
        parts = {
            LEAVES[i]: Interval(centre[i] - width[:, i], centre[i] + width[:, i]) for i in range(3)
        }
        (bounds,) = enclose([root], lambda n, parts=parts, side=side: _leaf(n, parts, side, low))
        point = centre + rng.uniform(-1, 1, (200, 3)) * width
        moved = system.with_({"load.frequency": 1.7})
        values = moved.model.acceleration(point[:, 2], point[:, 0], point[:, 1], side, moved.load)
        assert (bounds.lo <= values + 1e-14).all()
        assert (bounds.hi >= values - 1e-14).all()
        assert np.median(bounds.hi - bounds.lo) < 2.0


def _leaf(node, parts, side, numbers):
    if node.op == "parameter":
        return Interval(numbers[node.value])
    return Interval(float(side)) if node.op == "side" else parts[node]


def test_a_turn_of_many_periods_is_no_turn():
    (bounds,) = enclose(
        [combine("sin", LEAVES[0])], lambda _: Interval(100 * math.pi + 0.1, 100 * math.pi + 0.2)
    )
    assert bounds.lo == pytest.approx(math.sin(0.1), rel=1e-9)
    assert bounds.hi == pytest.approx(math.sin(0.2), rel=1e-9)
