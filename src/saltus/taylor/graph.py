"""Expressions traced from a model: a graph of arithmetic on the time, the state, the side and the
parameters.

Python's operators and NumPy's functions build the graph; whatever cannot be expanded in a Taylor
series is refused by name. Nodes are shared: equal expressions are one object, so that nothing is
computed twice.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from saltus.checks import LIMITS
from saltus.errors import TraceError
from saltus.taylor.rules import FUNCTIONS

# The operations without Taylor recurrence that a reset may use, because it is evaluated at one
# instant only.
POINTWISE = (
    *("greater", "less", "greater_equal", "less_equal", "where", "maximum", "minimum"),
    *("absolute", "sign"),
)
LEAVES = (
    *(
        "number",
        "parameter",
        "time",
        "origin",
        "side",
        "free",
        "slide",
        "coordinate",
        "velocity",
        "acceleration",
        "record",
    ),
    # sums over modes, accelerations of modes, coefficients of both (`memory.py`), shifts
    *("form", "mode", "datum", "shift"),
)
# coefficients of a record's piece: a cubic spline of velocity makes a quartic displacement
RECORD_WIDTH = 5

FUNCTION_NAMES = ", ".join(function.numpy.__name__ for function in FUNCTIONS.values())
ALLOWED = (
    f"+ - * /, powers, NumPy's {FUNCTION_NAMES}, tan, and abs of the"
    " coordinate (the sign of the coordinate is `side`); in the force of a ContactModel also abs,"
    " sign, maximum, minimum, where, clip, heaviside and copysign of any value"
)
ALLOWED_IN_FORCES = (
    f"+ - * /, powers, abs, and NumPy's {FUNCTION_NAMES}, tan, sign, maximum, minimum, where, clip,"
    " heaviside and copysign"
)
BRANCH = (
    "only an impact law may compare: where the equations change at a contact, the model is a"
    " OneContactModel, whose `side` stands for the branch, as in -(1 + side) * x"
)
FRICTION = (
    "a force that jumps with the sign of a velocity (dry friction, stick-slip) cannot be traced:"
    " give the model a Friction; a smooth one, such as -tanh(velocity / w), can be, and the force"
    " of a ContactModel may have abs, sign, maximum, minimum and where, as in -v * abs(v)"
)
BRANCHING = "a traced model may not branch on its state or parameters (if, and, or, min, max)"
BOTH_BRANCHES = (
    "write np.where(x > 0.0, a, b), np.maximum(x, 0.0), np.minimum, np.sign or abs, as in"
    " -v * abs(v), and join conditions as in (x > 0.0) & (v < 0.0)"
)
OF_ONE_CONTACT = (
    "at the contact use `side`, as in -(1 + side) * x; elsewhere make it a ContactModel, whose"
    " force may have np.where(x > 0.0, a, b), np.maximum(x, 0.0) and -v * abs(v)"
)
DRY_FRICTION = "; dry friction may be a Friction"
# the names of the bounds of `np.clip`
BOUNDS = {"a_min": "low", "min": "low", "a_max": "high", "max": "high"}
COMPARISON = (
    "a traced model may not compare its state or numbers, or look them up (==, !=, in, a dict, a"
    " set): they are symbols; what chooses between equations is a ClassVar, or two classes of model"
)
# NumPy's names, and ours
ARITHMETIC = {"add": "add", "subtract": "sub", "multiply": "mul", "divide": "div", "power": "pow"}
# those of switches, which only the force of a ContactModel may have
SWITCHES = ("sign", "heaviside", "copysign", "logical_and", "logical_or", "logical_not")
_AS_THEY_ARE = ("tan", "square", "negative", "positive", *POINTWISE)
UFUNCS = (
    ARITHMETIC
    | {name: name for name in (*_AS_THEY_ARE, *SWITCHES)}
    | {"fabs": "absolute"}
    | {f.numpy.__name__: name for name, f in FUNCTIONS.items()}
)


class _UsersCode(threading.local):
    """Whether a user's code runs in this thread, which may not compare symbols, whether it may
    have switches, and how expressions are written.
    """

    runs = False
    switches = False
    # whether refusals name what the force of a ContactModel may have
    of_contacts = False
    # while expressions are written once each (`shared_text`)
    shared: Any = None


_USERS_CODE = _UsersCode()


@contextmanager
def comparing_symbols(refused: bool) -> Iterator[None]:
    """Refuse to compare symbols and to use them as keys, as in a user's code, or allow it."""
    before = _USERS_CODE.runs
    _USERS_CODE.runs = refused
    try:
        yield
    finally:
        _USERS_CODE.runs = before


