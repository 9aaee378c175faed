"""Switches that a model's own formulas have: absolute values, signs, maxima and minima, comparisons.

Each is a function h of the state with a side s, +1 where h > 0 and -1 where h < 0, on which the
formula is smooth:

    abs(u) = s u,    sign(u) = s,    max(a, b) = (a + b + s (a - b)) / 2,
    where(a > b, x, y) = (1 + s) / 2 x + (1 - s) / 2 y,

with h = u or h = a - b. A motion is followed on these sides as on those of a `Surface`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from saltus.errors import TraceError
from saltus.systems import Sides
from saltus.systems import substitute as substitute_numbers
from saltus.taylor.graph import (
    POINTWISE,
    Expr,
    as_expr,
    combine,
    comparing_symbols,
    number,
    ordered,
    substitute,
    switching,
)

OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**"}
LONGEST_NAME = 40  # of a formula in the name of an event
ODD = ("sinh", "tanh", "atan")  # functions that have the sign of their operand
TINY = 1e-300  # keeps 0 / 0 away, and is lost in the square of any number above 1e-142


class Switches:
    """The switches of some expressions, with leaves "slide" from a number on for their sides.

    Functions that have one sign are one switch: factors that are positive, or constant, and powers
    are left out, as in k u, u / w, u^3, u exp(w) and tanh(u), which have the sign of u. `known` are
    those of surfaces that the model declares, by the numbers of their leaves.
    """

    def __init__(self, first: int, known: Mapping[int, Expr]) -> None:
        self._first = first
        self._numbers: dict[tuple[Expr, ...], int] = {}
        self._turned: dict[int, Expr] = {}  # -1 for surfaces of the opposite sign
        self._made: dict[int, Expr] = {}
        self.functions: list[Expr] = []
        self.jumping: set[int] = set()  # those at which values may jump
        self.sizes: set[Expr] = set()  # absolute values, s u
        # these, and others that are 0 where their side changes
        self.kept: set[Expr] = set()
        for place, function in known.items():
            sign, core = _sign_and_core(function, self.sizes)
            if core is not None and sign.op == "number":
                self._numbers[_difference(core)] = place - first
                self._turned[place - first] = sign

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
            return as_expr(rule(self, *args))
        if node.op in ("pow", "sqrt"):
            return self._power(node.op, *args)
        return combine(node.op, *args) if args else node

    def size_of(self, value: Expr) -> Expr:
        """The absolute value."""
        size = self._side_of(value) * value
        if size.op == "mul" and any(node.op == "slide" for node in ordered([size.args[0]])):
            self.sizes.add(size)
            self.kept.add(size)
        return size

    def part_of(self, value: Expr, way: float) -> Expr:
        """A value where its sign is `way`, else 0."""
        part = 0.5 * (1.0 + way * self._side_of(value)) * value
        if part.op == "mul" and any(node.op == "slide" for node in ordered([part.args[0]])):
            self.kept.add(part)
        return part

    def _power(self, op: str, base: Expr, *exponent: Expr) -> Expr:
        """A power or a root, which has no series on a side on which its base is 0: there it is that
        of 1, times 0."""
        there = number(1.0)
        if exponent and exponent[0].op == "number" and exponent[0].value <= 0.0:
            return combine(op, base, *exponent)
        for side in [node for node in ordered([base]) if node.op == "slide"]:
            for way in (1.0, -1.0):
                if substitute(base, {side: way}) is number(0.0):
                    there = there * (0.5 * (1.0 - way * side))
        if there is number(1.0):
            return combine(op, base, *exponent)
        return there * combine(op, base + (1.0 - there), *exponent)

    def side_of(self, function: Expr, other: Any = 0.0) -> Expr:
        """The sign of a difference, at which values may jump."""
        value = combine("sub", function, other)
        for known in [node for node in ordered([value]) if node.op == "slide"]:
            if any(substitute(value, {known: way}) is number(0.0) for way in (1.0, -1.0)):
                raise TraceError(
                    "a sign or a condition depends on a value that is 0 on a whole side, such as"
                    " np.maximum(x, 0) where x < 0: let it depend on x itself"
                )
        side = self._side_of(value)
        self.jumping |= {node.value - self._first for node in ordered([side]) if node.op == "slide"}
        return side

    def _side_of(self, value: Expr) -> Expr:
        """The sign of a value."""
        sign, core = _sign_and_core(value, self.sizes)
        if core is None:
            return sign
        a, b = _difference(core)
        if (b, a) in self._numbers or a is number(0.0):
            sign = -sign
            a, b = b, a
        if (a, b) not in self._numbers:
            new = combine("sub", a, b)
            self._check_continuous(new)
            self._numbers[a, b] = len(self.functions)
            self.functions.append(new)
        place = self._numbers[a, b]
        turned = self._turned.get(place, number(1.0))
        return sign * turned * Expr("slide", (), self._first + place)

    def _check_continuous(self, function: Expr) -> None:
        """Refuse a function whose own sides may make it jump through 0, which is no root of it."""
        for node in ordered([substitute(function, dict.fromkeys(self.kept, 1.0))]):
            if node.op != "slide":
                continue
            own = node.value - self._first
            if own < 0 or own in self.jumping:
                raise TraceError(
                    "a sign or a condition depends on a value that jumps where another one changes"
                    " its sign, and is not followed: write it as one function that is continuous,"
                    " such as v*x > 0 for sign(v)*x > 0"
                )


def _difference(function: Expr) -> tuple[Expr, Expr]:
    """The two values whose difference a function is."""
    if function.op == "sub":
        return function.args[0], function.args[1]
    return function, number(0.0)


def _sign_and_core(value: Expr, sizes: set[Expr]) -> tuple[Expr, Expr | None]:
    """A sign, of constants and sides, and a function, whose product has the sign of a value
    wherever that is not 0; without a function the value has the sign alone.
    """
    sign = number(1.0)
    powers: dict[Expr, int] = {}
    sides: dict[Expr, int] = {}
    waiting = [value]
    while waiting:
        node = waiting.pop()
        if node in sizes:
            continue
        if node.op == "sub" and node.args[0] is number(0.0):
            sign = -sign
            waiting.append(node.args[1])
            continue
        if node.op in ("mul", "div"):
            divided = node.op == "div" and not (
                _is_constant(node.args[1]) or _is_positive(node.args[1], sizes)
            )
            if not divided:
                waiting += [node.args[1], node.args[0]]
                continue
        if node.op in ODD:
            waiting.append(node.args[0])
        elif node.op == "slide":  # a side is its own sign
            sides[node] = sides.get(node, 0) + 1
        elif node.op == "number":
            sign = sign * float(np.sign(node.value) or 1.0)
        elif _is_constant(node):
            # exactly +1 or -1, but 0 for 0
            sign = sign * (node / np.sqrt(node * node + TINY))
        elif not _is_positive(node, sizes):
            powers[node] = powers.get(node, 0) + 1
    for side, power in sides.items():
        if power % 2 == 1:
            sign = sign * side
    core: Expr | None = None
    for node, power in powers.items():
        if power % 2 == 1:
            core = node if core is None else core * node
    return sign, core


def _is_constant(node: Expr) -> bool:
    """Whether an expression has numbers and parameters alone."""
    return all(x.args or x.op in ("number", "parameter") for x in ordered([node]))


def _is_positive(node: Expr, sizes: set[Expr]) -> bool:
    """Whether an expression is seen to be nowhere negative, where it is a number at all."""
    if node.op in ("exp", "cosh", "sqrt") or node in sizes:
        return True
    if node.op == "pow" and node.args[1].op == "number":
        return not float(node.args[1].value).is_integer()
    if node.op == "number":
        return bool(node.value >= 0.0)
    if node.op == "mul" and node.args[0] is node.args[1]:
        return True
    return node.op in ("add", "mul", "div") and all(_is_positive(x, sizes) for x in node.args)


def _above(switches: Switches, a: Expr, b: Expr) -> Expr:
    """1 where a > b, else 0."""
    return 0.5 * (1.0 + switches.side_of(a, b))


def _chosen(_: Any, condition: Expr, one: Expr, other: Expr) -> Expr:
    """What a condition, 1 or 0, chooses."""
    against = 1.0 - condition
    return condition * _only_where(condition, one) + against * _only_where(against, other)


def _only_where(condition: Expr, root: Expr) -> Expr:
    """An expression whose powers, roots and logarithms are those of 1 where a condition is 0, as
    they may be no numbers there."""
    made: dict[int, Expr] = {}
    for node in ordered([root]):
        args = [made[id(argument)] for argument in node.args]
        if node.op in ("pow", "sqrt", "log") and not _is_constant(node.args[0]):
            args[0] = condition * args[0] + (1.0 - condition)
        made[id(node)] = combine(node.op, *args) if args else node
    return made[id(root)]


def _larger(switches: Switches, a: Expr, b: Expr) -> Expr:
    """The larger one."""
    for one, other in ((a, b), (b, a)):
        if other is number(0.0):
            return switches.part_of(one, 1.0)
    return 0.5 * (a + b + switches.size_of(a - b))


def _smaller(switches: Switches, a: Expr, b: Expr) -> Expr:
    """The smaller one."""
    for one, other in ((a, b), (b, a)):
        if other is number(0.0):
            return switches.part_of(one, -1.0)
    return 0.5 * (a + b - switches.size_of(a - b))


RULES: dict[str, Callable[..., Any]] = {
    "absolute": Switches.size_of,
    "sign": Switches.side_of,
    "maximum": _larger,
    "minimum": _smaller,
    "greater": _above,
    "greater_equal": _above,
    "less": lambda switches, a, b: _above(switches, b, a),
    "less_equal": lambda switches, a, b: _above(switches, b, a),
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
