"""The generated functions of one motion: every operation and function against power series composed
in 40 digits.

A new elementary function is tested by itself, as the tests go through the table of rules.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import mpmath as mp
import numpy as np
import pytest
from generated_functions import Generated
from power_series import solution

from saltus import InelasticImpact, OneContactModel, TwoLayer
from saltus.flow.programs.compiled import structure_functions
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Model,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.taylor.generated import functions_text
from saltus.taylor.graph import Expr, differentiate, is_steep
from saltus.taylor.rules import FUNCTIONS
from saltus.taylor.tracing import trace


def of_function(f):
    """An elementary function of the state, of the load, of both and of parameters alone."""
    return lambda q, v, f_, a, b: (
        f(2 + q) * f(1.5 + v * f_) - f(1.2 + 0.5 * f_) * q + f(a) + f(2 + f(b) * 0.1 * v)
    )


# Each operation as a function of the coordinate q, the velocity v, the load f and the parameters a,
# b. Where a function has a restricted domain its argument is kept inside it.
OPERATIONS = {
    **{name: of_function(rule.numpy) for name, rule in FUNCTIONS.items()},
    "add": lambda q, v, f, a, b: q + v + f + a + 2,
    "subtract": lambda q, v, f, a, b: 3 - q - (v - f) - (a - q),
    "multiply": lambda q, v, f, a, b: q * v * f * a * 2.5,
    "divide": lambda q, v, f, a, b: (
        (q - 1) / (2 + v * v) / a / 1.7 + b / (3 + f) + 1 / (2 + q) + f / (2 - f)
    ),
    "negative": lambda q, v, f, a, b: -q + +v + np.negative(f) + np.positive(q),
    "numpy": lambda q, v, f, a, b: (
        np.add(q, 1.5) * np.subtract(2, v) + np.divide(np.multiply(a, f), 3) + np.square(q + f)
    ),
    "whole power": lambda q, v, f, a, b: q**3 - v**2 + (q + 2) ** -2 + q**0 + v**1 + f**5,
    "high power": lambda q, v, f, a, b: (1 + 0.1 * q) ** 70 + (1.5 + q) ** -66 + q**19,
    "broken power": lambda q, v, f, a, b: (2 + q) ** 1.5 + (2 + v) ** -0.3 + (1.5 + f) ** 0.5,
    "power of a parameter": lambda q, v, f, a, b: (
        (2 + q) ** a + (2 + v) ** (a - b) + a**b + a ** (1 / 3)
    ),
    "power of the state": lambda q, v, f, a, b: (2 + q) ** v + 2**q + a**f,
    "tan": lambda q, v, f, a, b: np.tan(q) + np.tan(0.5 * v + f) + np.tan(b),
    "nested": lambda q, v, f, a, b: (
        np.exp(np.sin(np.sqrt(2 + np.tanh(q * v)) / (2 + np.cos(f)))) - np.log(2 + np.sin(q) ** 2)
    ),
}
LOAD = Load(frequency=1.3, force=Harmonic(0.4, phase=0.7) + Harmonic(0.2, mean=0.1, order=3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Many(Model):
    """x_i'' = operation i of x_i, x_i' and the load, all in one structure, as compiling it is what
    takes time.
    """

    a: float = 1.3
    b: float = 0.6

    coordinates: ClassVar[tuple[str, ...]] = tuple(f"x{i}" for i in range(len(OPERATIONS)))
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, position, velocity, side, load):
        states = zip(OPERATIONS.values(), position, velocity, strict=True)
        return tuple(operation(x, v, load.force(t), self.a, self.b) for operation, x, v in states)


def with_abs(q, v, f):
    """abs, which may be taken of the coordinate of a contact only."""
    return abs(q) * 2 + np.abs(q) * v + np.sin(abs(q) + 1.3) + (np.absolute(q) + 0.4) ** 1.5 + f


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoSided(OneContactModel):
    """x'' = a function of abs(x), which bends at the contact."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    sides: ClassVar[tuple[int, ...]] = (1, -1)

    def acceleration(self, t, x, velocity, side, load):
        return with_abs(x, velocity, load.force(t))


def force(t):
    """The load's formula, written again."""
    return 0.4 * np.sin(1.3 * t + 0.7) + (0.1 + 0.2 * np.sin(3 * 1.3 * t))