@contextmanager
def switching() -> Iterator[None]:
    """Allow switches: absolute values and signs of any expression."""
    before = _USERS_CODE.switches
    _USERS_CODE.switches = True
    try:
        yield
    finally:
        _USERS_CODE.switches = before


@contextmanager
def told_of_switches(told: bool) -> Iterator[None]:
    """Name switches in refusals, as in the force of a ContactModel, or not."""
    before = _USERS_CODE.of_contacts
    _USERS_CODE.of_contacts = told
    try:
        yield
    finally:
        _USERS_CODE.of_contacts = before


class Expr:
    """One node: an operation on other nodes, or a leaf with a value.

    `degree` bounds its degree in the time (None: no bound).
    """

    __slots__ = ("args", "degree", "op", "value")
    __array_priority__ = 1000
    _shared: dict[tuple[Any, ...], Expr] = {}  # noqa: RUF012  (one table for all graphs, so equal nodes are one object)

    op: str
    args: tuple[Expr, ...]
    value: Any
    degree: int | None

    def __new__(cls, op: str, args: tuple[Expr, ...] = (), value: Any = None) -> Expr:
        key = (op, tuple(id(a) for a in args), value, type(value))
        node = cls._shared.get(key)
        if node is None:
            node = super().__new__(cls)
            node.op = op
            node.args = args
            node.value = value
            node.degree = _degree(op, args)
            # another thread may have made it in the meantime
            node = cls._shared.setdefault(key, node)
        return node

    def __reduce__(self) -> tuple[Any, ...]:
        return Expr, (self.op, self.args, self.value)

    def __add__(self, other: Any) -> Expr:
        return combine("add", self, other)

    def __radd__(self, other: Any) -> Expr:
        return combine("add", other, self)

    def __sub__(self, other: Any) -> Expr:
        return combine("sub", self, other)

    def __rsub__(self, other: Any) -> Expr:
        return combine("sub", other, self)

    def __mul__(self, other: Any) -> Expr:
        return combine("mul", self, other)

    def __rmul__(self, other: Any) -> Expr:
        return combine("mul", other, self)

    def __truediv__(self, other: Any) -> Expr:
        return combine("div", self, other)

    def __rtruediv__(self, other: Any) -> Expr:
        return combine("div", other, self)

    def __pow__(self, other: Any) -> Expr:
        return power(self, other)

    def __rpow__(self, other: Any) -> Expr:
        return power(as_expr(other), self)

    def __neg__(self) -> Expr:
        return combine("mul", -1.0, self)

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        if _USERS_CODE.switches:
            return combine("absolute", self)
        if self.op != "coordinate":
            raise TraceError(
                "abs of an expression that is not a coordinate cannot be traced;"
                f" {_what_is_allowed(self)}"
            )
        return Expr("side") * self

    def __gt__(self, other: Any) -> Expr:
        return combine("greater", self, other)

    def __lt__(self, other: Any) -> Expr:
        return combine("less", self, other)

    def __ge__(self, other: Any) -> Expr:
        return combine("greater_equal", self, other)

    def __le__(self, other: Any) -> Expr:
        return combine("less_equal", self, other)

    def __eq__(self, other: object) -> bool:
        if self is not other and _USERS_CODE.runs:
            raise TraceError(COMPARISON)
        return self is other

    def __hash__(self) -> int:
        # a dict or set finds a number by its hash and never asks whether it is equal
        if _USERS_CODE.runs:
            raise TraceError(COMPARISON)
        return id(self) >> 4

    def __and__(self, other: Any) -> Expr:
        return _joined("&", self, other)

    def __rand__(self, other: Any) -> Expr:
        return _joined("&", other, self)

    def __or__(self, other: Any) -> Expr:
        return _joined("|", self, other)

    def __ror__(self, other: Any) -> Expr:
        return _joined("|", other, self)

    def __invert__(self) -> Expr:
        # of the bool that a comparison of floats gives, ~ makes a whole number
        raise TraceError("~ of a comparison is no condition: write np.logical_not, or the opposite")

    def __bool__(self) -> bool:
        instead = BOTH_BRANCHES if _may_switch() else OF_ONE_CONTACT
        rubs = DRY_FRICTION if uses_velocity(self) else ""
        raise TraceError(f"{BRANCHING}: {instead}{rubs}")

    def __float__(self) -> float:
        raise TraceError(
            "a traced quantity has no number yet: use NumPy's functions, not math's;"
            f" {_what_is_allowed()}"
        )

    __int__ = __index__ = __complex__ = __float__

    def _refuse(self, *_: Any) -> Any:
        raise TraceError(f"%, //, @ and round cannot be traced; {_what_is_allowed()}")

    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __divmod__ = __rdivmod__ = __matmul__ = (
        __rmatmul__
    ) = __round__ = _refuse

    def __iter__(self) -> Any:
        raise TraceError("a traced quantity is a scalar: it cannot be unpacked or looped over")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Expr:
        if _holds_expressions(inputs):
            return NotImplemented  # type: ignore[no-any-return]
        name = UFUNCS.get(ufunc.__name__)
        if name in SWITCHES and not _USERS_CODE.switches:
            name = None
        if method != "__call__" or kwargs or name is None:
            raise TraceError(f"np.{ufunc.__name__} cannot be traced; {_what_is_allowed(*inputs)}")
        return _apply(name, inputs)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Expr:
        if func is np.where and len(args) == 3:
            return combine("where", *args)
        if func is np.clip and _USERS_CODE.switches and set(kwargs) <= set(BOUNDS):
            return _clipped(*args, **{BOUNDS[name]: value for name, value in kwargs.items()})
        raise TraceError(f"np.{func.__name__} cannot be traced; {_what_is_allowed()}")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # NumPy and copy probe for these
            raise AttributeError(name)
        raise TraceError(f"a traced quantity has no {name!r}; {_what_is_allowed()}")

    def __repr__(self) -> str:
        if _USERS_CODE.shared is not None:
            name: str = _USERS_CODE.shared.name_of(self)
            return name
        if self.op in LEAVES:
            return self.op if self.value is None else f"{self.op}[{self.value}]"
        return f"{self.op}({', '.join(map(repr, self.args))})"


