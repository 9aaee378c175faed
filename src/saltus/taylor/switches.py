"""Switches that a model's own formulas have: absolute values, signs, maxima and minima, comparisons.

Each is a function h of the state with a side s, +1 where h > 0 and -1 where h < 0, on which the
formula is smooth:

    abs(u) = s u,    sign(u) = s,    max(a, b) = (a + b + s (a - b)) / 2,
    where(a > b, x, y) = (1 + s) / 2 x + (1 - s) / 2 y,

with h = u or h = a - b. A motion is followed on these sides as on those of a `Surface`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from saltus.errors import TraceError
from saltus.systems import CONTINUOUS, Sides
from saltus.systems import substitute as substitute_numbers
from saltus.taylor.graph import (
    POINTWISE,
    Expr,
    as_expr,
    combine,
    comparing_symbols,
    number,
    ordered,
    switching,
)

OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**"}
LONGEST_NAME = 40  # of a formula in the name of an event


class Switches:
    """The switches of some expressions, with leaves "slide" from a number on for their sides."""

    def __init__(self, first: int) -> None:
        self._first = first
        self._numbers: dict[tuple[Expr, ...], int] = {}
        self._made: dict[int, Expr] = {}
        self.functions: list[Expr] = []
        self.jumping: set[int] = set()  # those at which values may jump

    def written(self, roots: Iterable[Expr]) -> list[Expr]:
        """The expressions on the sides of their switches."""
        given = list(roots)
        for node in ordered(given):
            if id(node) not in self._made:
                args = [self._made[id(argument)] for argument in node.args]
                self._made[id(node)] = self._on_sides(node, args)
        return [self._made[id(root)] for root in given]

    def _on_sides(self, node: Expr, args: list[Expr]) -> Expr:
        """A node whose operands are on their sides."""
        rule = RULES.get(node.op)
        if rule is not None:
            side_of = self.side_of if node.op in CONTINUOUS else self.jumping_side_of
            return as_expr(rule(side_of, *args))
        return combine(node.op, *args) if args else node

    def jumping_side_of(self, function: Expr, other: Any = 0.0) -> Expr:
        """`side_of` where values may jump."""
        side = self.side_of(function, other)
        self.jumping |= {node.value - self._first for node in ordered([side]) if node.op == "slide"}
        return side

    def side_of(self, function: Expr, other: Any = 0.0) -> Expr:
        """The sign of a difference."""
        a, b = function, as_expr(other)
        if b is number(0.0) and a.op == "sub":
            a, b = a.args
        turned = 1.0
        if a.op == "mul" and b is number(0.0):
            factors = [x for x in a.args if x.op == "number"]
            if len(factors) == 1 and factors[0].value < 0.0:
                turned, a = -1.0, a.args[1 - a.args.index(factors[0])]
        if (b, a) in self._numbers or a is number(0.0):
            turned = -turned
            a, b = b, a
        if all(x.op == "number" for x in (a, b)):
            return number(turned if a.value >= b.value else -turned)
        if (a, b) not in self._numbers:
            new = combine("sub", a, b)
            self._check_continuous(new)
            self._numbers[a, b] = len(self.functions)
            self.functions.append(new)
        return turned * Expr("slide", (), self._first + self._numbers[a, b])

    def _check_continuous(self, function: Expr) -> None:
        """Refuse a function whose own sides may make it jump through 0, which is no root of it."""
        for node in ordered([function]):
            if node.op != "slide":
                continue
            own = node.value - self._first
            if own < 0 or own in self.jumping:
                raise TraceError(
                    "a sign or a condition depends on a value that jumps where another one changes"
                    " its sign, and is not followed: write it as one function that is continuous,"
                    " such as v*x > 0 for sign(v)*x > 0"
                )


def _above(side_of: Callable[..., Expr], a: Expr, b: Expr) -> Expr:
    """1 where a > b, else 0."""
    return 0.5 * (1.0 + side_of(a, b))


def _chosen(_: Any, condition: Expr, one: Expr, other: Expr) -> Expr:
    """What a condition, 1 or 0, chooses."""
    return condition * one + (1.0 - condition) * other


RULES: dict[str, Callable[..., Any]] = {
    "absolute": lambda side_of, u: side_of(u) * u,
    "sign": lambda side_of, u: side_of(u),
    "maximum": lambda side_of, a, b: 0.5 * (a + b + side_of(a, b) * (a - b)),
    "minimum": lambda side_of, a, b: 0.5 * (a + b - side_of(a, b) * (a - b)),
    "greater": _above,
    "greater_equal": _above,
    "less": lambda side_of, a, b: _above(side_of, b, a),
    "less_equal": lambda side_of, a, b: _above(side_of, b, a),
    "where": _chosen,
}


def pointwise(root: Expr) -> Expr:
    """An expression at one instant, in which absolute values and signs are maxima and choices."""
    made: dict[int, Expr] = {}
    for node in ordered([root]):
        args = [made[id(argument)] for argument in node.args]
        if node.op == "absolute":
            made[id(node)] = combine("maximum", args[0], -args[0])
        elif node.op == "sign":
            made[id(node)] = combine("where", combine("greater_equal", args[0], 0.0), 1.0, -1.0)
        else:
            made[id(node)] = combine(node.op, *args) if args else node
    return made[id(root)]


def switches_of_force(model: Any) -> frozenset[str]:
    """The operations by which a model's force, under some load, has switches of its own."""
    size = len(model.coordinates)
    try:
        found = list[str]()
        twin = substitute_numbers(model, lambda path, value: Expr("parameter", (), len(found)))
        q, v = ([Expr(op, (), i) for i in range(size)] for op in ("coordinate", "velocity"))
        state = (q[0], v[0]) if size == 1 else (tuple(q), tuple(v))
        with comparing_symbols(refused=True), switching():
            sides = sides_of_symbols(twin)
            force = twin.force(Expr("time"), *state, _AnyLoad(), *sides)
        roots = force if isinstance(force, (tuple, list)) else [force]
        nodes = ordered([x for x in roots if isinstance(x, Expr)])
    except Exception:  # a user's own code may raise anything; the trace says what
        return frozenset()
    return frozenset(node.op for node in nodes if node.op in POINTWISE)


