"""The generated recurrences: every allowed operation against power series composed by brute force in 40 digits."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from interpreted import Interpreted
from power_series import solution

from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    InelasticImpact,
    Load,
    Metainterface,
    Model,
    RockingBlock,
    System,
    TwoLayer,
    VelocityReduction,
    WallOscillator,
)
from saltus.taylor.tracing import trace

# Each operation as a function of the coordinate q, the velocity v, the load f and the parameters a, b. Where a function has a
# restricted domain its argument is kept inside it.
OPERATIONS = {
    "add": lambda q, v, f, a, b: q + v + f + a + 2,
    "subtract": lambda q, v, f, a, b: 3 - q - (v - f) - (a - q),
    "multiply": lambda q, v, f, a, b: q * v * f * a * 2.5,
    "divide": lambda q, v, f, a, b: (q - 1) / (2 + v * v) / a / 1.7 + b / (3 + f) + 1 / (2 + q) + f / (2 - f),
    "negative": lambda q, v, f, a, b: -q + +v + np.negative(f) + np.positive(q),
    "numpy": lambda q, v, f, a, b: np.add(q, 1.5) * np.subtract(2, v) + np.divide(np.multiply(a, f), 3) + np.square(q + f),
    "whole power": lambda q, v, f, a, b: q**3 - v**2 + (q + 2) ** -2 + q**0 + v**1 + f**5,
    "high power": lambda q, v, f, a, b: (1 + 0.1 * q) ** 70 + (1.5 + q) ** -66 + q**19,
    "broken power": lambda q, v, f, a, b: (2 + q) ** 1.5 + (2 + v) ** -0.3 + (1.5 + f) ** 0.5,
    "power of a parameter": lambda q, v, f, a, b: (2 + q) ** a + (2 + v) ** (a - b) + a**b + a ** (1 / 3),
    "power of the state": lambda q, v, f, a, b: (2 + q) ** v + 2**q + a**f,
    "sqrt": lambda q, v, f, a, b: np.sqrt(2 + q) - np.sqrt(3 + v * f) + np.sqrt(2 + f) + np.sqrt(a),
    "exp": lambda q, v, f, a, b: np.exp(0.5 * q) + np.exp(-v) * np.exp(f) + np.exp(b),
    "log": lambda q, v, f, a, b: np.log(2 + q) - np.log(3 + v) * np.log(2 + f) + np.log(a),
    "sin": lambda q, v, f, a, b: np.sin(q) * np.sin(v) + np.sin(2 * f + a) + np.sin(b),
    "cos": lambda q, v, f, a, b: np.cos(q) * np.cos(v) + np.cos(2 * f + a) + np.sin(q),
    "tan": lambda q, v, f, a, b: np.tan(q) + np.tan(0.5 * v + f) + np.tan(b),
    "sinh": lambda q, v, f, a, b: np.sinh(q) * np.sinh(v) + np.sinh(f) + np.sinh(b),
    "cosh": lambda q, v, f, a, b: np.cosh(q) * np.cosh(v) + np.cosh(f) + np.sinh(f),
    "tanh": lambda q, v, f, a, b: np.tanh(q) * np.tanh(3 * v) + np.tanh(f) + np.tanh(b),
    "abs": lambda q, v, f, a, b: abs(q) * 2 + np.abs(q) * v + np.sin(abs(q) + a) + np.absolute(q) ** 1.5,
    "nested": lambda q, v, f, a, b: np.exp(np.sin(np.sqrt(2 + np.tanh(q * v)) / (2 + np.cos(f)))) - np.log(2 + np.sin(q) ** 2),
}
LOAD = Load(frequency=1.3, force=Harmonic(0.4, phase=0.7) + Harmonic(0.2, mean=0.1, order=3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Single(Model):
    """x'' = one operation; with sides where it uses abs."""

    operation: str
    a: float = 1.3
    b: float = 0.6

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def sides(self):
        return (1, -1) if self.operation == "abs" else ()

    def acceleration(self, t, x, velocity, side, load):
        return OPERATIONS[self.operation](x, velocity, load.force(t), self.a, self.b)


def force(t):
    """The load's formula, written again."""
    return 0.4 * np.sin(1.3 * t + 0.7) + (0.1 + 0.2 * np.sin(3 * 1.3 * t))


def agrees(computed, expected, digits=14):
    """Whether coefficients agree, relative to the largest at the radius at which the last one contributes as the first."""
    radius = (np.abs(expected).max() / np.abs(expected[..., -3:]).max()) ** (1 / (expected.shape[-1] - 1))
    weight = radius ** np.arange(expected.shape[-1])
    return np.abs((computed - expected) * weight).max() <= 10.0**-digits * expected.shape[-1] * np.abs(expected * weight).max()


