"""The tangent's expressions, evaluated as they stand, against differences of the jump that they
linearise.
"""

import math

import numpy as np
import pytest
from generated_functions import Generated
from shared_systems import paired

from saltus.flow.kernel.event_derivatives import saltation
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.systems.serial import numbers
from saltus.taylor import record_table, trace
from saltus.taylor.graph import Expr, differentiate, ordered

WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # central differences of order 8
STEP = 2e-3
COMPARE = {
    "greater": np.greater,
    "less": np.less,
    "greater_equal": np.greater_equal,
    "less_equal": np.less_equal,
}
NUMPY = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "pow": np.power,
    **COMPARE,
}


def value(root, leaves):
    """An expression's number, node by node with NumPy; `leaves` gives (operation, index) or
    (operation) its number.
    """
    made = {}
    for node in ordered([root]):
        if node.op == "number":
            made[node] = node.value
        elif not node.args:
            made[node] = leaves[node.op] if node.value is None else leaves[node.op, node.value]
        elif node.op == "where":
            condition, yes, no = (made[a] for a in node.args)
            made[node] = yes if condition else no
        else:
            made[node] = NUMPY.get(node.op, getattr(np, node.op, None))(
                *(made[a] for a in node.args)
            )
    return float(made[root])


def difference(function):
    return sum(w * (function(n * STEP) - function(-n * STEP)) for n, w in WEIGHTS.items()) / STEP


LAYERS = System(
    model=Metainterface(
        beta0=1.3, damping=0.2, mass_ratio=0.4, stiffness_ratio=0.8, dissipation_ratio=1.3
    ),
    load=Load(
        frequency=0.9,
        horizontal=Harmonic(0.4, phase=0.3),
        vertical=-0.5,
        ground_horizontal=Harmonic(0.1),
        ground_vertical=Harmonic(0.05, phase=1.0),
    ),
    impact=EnergyRestitution(0.9),
)
WALL = System(
    model=WallOscillator(stiffness=1.2, damping=0.1, wall=0.7),
    load=Load(frequency=1.7, force=Harmonic(0.9)),
    impact=VelocityReduction(0.8),
)
BLOCK = System(
    model=RockingBlock(alpha=0.3),
    load=Load(frequency=2.0, ground_horizontal=Harmonic(0.2)),
    impact=VelocityReduction(0.9),
)
CASES = {
    "layers": (
        LAYERS,
        1,
        -0.9,
        (
            "load.frequency",
            "model.beta0",
            "model.mass_ratio",
            "impact.r",
            "load.ground_vertical.phase",
        ),
    ),
    "layers from above": (LAYERS, -1, 0.9, ("load.frequency", "model.beta0", "model.damping")),
    "wall": (WALL, 1, 0.6, ("load.frequency", "model.wall", "model.stiffness", "impact.e")),
    "block": (BLOCK, -1, 0.5, ("load.frequency", "model.alpha", "impact.e")),
}


def jump(system, side, t, state):
    """A state near an impact on the old side's arc, carried to the impact, through it and back to
    `t` on the new side's arc.

    To first order in the distance from the impact an arc is one of constant acceleration, that at
    the impact.
    """
    model, load = system.model, system.load
    q, v = state
    contact = float(model.contact)
    old = model.acceleration(t, contact, v, side, load)
    tau = (contact - q) / v
    for _ in range(40):
        tau = (contact - q - old * tau * tau / 2) / v
    before = v + old * tau
    turned, after = model.reset(t + tau, before, side, load, system.impact)
    new = model.acceleration(t, contact, after, turned, load)
    return np.array([contact - after * tau + new * tau * tau / 2, after - new * tau, tau])


def columns(system, side, t, before, paths):
    """By differences of `jump`: to the coordinate, to the velocity, to each number."""
    contact = float(system.model.contact)
    yield difference(lambda d: jump(system, side, t, (contact + d, before)))
    yield difference(lambda d: jump(system, side, t, (contact, before + d)))
    for path in paths:
        yield difference(
            lambda d, p=path: jump(system.with_({p: system.get(p) + d}), side, t, (contact, before))
        )


@pytest.mark.parametrize("name", CASES)
def test_the_saltation_is_the_derivative_of_the_jump(name):
    system, side, before, paths = CASES[name]
    t, period = 2.3, 2 * math.pi / system.load.frequency
    traced = trace(system, (), paths)
    assert (traced.dof, traced.columns) == (1, 2 + len(paths))
    jumps = saltation(traced)
    origin = 3 * period  # the kernel's time is t - origin
    leaves = {("parameter", i): x for i, (_, x) in enumerate(numbers(system))}
    leaves |= {"time": t - origin, "origin": origin, "side": float(side), ("velocity", 0): before}
    for j, expected in enumerate(columns(system, side, t, before, paths)):
        (u,), (z,) = traced.tangent_leaves(j)
        start = {("coordinate", u.value): float(j == 0), ("velocity", z.value): float(j == 1)}
        computed = [
            value(part[j], leaves | start)
            for part in (jumps.coordinate, jumps.velocity, jumps.shift)
        ]
        np.testing.assert_allclose(computed, expected, rtol=1e-9, atol=1e-9, err_msg=f"column {j}")