def sides_of_symbols(model: Any) -> tuple[Any, ...]:
    """The argument `sides` of a model's force, as symbols."""
    if not model.surfaces:
        return ()
    return (Sides({part.name: Expr("slide", (), k) for k, part in enumerate(model.surfaces)}),)


class _AnyLoad:
    """A load whose channels and their derivatives may be anything."""

    def __getattr__(self, name: str) -> Any:
        return _AnyChannel()


class _AnyChannel:
    """A channel of such a load."""

    def __call__(self, *_: Any) -> Expr:
        return Expr("origin")

    def __getattr__(self, name: str) -> Any:
        return self


def called(function: Expr, names: Sequence[str], paths: Sequence[str]) -> str:
    """A switching function as a formula, or the beginning of one."""
    shown = _formula(function, names, paths)
    return shown if len(shown) <= LONGEST_NAME else f"{shown[: LONGEST_NAME - 3]}..."


def _formula(node: Expr, names: Sequence[str], paths: Sequence[str]) -> str:
    """An expression as text."""
    args = [_formula(argument, names, paths) for argument in node.args]
    if node.op == "number":
        return f"{node.value:g}"
    if node.op == "coordinate":
        return str(names[node.value])
    if node.op == "velocity":
        return f"{names[node.value]}_velocity"
    if node.op == "parameter":
        return str(paths[node.value]).rpartition(".")[2]
    if node.op in OPERATORS:
        return f"({args[0]} {OPERATORS[node.op]} {args[1]})"
    return f"{node.op}({', '.join(args)})" if args else node.op