def _may_switch() -> bool:
    """Whether the user's code that runs may have switches."""
    return _USERS_CODE.switches or _USERS_CODE.of_contacts


def _what_is_allowed(*operands: Any) -> str:
    """A sentence that says what may be traced where the user's code runs, and, for operands that
    depend on a velocity, that its sign may not be used.
    """
    if _may_switch():
        return f"allowed are {ALLOWED_IN_FORCES}"
    return FRICTION if uses_velocity(*operands) else f"allowed are {ALLOWED}"


def uses_velocity(*operands: Any) -> bool:
    """Whether any of the operands depends on a velocity."""
    return any(
        node.op == "velocity" for node in ordered([x for x in operands if isinstance(x, Expr)])
    )


def _degree(op: str, args: tuple[Expr, ...]) -> int | None:
    """The degree in the time of the node's Taylor series, or None where it does not end."""
    if op in ("coordinate", "velocity", "acceleration", "form", "mode"):
        return None
    if op in LEAVES:
        return {"time": 1, "record": RECORD_WIDTH - 1}.get(op, 0)
    return degree(op, [a.degree for a in args])


def degree(op: str, degrees: list[int | None]) -> int | None:
    """The degree of the result of an operation on series of these degrees, or None if the resulting
    series does not end.
    """
    if all(d == 0 for d in degrees):
        return 0
    a = degrees[0]
    b = degrees[-1]
    if a is None or b is None or op not in ("add", "sub", "mul", "div") or (op == "div" and b > 0):
        return None
    return a + b if op == "mul" else max(a, b)