@pytest.mark.parametrize("name", ["layers", "wall", "block"])
def test_the_determinant_of_the_saltation_is_that_of_the_law(name):
    system, side, before, _ = CASES[name]
    if name == "wall":  # the point of contact does not move: it is no parameter here
        system = system.with_({"model.wall": 0.0})
    traced = trace(system, (), ())
    jumps = saltation(traced)
    leaves = {("parameter", i): x for i, (_, x) in enumerate(numbers(system))}
    leaves |= {"time": 0.4, "origin": 0.0, "side": float(side), ("velocity", 0): before}
    matrix = np.zeros((2, 2))
    for j in (0, 1):
        (u,), (z,) = traced.tangent_leaves(j)
        start = leaves | {
            ("coordinate", u.value): float(j == 0),
            ("velocity", z.value): float(j == 1),
        }
        matrix[:, j] = value(jumps.coordinate[j], start), value(jumps.velocity[j], start)
    after = system.model.reset(0.4, before, side, system.load, system.impact)[1]
    slope = difference(
        lambda d: np.float64(
            system.model.reset(0.4, before + d, side, system.load, system.impact)[1]
        )
    )
    assert np.linalg.det(matrix) == pytest.approx(slope * after / before, rel=1e-10)


def test_the_series_of_the_columns_are_those_of_the_differences():
    """Of two coordinates: the Taylor coefficients of u are the derivatives of the coordinates'
    coefficients.
    """
    system = paired(0.3, 0.9)
    position, velocity, order = np.array([0.3, -0.5]), np.array([0.7, 0.2]), 8
    own = Generated(system)
    extended = Generated(system, sensitivities=())
    u, z = np.eye(4)[:, :2].ravel(), np.eye(4)[:, 2:].ravel()
    computed = extended.coefficients(0.4, [*position, *u], [*velocity, *z], order)
    np.testing.assert_array_equal(computed[:2], own.coefficients(0.4, position, velocity, order))
    for j in range(4):
        dq, dv = np.eye(4)[j, :2], np.eye(4)[j, 2:]
        expected = difference(
            lambda d, dq=dq, dv=dv: own.coefficients(
                0.4, position + d * dq, velocity + d * dv, order
            )
        )
        np.testing.assert_allclose(computed[2 + 2 * j : 4 + 2 * j], expected, rtol=1e-8, atol=1e-8)


def test_the_rate_of_a_record_is_its_next_row():
    record = Record(np.linspace(0.0, 4.0, 9), np.cos(np.linspace(0.0, 4.0, 9)), quantity="velocity")
    system = System(
        model=Metainterface(beta0=1.3), load=Load(ground_horizontal=record, vertical=-0.5)
    )
    traced = trace(system, (), ())
    assert traced.records == [("load.ground_horizontal", 2), ("load.ground_horizontal", 3)]
    breaks, table = record_table(system, traced.records)
    for piece in range(1, breaks.size):
        spline, t = record.polynomials[1], breaks[piece - 1]
        assert table[0, piece, 0] == pytest.approx(float(spline(t, 1)), abs=1e-14)
        assert table[1, piece, 0] == pytest.approx(float(spline(t, 2)), abs=1e-14)
        assert table[1, piece, 1] == pytest.approx(float(spline(t, 3)), abs=1e-13)
    assert not table[1, 0].any()
    assert not table[1, -1].any()  # outside its samples the ground has no acceleration


def test_an_exponent_that_varies_has_its_own_term():
    """d(x^p)/dp = x^p log x."""
    x, p = Expr("coordinate", (), 0), Expr("parameter", (), 0)
    leaves = {("coordinate", 0): 1.7, ("parameter", 0): 2.3}
    assert value(differentiate(x**p, p), leaves) == pytest.approx(
        1.7**2.3 * math.log(1.7), rel=1e-14
    )
    assert value(differentiate(x**p, x), leaves) == pytest.approx(2.3 * 1.7**1.3, rel=1e-14)


def test_a_trace_without_columns_is_as_it_was():
    plain, extended = trace(LAYERS), trace(LAYERS, (), ("load.frequency",))
    assert (plain.columns, len(plain.acceleration)) == (0, 1)
    assert (extended.columns, len(extended.acceleration)) == (3, 4)
    assert extended.acceleration[0] is plain.acceleration[0]