@pytest.mark.parametrize("operation", OPERATIONS)
@pytest.mark.parametrize(("x", "v", "t"), [(0.35, 0.55, 0.0), (-0.45, -0.3, 2.1)])
def test_taylor_coefficients_of_each_operation(operation, x, v, t):
    generated = Interpreted(System(model=Single(operation=operation), load=LOAD))
    computed = generated.coefficients(t, x, v, 10, side=math.copysign(1.0, x))[0]
    expected = solution(lambda t, q, w: OPERATIONS[operation](q, w, force(t), 1.3, 0.6), x, v, t, 10)
    assert agrees(computed, expected)


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
GROUND = Load(frequency=0.9, ground_horizontal=Harmonic(0.2), ground_vertical=Harmonic(0.1, phase=0.3))
SYSTEMS = {
    "metainterface": System(model=Metainterface(**LAYERS), load=ALL_CHANNELS, impact=EnergyRestitution(0.9)),
    "smoothed": System(model=Metainterface(beta0=1.4, damping=0.1, smoothing=10.0), load=GROUND),
    "block": System(model=RockingBlock(alpha=0.3), load=GROUND, impact=InelasticImpact()),
    "wall": System(
        model=WallOscillator(damping=0.1), load=Load(frequency=2.0, force=Harmonic(0.3)), impact=VelocityReduction(0.8)
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("theta", [0.25, -0.4])
def test_taylor_coefficients_of_the_models(name, theta):
    system, side = SYSTEMS[name], math.copysign(1.0, theta) if len(SYSTEMS[name].model.sides) == 2 else 1.0
    computed = Interpreted(system).coefficients(1.7, theta, -0.6, 10, side)[0]
    expected = solution(lambda t, q, v: system.model.acceleration(t, q, v, side, system.load), theta, -0.6, 1.7, 10)
    assert agrees(computed, expected)


def test_taylor_coefficients_of_both_layers():
    system = System(model=TwoLayer(**LAYERS), load=ALL_CHANNELS)
    computed = Interpreted(system).coefficients(0.4, (0.3, -0.5), (0.7, 0.2), 10)
    expected = solution(lambda t, q, v: system.model.acceleration(t, q, v, 1, system.load), (0.3, -0.5), (0.7, 0.2), 0.4, 10)
    assert agrees(computed, expected)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_series_of_gap_and_margins_are_those_of_the_motion(side):
    system = SYSTEMS["metainterface"]
    names = ("line_limit", "kinematic_limit", "reaction")
    t, order, h = 0.8, 14, 0.02
    q, v, a, gap, margins = Interpreted(system, names).all(t, side * 0.3, 0.5, order, side)
    state = [np.polynomial.polynomial.polyval(h, c[0, : order + 1]) for c in (q, v, a)]
    expected = system.model.margins(t + h, *state, side, system.load)
    for row, name in zip(margins, names, strict=True):
        assert np.polynomial.polynomial.polyval(h, row[: order + 1]) == pytest.approx(expected[name], abs=1e-14)
    assert np.polynomial.polynomial.polyval(h, gap[: order + 1]) == pytest.approx(side * state[0], abs=1e-15)


@pytest.mark.parametrize("name", ["metainterface", "block", "wall"])
@pytest.mark.parametrize("side", [1, -1])
def test_contact_series_and_reset_are_the_model_s_own(name, side):
    system = SYSTEMS[name]
    model, side = system.model, side if len(system.model.sides) == 2 else 1
    generated, t, h = Interpreted(system), 0.6, 0.05
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


def test_source_depends_on_the_structure_alone():
    first = Interpreted(SYSTEMS["metainterface"]).source
    trace(System(model=RockingBlock(alpha=0.2)))  # what was traced in between does not matter
    other = SYSTEMS["metainterface"].with_(
        {"model.beta0": 1.1, "load.horizontal.order": 3, "impact.r": 0.5, "load.frequency": 7.0}
    )
    assert Interpreted(other).source == first
    assert Interpreted(SYSTEMS["metainterface"].with_({"load.ground_vertical": 0.0})).source != first


def test_equal_expressions_are_computed_once():
    source = Interpreted(System(model=Metainterface(beta0=1.4), load=Load(frequency=1.0, horizontal=Harmonic(0.5)))).source
    series = source.split("def series(")[1].split("def ")[0]
    assert series.count("math.sin(") == 2  # of the load's phase and of the layer's angle
    assert series.count("math.cos(") == 2


def test_terms_that_are_literally_zero_cost_nothing():
    bare = System(model=Metainterface(beta0=1.4), load=Load(frequency=1.0, horizontal=Harmonic(0.5)))
    loaded = bare.with_({"load.vertical": -0.5})
    assert Interpreted(bare).scope["ROWS"] <= Interpreted(loaded).scope["ROWS"]
    assert len(Interpreted(bare).source) < len(Interpreted(loaded).source)


@pytest.mark.parametrize("operation", ["tanh", "exp", "sinh", "cosh", "nested", "sin", "sqrt", "whole power"])
def test_steps_are_checked_where_a_function_may_bend_unseen(operation):
    scope = Interpreted(System(model=Single(operation=operation), load=LOAD)).scope
    assert scope["STEEP"] == (operation not in ("sin", "sqrt", "whole power"))