def number(value: float) -> Expr:
    """A literal number."""
    return Expr("number", (), float(value))


def as_expr(value: Any) -> Expr:
    """A node for a number; a node stays itself."""
    if isinstance(value, Expr):
        return value
    if isinstance(value, (int, float, np.integer, np.floating, np.bool_)) or (
        isinstance(value, np.ndarray) and value.ndim == 0
    ):
        return number(float(value))
    if hasattr(value, "refuse"):  # the time
        value.refuse()
    raise TraceError(
        f"a traced model cannot use {value!r} of type {type(value).__name__}; {_what_is_allowed()}"
    )


def _holds_expressions(operands: Iterable[Any]) -> bool:
    """Whether one of the operands may hold expressions itself, and so knows what the operation
    gives: one with derivatives.
    """
    return any(getattr(x, "__array_priority__", 0) > Expr.__array_priority__ for x in operands)


def combine(op: str, *operands: Any) -> Expr:
    """The node `op(operands)`, simplified where a literal 0 or 1, or literals alone, allow it."""
    if _holds_expressions(operands):
        return NotImplemented  # type: ignore[no-any-return]
    args = tuple(as_expr(a) for a in operands)
    values = [a.value if a.op == "number" else None for a in args]
    if all(v is not None for v in values):
        with np.errstate(all="ignore"):
            return number(_numeric(op, values))
    if op == "add" and 0.0 in values:
        return args[1 - values.index(0.0)]
    if op == "sub" and values[1] == 0.0:
        return args[0]
    if op == "mul" and 0.0 in values:
        return number(0.0)
    if op == "mul" and 1.0 in values:
        return args[1 - values.index(1.0)]
    if op == "div" and values[1] == 1.0:
        return args[0]
    if op == "div" and values[0] == 0.0:
        return number(0.0)
    if op == "where" and values[0] is not None:
        return args[1] if values[0] else args[2]
    return Expr(op, args)


def power(base: Any, exponent: Any) -> Expr:
    """base ** exponent: products for small whole exponents, a recurrence for constant ones,
    exp(exponent log(base)) else.
    """
    if _holds_expressions((base, exponent)):
        return NotImplemented  # type: ignore[no-any-return]
    base, exponent = as_expr(base), as_expr(exponent)
    if exponent.op == "number":
        whole = int(exponent.value) if np.isfinite(exponent.value) else 0
        if exponent.value == 0.5:
            return combine("sqrt", base)
        if exponent.value == whole and abs(whole) <= 64:
            return _whole_power(base, whole)
    if exponent.degree == 0:
        return combine("pow", base, exponent)
    return combine("exp", exponent * combine("log", base))


def _whole_power(base: Expr, exponent: int) -> Expr:
    if exponent < 0:
        return 1.0 / _whole_power(base, -exponent)
    result = number(1.0)
    square = base
    while exponent:
        if exponent & 1:
            result = result * square
        exponent >>= 1
        if exponent:
            square = square * square
    return result


def _is_condition(value: Any) -> bool:
    """Whether a value is a comparison, or several that are joined."""
    if not isinstance(value, Expr):
        return isinstance(value, (bool, np.bool_))
    if value.op == "where":
        return all(_is_condition(x) or x is number(0.0) or x is number(1.0) for x in value.args)
    return value.op.startswith(("greater", "less"))


def _joined(sign: str, one: Any, other: Any) -> Expr:
    """Conditions that hold together, or one of which holds, or that do not hold."""
    if not (_is_condition(one) and _is_condition(other)):
        raise TraceError(
            f"{sign} joins comparisons, each in brackets, as in (x > 0.0) & (v < 0.0), and was given"
            f" {one!r} and {other!r}"
        )
    if sign == "~":
        return combine("where", one, 0.0, 1.0)
    return combine("where", one, other, 0.0) if sign == "&" else combine("where", one, 1.0, other)


