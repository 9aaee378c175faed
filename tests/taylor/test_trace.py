"""Tracing a model: what is folded and shared, what is refused and how, and that numbers are never
part of a structure.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from saltus import Contact, ContactModel, NewtonImpact, OneContactModel
from saltus.checks import LIMITS
from saltus.errors import ParameterError, TraceError
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    Model,
    Record,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.taylor import structure_key
from saltus.taylor.graph import (
    FRICTION,
    Expr,
    combine,
    differentiate,
    number,
    ordered,
    power,
    substitute,
)
from saltus.taylor.tracing import check_size, trace

X, V, T, SIDE = Expr("coordinate", (), 0), Expr("velocity", (), 0), Expr("time"), Expr("side")
ALLOWED = (
    "allowed are + - * /, powers, NumPy's sqrt, exp, log, sin, cos, sinh, cosh, tanh, "
    "arctan, tan, and abs of the coordinate"
)


def traced(formula, load=None, sensitivities=None, **more):
    """Trace x'' = formula(t, x, v, side, load) in a model with the given attributes."""

    def acceleration(self, t, x, velocity, side, load):
        return formula(t, x, velocity, side, load)

    attributes = {
        "coordinates": ("x",),
        "channels": ("force",),
        "acceleration": acceleration,
        **more,
    }
    model = type("Small", (OneContactModel if "sides" in more else Model,), attributes)()
    return trace(System(model=model, load=load or Load(force=1.0)), sensitivities=sensitivities)


# --- the graph ---------------------------------------------------------------


def test_literals_are_folded():
    assert combine("add", 2, 3) is number(5.0)
    assert (number(4.0) ** 0.5) is number(2.0)
    assert np.sin(number(0.5)) is number(math.sin(0.5))
    assert X * 0 is number(0.0)
    assert 0.0 / (2 + X) is number(0.0)
    for same in (X + 0, 0 + X, X - 0, X * 1, 1 * X, X / 1, X**1, +X, np.positive(X)):
        assert same is X
    assert X**0 is number(1.0)


def test_equal_expressions_are_one_object():
    assert np.sin(X + 1) * V is np.sin(X + 1) * V
    assert X**2 is X * X
    assert np.square(X) is X**2
    assert np.sqrt(X) is X**0.5
    assert np.tan(X) is np.sin(X) / np.cos(X)
    assert len(ordered([np.sin(X) + np.sin(X) * V])) == 5


def test_operands_come_before_what_uses_them():
    nodes = ordered([np.exp(X * V) / (1 + X), X * V + T])
    assert len(nodes) == len(set(map(id, nodes)))
    seen: set[int] = set()
    for node in nodes:
        assert all(id(a) in seen for a in node.args)
        seen.add(id(node))


def test_degree_in_the_time_is_known_where_it_ends():
    p = Expr("parameter", (), 0)
    assert [
        e.degree for e in (p, np.sin(p), T, T * T + p, T * T / p, np.sin(T), T / (1 + T), X, T**3)
    ] == [*(0, 0, 1, 2, 2, None, None, None, 3)]


@pytest.mark.parametrize(
    "formula",
    [
        lambda x: x**3 - 2 / x + (1 + x) ** 0.7,
        lambda x: np.sqrt(1 + x * x) * np.exp(-x) + np.log(x),
        lambda x: np.sin(x) * np.cos(2 * x) + np.tan(x / 2),
        lambda x: np.sinh(x) - np.cosh(x / 2) + np.tanh(3 * x),
        lambda x: np.where(x > 1.0, x * x, x) + np.maximum(x, 0.3) * np.minimum(x, 0.9),
    ],
)
def test_derivatives_agree_with_differences(formula):
    slope = differentiate(formula(X), X)
    for x in (0.4, 0.71, 1.3):
        h = 1e-6
        expected = (formula(x + h) - formula(x - h)) / (2 * h)
        assert substitute(slope, {X: x}).value == pytest.approx(expected, rel=1e-8)


def test_power_of_a_variable_exponent_is_an_exponential():
    assert power(2.0, X).op == "exp"
    assert power(X, V).op == "exp"
    assert power(X, Expr("parameter", (), 0)).op == "pow"


# --- refusals ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("formula", "sentence"),
    [
        (
            lambda t, x, v, s, load: math.sin(x),
            "a traced quantity has no number yet: use NumPy's functions, not math's; " + ALLOWED,
        ),
        (lambda t, x, v, s, load: float(x), "a traced quantity has no number yet"),
        (lambda t, x, v, s, load: [1, 2][x], "a traced quantity has no number yet"),
        (lambda t, x, v, s, load: np.arcsin(x), "np.arcsin cannot be traced; " + ALLOWED),
        (lambda t, x, v, s, load: np.sign(x), "np.sign cannot be traced; " + ALLOWED),
        (lambda t, x, v, s, load: np.arctan2(x, v), "np.arctan2 cannot be traced"),
        (lambda t, x, v, s, load: np.clip(x, 0, 1), "np.clip cannot be traced"),
        (lambda t, x, v, s, load: np.dot(x, v), "np.dot cannot be traced"),
        (lambda t, x, v, s, load: np.add.reduce(x), "np.add cannot be traced"),
        (
            lambda t, x, v, s, load: -x if x > 0 else x,
            "may not branch on its state or parameters (if, and, or, min, max)",
        ),
        (
            lambda t, x, v, s, load: min(x, 0.0),
            "may not branch on its state or parameters (if, and, or, min, max)",
        ),
        (lambda t, x, v, s, load: max(x * x, x), "use `side`"),
        (lambda t, x, v, s, load: x > 0 and v, "may not branch"),
        (lambda t, x, v, s, load: x % 1, "%, //, @ and round cannot be traced; " + ALLOWED),
        (lambda t, x, v, s, load: 1 // x, "%, //, @ and round cannot be traced"),
        (lambda t, x, v, s, load: round(x), "%, //, @ and round cannot be traced"),
        (
            lambda t, x, v, s, load: abs(v),
            "abs of an expression that is not a coordinate cannot be traced; " + FRICTION,
        ),
        (lambda t, x, v, s, load: -np.sign(v), "np.sign cannot be traced; " + FRICTION),
        (lambda t, x, v, s, load: -1.0 if v > x else 1.0, "dry friction may be a Friction"),
        (
            lambda t, x, v, s, load: np.abs(2 * x),
            "abs of an expression that is not a coordinate cannot be traced",
        ),
        (
            lambda t, x, v, s, load: abs(x),
            "abs of the coordinate can be traced only where the gap is side",
        ),
        (lambda t, x, v, s, load: sum(x), "a scalar: it cannot be unpacked or looped ove"),
        (lambda t, x, v, s, load: x.sin(), "a traced quantity has no 'sin'; " + ALLOWED),
        (lambda t, x, v, s, load: x.real, "a traced quantity has no 'real'"),
        (
            lambda t, x, v, s, load: np.where(x > 0, x, -x),
            "Small uses greater in an acceleration, a gap or a margin; only an impact law",
        ),
        (
            lambda t, x, v, s, load: np.maximum(x, 0),
            "Small uses maximum in an acceleration, a gap or a margin; only an impact law",
        ),
        (lambda t, x, v, s, load: "x", "a traced model cannot use 'x' of type str; " + ALLOWED),
        (lambda t, x, v, s, load: None, "a traced model cannot use None of type NoneType"),
        (lambda t, x, v, s, load: x * 1j, "a traced model cannot use 1j of type complex"),
        (lambda t, x, v, s, load: x * np.ones(3), "a traced model cannot use array([1., 1., 1.])"),
    ],
)
def test_what_has_no_taylor_series_is_refused_by_name(formula, sentence):
    with pytest.raises(TraceError) as refusal:
        traced(formula)
    assert sentence in str(refusal.value)


@pytest.mark.parametrize(
    "formula",
    [
        lambda t, x, v, s, load: x if x == 1 else 0.0,
        lambda t, x, v, s, load: x if x != 1 else 0.0,
        lambda t, x, v, s, load: x if x == v else 0.0,
        lambda t, x, v, s, load: x if x in (1, 2) else 0.0,
        lambda t, x, v, s, load: {1: 4.0}.get(x, 1.0),
        lambda t, x, v, s, load: 4.0 if x in {1, 2} else 1.0,
        lambda t, x, v, s, load: np.where(x == 1, 4.0, 1.0),
        lambda t, x, v, s, load: 3.0 * (x == 1),
    ],
)
def test_comparing_a_symbol_is_refused(formula):
    with pytest.raises(TraceError, match="may not compare its state or numbers, or look them up"):
        traced(formula)


@dataclass(frozen=True, kw_only=True)
class ByKind(ContactModel):
    kind: int = 1
    coordinates: ClassVar[tuple] = ("x",)
    channels: ClassVar[tuple] = ("force",)

    @property
    def contacts(self):
        return (Contact(name="low", coordinate="x", position=-10.0),)

    def force(self, t, x, v, load):
        return -{1: 4.0}.get(self.kind, 1.0) * x


def test_a_number_that_chooses_the_force_of_a_contact_model_is_refused():
    load = Load(frequency=1.0, force=Harmonic(0.0))
    with pytest.raises(TraceError, match="may not compare its state or numbers, or look them up"):
        System(model=ByKind(), load=load, impact=NewtonImpact(e=0.5))


@pytest.mark.parametrize(
    "formula",
    [
        lambda t, x, v, s, load: t * x,
        lambda t, x, v, s, load: x * t,
        lambda t, x, v, s, load: x - t,
        lambda t, x, v, s, load: 2.0 - t,
        lambda t, x, v, s, load: np.sin(t),
        lambda t, x, v, s, load: np.float64(2.0) * t,
        lambda t, x, v, s, load: math.cos(t),
        lambda t, x, v, s, load: x if t > 1 else 0.0,
        lambda t, x, v, s, load: x if t >= 1 else 0.0,
        lambda t, x, v, s, load: x if t == 1 else 0.0,
        lambda t, x, v, s, load: t % 1.0,
        lambda t, x, v, s, load: t,
        lambda t, x, v, s, load: x * t**2,
        lambda t, x, v, s, load: load.force(t + 1.0),
        lambda t, x, v, s, load: load.force(2 * t),
    ],
)
def test_time_outside_the_load_is_refused(formula):
    with pytest.raises(
        TraceError,
        match=r"the time may only be passed to a load channel, such as load.horizontal\(t\)",
    ):
        traced(formula, Load(frequency=1.0, force=Harmonic(1.0)))


def wall_gap(self, x, side):
    return 2.0 - x


def turned(self, t, velocity, side, load, impact):
    return side, -velocity


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (
            {"sides": (1,), "gap": wall_gap, "contact": 2.0, "reset": turned},
            r"side \* coordinate; write it with the gap",
        ),
        (
            {"sides": (1, -1), "contact": 1.0, "gap": lambda self, x, side: side * (x - 1)},
            r"only where the gap is side \* coordinate",
        ),
    ],
)
def test_abs_is_refused_where_the_gap_is_not_side_times_coordinate(more, sentence):
    with pytest.raises(TraceError, match=sentence):
        traced(lambda t, x, v, s, load: -abs(x) * x, **more)


def test_abs_is_side_times_coordinate_where_the_gap_is():
    for gap in (lambda self, x, side: side * x, lambda self, x, side: x * side):
        result = traced(lambda t, x, v, s, load: -abs(x) * x, sides=(1, -1), gap=gap)
        assert result.acceleration[0] is (-1.0 * (SIDE * X)) * X


def test_abs_in_a_margin_is_refused_alike():
    def margins(self, t, x, velocity, acceleration, side, load):
        return {"far": 3.0 - abs(x)}

    model = type(
        "Small",
        (Model,),
        {
            "coordinates": ("x",),
            "sides": (),
            "acceleration": lambda self, *_: -1.0,
            "margins": margins,
        },
    )
    with pytest.raises(TraceError, match="abs of the coordinate can be traced only where the gap"):
        trace(System(model=model()), ("far",))


def test_gap_of_velocity_or_time_is_refused():
    for more in (0.1 * V, np.sin(T)):

        def gap(self, x, side, more=more):
            return side * x + (more if isinstance(x, Expr) else 0.0)

        with pytest.raises(
            TraceError,
            match=r"Small.gap may depend on the coordinate, the side and the parameters only",
        ):
            traced(lambda t, x, v, s, load: -x, sides=(1, -1), gap=gap)


def test_comparison_in_a_gap_is_refused():
    with pytest.raises(
        TraceError, match="Small uses maximum in an acceleration, a gap or a margin"
    ):
        traced(
            lambda t, x, v, s, load: -x,
            sides=(1, -1),
            gap=lambda self, x, side: np.maximum(side * x, 0.0),
        )


def nested(count):
    """sin(sin(... x)), so many times."""

    def formula(t, x, *_):
        for _ in range(count):
            x = np.sin(x)
        return -x

    return formula


@pytest.mark.parametrize(
    ("formula", "sentence"),
    [
        (
            nested(3000),
            (
                "have 3003 operations, 3000 of them functions, products and quotients, .* take"
                " about 25 minutes to compile"
            ),
        ),
        (
            lambda t, x, *_: sum(np.sin(i * x) for i in range(20_000)),
            "19999 of them functions, .* about 1.1e.03 minutes",
        ),
        (
            lambda t, x, *_: sum(x / (i + 2.0) for i in range(40_000)),
            "have 120000 operations, 0 of them functions, .* about 1.4 minutes",
        ),
    ],
)
def test_equations_that_would_be_compiled_for_minutes_are_refused_with_the_estimate(
    formula, sentence
):
    with pytest.raises(TraceError, match=sentence):
        traced(formula)


def test_equations_that_are_compiled_within_minutes_are_not_refused():
    traced(nested(600))


def test_derivatives_that_would_be_compiled_for_minutes_are_refused_with_the_estimate(monkeypatch):
    """The columns of sin(sin(...

    x)) share one chain of products of cosines: three loops for each sine, and one more.
    """
    monkeypatch.setattr("saltus.taylor.graph.LIMITS", replace(LIMITS, compiling=1.0))
    sentence = (
        "Small with 2 columns of derivatives .* 1801 of them .* about 1.3 minutes to "
        "compile; more than 1 minutes are"
    )
    with pytest.raises(TraceError, match=sentence):
        traced(nested(600), sensitivities=())
    traced(nested(500), sensitivities=())


def test_lanes_take_three_times_as_long_to_compile(monkeypatch):
    monkeypatch.setattr("saltus.taylor.graph.LIMITS", replace(LIMITS, compiling=2.0))
    small, large = traced(nested(400)), traced(nested(600))
    check_size(small, lanes=True)
    with pytest.raises(
        TraceError,
        match="about 3 minutes to compile for an ensemble; more than 2 minutes are refused",
    ):
        check_size(large, lanes=True)


def test_misspelt_channel_is_refused_with_the_near_ones():
    with pytest.raises(
        TraceError,
        match=r"Small reads load.forse, which is not one of its channels; did you mean 'force'",
    ):
        traced(lambda t, x, v, s, load: load.forse(t) - x)


def test_channel_that_is_not_called_is_refused():
    with pytest.raises(
        TraceError,
        match=r"cannot use a load channel .call it with the time, as in load.horizontal.t..",
    ):
        traced(lambda t, x, v, s, load: load.force * x)


def test_what_cannot_be_told_apart_is_refused_in_a_model():
    @dataclass(frozen=True)
    class Listed(OneContactModel):
        factors: list

        def acceleration(self, t, theta, velocity, side, load):
            return -self.factors[0] * theta

    with pytest.raises(
        ParameterError,
        match=r"must be a number, an array or a tuple, got a list, \[1.0\]",
    ):
        structure_key(System(model=Listed([1.0])))


def test_dry_friction_is_refused_as_friction():
    with pytest.raises(
        TraceError,
        match=r"Small uses greater in an acceleration, a gap or a margin; a force that jumps",
    ):
        traced(lambda t, x, v, s, load: np.where(v > 0, -1.0, 1.0) - x, sides=(1, -1))


def test_wrong_number_of_accelerations_is_refused():
    for result in ((1.0,), (1.0, 2.0, 3.0), 1.0, X):
        with pytest.raises(
            ParameterError, match=r"Small.acceleration must return 2 value\(s\), got "
        ):
            traced(lambda t, x, v, s, load, result=result: result, coordinates=("x", "y"))
    with pytest.raises(ParameterError, match=r"Small.acceleration must return 1 value\(s\), got "):
        traced(lambda t, x, v, s, load: (x, v))


def test_sides_with_two_coordinates_are_refused():
    with pytest.raises(
        ParameterError, match="Small has one contact and the coordinates x, y, but it must have one"
    ):
        traced(lambda t, x, v, s, load: (x[0], x[1]), coordinates=("x", "y"), sides=(1, -1))


def test_unknown_margin_is_answered_with_the_near_ones():
    with pytest.raises(
        ParameterError,
        match="Metainterface has no margin 'line_limits' to stop at; did you mean 'line_limit'",
    ):
        trace(System(model=Metainterface(beta0=1.4)), ("line_limits",))


# --- structures --------------------------------------------------------------

BASE = System(
    model=Metainterface(beta0=1.4),
    load=Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5),
)


def test_numbers_are_not_part_of_the_structure():
    changes: dict[str, Any] = {
        "model.beta0": 1.2,
        "model.damping": 0,
        "load.frequency": 3,
        "load.horizontal.amplitude": 0.0,
    }
    changes |= {
        "load.horizontal.order": 4,
        "load.vertical": 0,
        "impact.e": 0,
        "model.mass_ratio": 2,
    }
    for path, value in changes.items():
        assert structure_key(BASE.with_({path: value})) == structure_key(BASE), path


def test_whole_numbers_are_numbers():
    @dataclass(frozen=True, kw_only=True)
    class Spring(Model):
        stiffness: float

        def acceleration(self, t, theta, velocity, side, load):
            return -self.stiffness * theta

    assert structure_key(System(model=Spring(stiffness=2))) == structure_key(
        System(model=Spring(stiffness=2.5))
    )


def test_whatever_changes_the_expressions_is_part_of_the_structure():
    wall = System(model=WallOscillator(), load=Load(frequency=1.0, force=Harmonic(1.0)))
    record = Record([0.0, 1.0], [0.0, 1.0])
    others = [
        BASE,
        wall,
        BASE.with_({"model.smoothing": 50.0}),
        BASE.with_({"load.vertical": Harmonic(0.1)}),
        BASE.with_({"load.horizontal": Harmonic(0.1) + 0.2}),
        BASE.with_({"load.ground_horizontal": 0.0}),
        wall.with_({"load.force": Harmonic(1.0) + record}),
        wall.with_({"load": Load(force=1.0)}),
    ]
    assert len({structure_key(system) for system in others}) == len(others)


def test_samples_of_a_record_are_numbers_and_its_source_does_not_matter():
    a = Load(force=Record([0.0, 1.0], [0.0, 1.0], source="a.csv"))
    b = Load(force=Record(np.linspace(0, 3, 9), np.ones(9), scale=2.0, source="b.csv"))
    assert structure_key(System(model=WallOscillator(), load=a)) == structure_key(
        System(model=WallOscillator(), load=b)
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Tabulated(Model):
    """A model whose formula depends on an array and a switch: those are read while tracing, so they
    are its structure.
    """

    factors: np.ndarray
    cubic: bool = False

    def acceleration(self, t, theta, velocity, side, load):
        force = sum(-float(f) * theta ** (n + 1) for n, f in enumerate(self.factors))
        return force - theta**3 if self.cubic else force


def test_arrays_and_switches_of_a_model_are_part_of_its_structure():
    models = [
        Tabulated(factors=np.array(f), cubic=c)
        for f in ([1.0], [2.0], [1.0, 2.0])
        for c in (False, True)
    ]
    assert len({structure_key(System(model=m)) for m in models}) == 6
    again = Tabulated(factors=np.array([2.0]))
    assert structure_key(System(model=again)) == structure_key(System(model=models[2]))


def test_parameters_are_traced_in_the_order_of_their_paths():
    system = BASE.with_({"impact": VelocityReduction(0.9)})
    assert trace(system).parameters == list(system.parameters)