def agrees(computed, expected, digits=14):
    """Whether coefficients agree, relative to the largest at the radius at which the last one
    contributes as the first.
    """
    radius = (np.abs(expected).max() / np.abs(expected[..., -3:]).max()) ** (
        1 / (expected.shape[-1] - 1)
    )
    weight = radius ** np.arange(expected.shape[-1])
    return (
        np.abs((computed - expected) * weight).max()
        <= 10.0**-digits * expected.shape[-1] * np.abs(expected * weight).max()
    )


@pytest.fixture(scope="module")
def many():
    return Generated(System(model=Many(), load=LOAD))


@pytest.mark.parametrize(
    ("x", "v", "t"), [(0.35, 0.55, 0.0), pytest.param(-0.45, -0.3, 2.1, marks=pytest.mark.thorough)]
)
def test_taylor_coefficients_of_each_operation_and_elementary_function(many, x, v, t):
    computed, rows = many.coefficients(t, x, v, 12), enumerate(OPERATIONS)
    expected = {
        name: solution(lambda t, q, w, f=f: f(q, w, force(t), 1.3, 0.6), x, v, t, 12)
        for name, f in OPERATIONS.items()
    }
    assert [name for row, name in rows if not agrees(computed[row], expected[name])] == []


def test_every_order_has_the_coefficients_below_it(many):
    q, v, a, _, _ = many.all(0.4, 0.3, -0.2, 21)
    assert np.allclose(v[:, :-1], q[:, 1:] * np.arange(1, 23), rtol=1e-15, atol=0.0)
    for order in range(21):
        for part, whole, last in zip(
            many.all(0.4, 0.3, -0.2, order), (q, v, a), (order + 1, order + 1, order), strict=False
        ):
            assert np.array_equal(part[:, : last + 1], whole[:, : last + 1])
            assert np.isnan(part[:, last + 1 :]).all()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_slope_of_each_elementary_function(name):
    rule = FUNCTIONS[name]
    for u in (0.3, 1.7):
        assert rule.slope(u, rule.numpy(u)) == pytest.approx(
            float(mp.diff(getattr(mp, name), u)), rel=1e-14
        )
        expression = rule.numpy(Expr("coordinate", (), 0))
        assert differentiate(expression, Expr("coordinate", (), 0)).degree is None


@pytest.mark.parametrize("x", [0.35, -0.45])
def test_taylor_coefficients_of_abs(x):
    computed = Generated(System(model=TwoSided(), load=LOAD)).coefficients(
        2.1, x, -0.3, 10, side=math.copysign(1.0, x)
    )[0]
    assert agrees(computed, solution(lambda t, q, w: with_abs(q, w, force(t)), x, -0.3, 2.1, 10))