def _clipped(value: Any, low: Any = None, high: Any = None) -> Expr:
    """A value between bounds, of which one may be None."""
    above = value if low is None else combine("maximum", value, low)
    return as_expr(above if high is None else combine("minimum", above, high))


def _apply(name: str, inputs: tuple[Any, ...]) -> Expr:
    if name.startswith("logical"):
        return _joined(
            {"logical_and": "&", "logical_or": "|"}.get(name, "~"), inputs[0], inputs[-1]
        )
    if name == "heaviside":
        at_zero = as_expr(inputs[1])
        if at_zero is number(0.0) or at_zero is number(1.0):
            comparison = "greater" if at_zero is number(0.0) else "greater_equal"
            return combine("where", combine(comparison, inputs[0], 0.0), 1.0, 0.0)
        return 0.5 * (1.0 + combine("sign", inputs[0]))
    if name == "copysign":
        return abs(as_expr(inputs[0])) * combine("sign", inputs[1])
    if name == "absolute":
        return abs(as_expr(inputs[0]))
    if name == "negative":
        return -as_expr(inputs[0])
    if name == "positive":
        return as_expr(inputs[0])
    if name == "square":
        return as_expr(inputs[0]) * as_expr(inputs[0])
    if name == "pow":
        return power(*inputs)
    if name == "tan":
        return combine("sin", *inputs) / combine("cos", *inputs)
    return combine(name, *inputs)


def _numeric(op: str, values: list[Any]) -> float:
    ufunc = FUNCTIONS[op].numpy if op in FUNCTIONS else getattr(np, NAMES.get(op, op))
    return float(ufunc(*values))


NAMES = {name: numpy for numpy, name in ARITHMETIC.items()}


def ordered(roots: list[Expr]) -> list[Expr]:
    """Every node below the roots, each once, its operands before it."""
    order: list[Expr] = []
    seen: set[int] = set()
    stack = [(root, False) for root in reversed(roots)]
    while stack:
        node, ready = stack.pop()
        if ready:
            order.append(node)
        elif id(node) not in seen:
            seen.add(id(node))
            if node.args:
                stack.append((node, True))
                stack.extend([(a, False) for a in reversed(node.args) if id(a) not in seen])
            else:
                order.append(node)
    return order


class _Shared:
    """Names of expressions that are written once, however often they are used."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self.roots: list[Expr] = []

    def name_of(self, node: Expr) -> str:
        """The name of an expression, a new one at its first use."""
        if id(node) not in self._numbers:
            self._numbers[id(node)] = len(self.roots)
            self.roots.append(node)
        return f"#{self._numbers[id(node)]}"

    def lines(self) -> Iterator[str]:
        """What each name stands for."""
        for node in ordered(list(self.roots)):
            args = ", ".join(map(self.name_of, node.args))
            yield f"{self.name_of(node)} = {node.op}[{node.value}]({args})"


def shared_text(objects: Iterable[Any]) -> str:
    """Objects with expressions as text, in which each expression stands once: written out in full,
    those of a large mass matrix would take minutes.
    """
    shared = _Shared()
    _USERS_CODE.shared = shared
    try:
        written = [repr(each) for each in objects]
        return "\n".join([*written, *shared.lines()])
    finally:
        _USERS_CODE.shared = None


def is_steep(roots: list[Expr]) -> bool:
    """Whether the roots have a function that may bend sharply where a series from farther away does
    not show it.
    """
    return any(
        node.op in FUNCTIONS and FUNCTIONS[node.op].steep and node.degree is None
        for node in ordered(roots)
    )


def loop_count(roots: list[Expr]) -> int:
    """How many operations have a loop over their Taylor coefficients: functions, and products and
    quotients of two series.
    """
    nodes = [node for node in ordered(roots) if node.degree is None and node.args]
    return sum(
        n.op not in ("add", "sub") and (n.op in FUNCTIONS or all(a.degree != 0 for a in n.args))
        for n in nodes
    )


def substitute(root: Expr, leaves: dict[Expr, Any]) -> Expr:
    """The expression with some leaves replaced."""
    made: dict[int, Expr] = {id(old): as_expr(new) for old, new in leaves.items()}
    for node in ordered([root]):
        if id(node) not in made:
            made[id(node)] = (
                combine(node.op, *(made[id(a)] for a in node.args)) if node.args else node
            )
    return made[id(root)]


def differentiate(root: Expr, leaf: Expr) -> Expr:
    """The partial derivative of an expression with respect to one leaf."""
    made: dict[int, Expr] = {}
    for node in ordered([root]):
        if node is leaf:
            made[id(node)] = number(1.0)
        elif not node.args:
            made[id(node)] = number(0.0)
        else:
            made[id(node)] = _chain(node, [made[id(a)] for a in node.args])
    return made[id(root)]


def _chain(node: Expr, d: list[Expr]) -> Expr:
    """The derivative of a node from those of its operands."""
    a = node.args[0]
    b = node.args[-1]
    if node.op.startswith(("greater", "less")) or all(x is number(0.0) for x in d):
        return number(0.0)
    if node.op in FUNCTIONS:
        return as_expr(FUNCTIONS[node.op].slope(a, node) * d[0])
    rules: dict[str, Any] = {
        "add": lambda: d[0] + d[1],
        "sub": lambda: d[0] - d[1],
        "mul": lambda: d[0] * b + a * d[1],
        "div": lambda: (d[0] - node * d[1]) / b,
        "pow": lambda: (
            b * power(a, b - 1) * d[0] + (0.0 if d[1] is number(0.0) else node * np.log(a) * d[1])
        ),
        "absolute": lambda: combine("sign", a) * d[0],
        "sign": lambda: 0.0,
        "where": lambda: combine("where", a, d[1], d[2]),
        "maximum": lambda: combine("where", combine("greater", a, b), d[0], d[1]),
        "minimum": lambda: combine("where", combine("less", a, b), d[0], d[1]),
    }
    return as_expr(rules[node.op]())


def is_long(traced: Any) -> bool:
    """Whether the equations of many coordinates, or their derivatives, have so many loops that
    LLVM's passes are left out.
    """
    if traced.dof <= LIMITS.optimised and not traced.columns:
        return False
    return loop_count(_expanded(traced)) > (
        traced.dof if traced.dof > LIMITS.optimised else LIMITS.operations
    )


def _expanded(traced: Any) -> list[Expr]:
    """The expressions of a trace that are expanded in series."""
    gap = [] if traced.gap is None else [traced.gap]
    return [
        *traced.acceleration,
        *traced.reactions,
        *traced.margins.values(),
        *gap,
        *traced.inputs_of_loops,
    ]


def check_size(traced: Any, lanes: bool = False) -> None:
    """Refuse equations whose compilation would take minutes or hours; the time grows as the square
    of the number of loops, and without LLVM's passes (`is_long`) with its power 1.5: 581 took 13 s,
    1181 took 40 s.

    Raises
    ------
    TraceError
        The message has the estimate for one motion, for its derivatives if they are traced, or for
        vector `lanes`.
    """
    expanded = _expanded(traced)
    loops = loop_count(expanded)
    nodes = len(ordered(expanded))
    size = max(loops / LIMITS.operations, nodes / LIMITS.nodes)
    without_passes = is_long(traced) and not lanes
    minutes = 0.25 * size**1.5 if without_passes else size**2
    minutes *= LIMITS.lanes if lanes else 1.0
    most = LIMITS.compiling if traced.columns or lanes else 1.0
    if minutes > most:
        what = (
            f"{traced.model} with {traced.columns} columns of derivatives"
            if traced.columns
            else traced.model
        )
        raise TraceError(
            f"the equations of {what} have {nodes} operations, {loops} of them functions, products"
            f" and quotients, which would take about {minutes:.2g} minutes to"
            f" compile{' for an ensemble' * lanes}; more than {most:g} minutes are refused"
        )