LAYERS = {
    "beta0": math.radians(80),
    "damping": 0.1,
    "stiffness_ratio": 0.8,
    "mass_ratio": 0.4,
    "dissipation_ratio": 1.3,
}
ALL_CHANNELS = Load(
    frequency=0.9,
    horizontal=Harmonic(0.3, order=2),
    vertical=-0.5,
    lower_horizontal=Harmonic(0.1, phase=1.0),
    lower_vertical=Harmonic(0.05, mean=-0.2),
    ground_horizontal=Harmonic(0.2),
    ground_vertical=Harmonic(0.1, phase=0.3),
)
GROUND = Load(
    frequency=0.9, ground_horizontal=Harmonic(0.2), ground_vertical=Harmonic(0.1, phase=0.3)
)
SYSTEMS = {
    "metainterface": System(
        model=Metainterface(**LAYERS), load=ALL_CHANNELS, impact=EnergyRestitution(0.9)
    ),
    "smoothed": System(model=Metainterface(beta0=1.4, damping=0.1, smoothing=10.0), load=GROUND),
    "block": System(model=RockingBlock(alpha=0.3), load=GROUND, impact=InelasticImpact()),
    "wall": System(
        model=WallOscillator(damping=0.1),
        load=Load(frequency=2.0, force=Harmonic(0.3)),
        impact=VelocityReduction(0.8),
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("theta", [0.25, -0.4])
def test_taylor_coefficients_of_the_models(name, theta):
    system, side = (
        SYSTEMS[name],
        math.copysign(1.0, theta) if len(SYSTEMS[name].model.sides) == 2 else 1.0,
    )
    computed = Generated(system).coefficients(1.7, theta, -0.6, 10, side)[0]
    expected = solution(
        lambda t, q, v: system.model.acceleration(t, q, v, side, system.load), theta, -0.6, 1.7, 10
    )
    assert agrees(computed, expected)


def test_taylor_coefficients_of_both_layers():
    system = System(model=TwoLayer(**LAYERS), load=ALL_CHANNELS)
    computed = Generated(system).coefficients(0.4, (0.3, -0.5), (0.7, 0.2), 10)
    expected = solution(
        lambda t, q, v: system.model.acceleration(t, q, v, 1, system.load),
        (0.3, -0.5),
        (0.7, 0.2),
        0.4,
        10,
    )
    assert agrees(computed, expected)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_series_of_gap_and_margins_are_those_of_the_motion(side):
    system = SYSTEMS["metainterface"]
    names = ("line_limit", "kinematic_limit", "reaction")
    t, order, h = 0.8, 14, 0.02
    q, v, a, gap, margins = Generated(system, names).all(t, side * 0.3, 0.5, order, side)
    state = [np.polynomial.polynomial.polyval(h, c[0, : order + 1]) for c in (q, v, a)]
    expected = system.model.margins(t + h, *state, side, system.load)
    for row, name in zip(margins, names, strict=True):
        assert np.polynomial.polynomial.polyval(h, row[: order + 1]) == pytest.approx(
            expected[name], abs=1e-14
        )
    assert np.polynomial.polynomial.polyval(h, gap[: order + 1]) == pytest.approx(
        side * state[0], abs=1e-15
    )


@pytest.mark.parametrize("name", ["metainterface", "block", "wall"])
@pytest.mark.parametrize("side", [1, -1])
def test_contact_series_and_reset_are_the_model_s_own(name, side):
    system = SYSTEMS[name]
    model, side = system.model, side if len(system.model.sides) == 2 else 1
    generated, t, h = Generated(system), 0.6, 0.05
    rate = model.gap(model.contact + 1.0, side) - model.gap(model.contact, side)
    for step in (0.0, h):
        computed = np.polynomial.polynomial.polyval(step, generated.contact(t, 14, float(side)))
        acceleration = model.acceleration(t + step, model.contact, 0.0, side, system.load)
        assert computed == pytest.approx(rate * acceleration, abs=1e-14)
    for velocity in (-side * 0.7, -side * 1e-3):
        computed = generated.reset(t, velocity, float(side))
        with np.errstate(invalid="ignore"):
            expected = model.reset(t, velocity, side, system.load, system.impact)
        assert computed == pytest.approx([float(x) for x in expected], abs=1e-15, nan_ok=True)


def text(system):
    return functions_text(structure_functions(trace(system)))


def test_text_depends_on_the_structure_alone():
    first = text(SYSTEMS["metainterface"])
    trace(System(model=RockingBlock(alpha=0.2)))  # what was traced in between does not matter
    other = SYSTEMS["metainterface"].with_(
        {"model.beta0": 1.1, "load.horizontal.order": 3, "impact.r": 0.5, "load.frequency": 7.0}
    )
    assert text(other) == first
    assert text(SYSTEMS["metainterface"].with_({"load.ground_vertical": 0.0})) != first


def test_equal_expressions_are_computed_once():
    bare = System(
        model=Metainterface(beta0=1.4), load=Load(frequency=1.0, horizontal=Harmonic(0.5))
    )
    series = text(bare).splitlines()[0]
    assert series.count("('sin',") == 2  # of the load's phase and of the layer's angle
    assert series.count("('cos',") == 2


def test_terms_that_are_literally_zero_cost_nothing():
    bare = System(
        model=Metainterface(beta0=1.4), load=Load(frequency=1.0, horizontal=Harmonic(0.5))
    )
    assert len(text(bare)) < len(text(bare.with_({"load.vertical": -0.5})))


def test_steps_are_checked_where_a_function_may_bend_unseen():
    x = Expr("coordinate", (), 0)
    steep = {name for name, rule in FUNCTIONS.items() if is_steep([rule.numpy(2 + x)])}
    assert steep == {"exp", "sinh", "cosh", "tanh"}
    assert not is_steep([np.exp(Expr("parameter", (), 0)) * x**3])
