"""The elementary functions, each in one rule, and the Taylor recurrences of arithmetic.

An elementary function y = f(u) is added to everything (tracing, derivatives, one motion, ensembles) by one entry of FUNCTIONS
under its name in the C library: NumPy's function, its slope f'(u) in terms of u and y, written with NumPy, and optional
properties. The Taylor coefficients follow from y' = f'(u) u', as the slope is a series like any other,

    k y_k = sum_{j=1}^{k} j u_j s_{k-j},    s = f'(u).

If there is a recurrence that needs no series of the slope, as for the logarithm, the entry gives it. The tests go through the
table and compare each function's coefficients with 40 digits (tests/taylor/test_series.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.taylor.vectors import CACHE_LINE, LONG, Coefficient, Vec, add, loop, multiply, subtract

if TYPE_CHECKING:
    from saltus.taylor.series import Series

Rule = Callable[..., None]  # arguments: the writer, the node's own series (still without this order), its operands' series


@dataclass(frozen=True)
class Function:
    """An elementary function y = f(u)."""

    numpy: Callable[..., Any]
    slope: Callable[[Any, Any], Any]  # f'(u) of u and y
    increasing: bool = False  # wherever it is defined: its bounds over an interval are then its values at the ends
    # Whether the function may change steeply within a step although its Taylor terms are below rounding at the step's start;
    # steps are then checked.
    steep: bool = False
    recurrence: Rule | None = None  # used in place of the recurrence that follows from the slope


def by_slope(w: Series, own: Row, u: Row, slope: Row, factor: float, name: str) -> None:
    """y_k = (factor/k) sum_{j=1}^{k} j u_j s_{k-j}, where f'(u) = factor s."""
    if w.starts:
        w.push(own, w.start(u).function(name))
    else:
        w.push(own, w.per_order(multiply(factor, w.product(w.scaled(u), slope, first=False))))


def _logarithm(w: Series, own: Row, u: Row) -> None:
    """u y' = u': k u_0 y_k = k u_k - sum_{j=1}^{k-1} j y_j u_{k-j}."""
    if w.starts:
        w.push(own, w.start(u).function("log"))
    else:
        below = w.per_order(w.product(w.scaled(own, newest=False), u, first=False, last=False))
        w.push(own, w.over(subtract(w.now(u), below), u))
    w.scaled(own)


def _square_root(w: Series, own: Row, u: Row) -> None:
    """y y = u: 2 y_0 y_k = u_k - sum_{j=1}^{k-1} y_j y_{k-j}."""
    if w.starts:
        w.push(own, w.start(u).function("sqrt"))
    else:
        above = subtract(w.now(u), w.product(own, own, first=False, last=False))
        w.push(own, multiply(0.5, w.over(above, own)))


def _product(w: Series, own: Row, a: Row, b: Row) -> None:
    w.push(own, w.product(a, b))


def _quotient(w: Series, own: Row, a: Row, b: Row) -> None:
    w.push(own, w.over(subtract(w.now(a), w.product(b, own, first=False)), b))


def _power(w: Series, own: Row, u: Row, exponent: Row) -> None:
    """u y' = p u' y for y = u^p: k u_0 y_k = p sum_{j=1}^{k} j u_j y_{k-j} - sum_{j=1}^{k-1} u_j (k - j) y_{k-j}."""
    p = exponent.first[0]
    if w.starts:
        w.push(own, w.start(u).function("pow", p))
    else:
        above = multiply(p, w.product(w.scaled(u), own, first=False))
        below = w.product(u, w.scaled(own, newest=False), first=False, last=False)
        w.push(own, w.over(w.per_order(subtract(above, below)), u))
    w.scaled(own)


def _sum_of(combined: Callable[[Coefficient, Coefficient], Coefficient]) -> Rule:
    return lambda w, own, a, b: w.push(own, combined(w.now(a), w.now(b)))


ARITHMETIC: dict[str, Rule] = {"add": _sum_of(add), "sub": _sum_of(subtract), "mul": _product, "div": _quotient, "pow": _power}
FUNCTIONS: dict[str, Function] = {
    "sqrt": Function(np.sqrt, lambda u, y: 1.0 / (2.0 * y), increasing=True, recurrence=_square_root),
    "exp": Function(np.exp, lambda u, y: y, increasing=True, steep=True),
    "log": Function(np.log, lambda u, y: 1.0 / u, increasing=True, recurrence=_logarithm),
    "sin": Function(np.sin, lambda u, y: np.cos(u)),
    "cos": Function(np.cos, lambda u, y: -np.sin(u)),
    "sinh": Function(np.sinh, lambda u, y: np.cosh(u), increasing=True, steep=True),
    "cosh": Function(np.cosh, lambda u, y: np.sinh(u), steep=True),
    "tanh": Function(np.tanh, lambda u, y: 1.0 - y * y, increasing=True, steep=True),
    "atan": Function(np.arctan, lambda u, y: 1.0 / (1.0 + u * u), increasing=True),
}


@dataclass(frozen=True)
class SeriesSettings:
    """How the code of series is laid out."""

    # The most products in an inner loop, whose sums and loaded coefficients fit into the registers of AVX-512 and of AVX2.
    most_sums: int = 3
    # The highest degree of a polynomial whose vanishing coefficients are left out of the sums. The orders that are written out
    # for it must be fewer than the lowest order of an ensemble's series.
    most_ending: int = 7


SETTINGS = SeriesSettings()


@dataclass(eq=False)
class Row:
    """One series: its coefficients of the first orders, and those of a pair of orders as far as they are known."""

    degree: int | None  # above which all coefficients vanish; None where it does not end
    early: bool  # whether the coefficient k of a pair is known before the sums are
    first: list[Coefficient] = field(default_factory=list)
    pair: list[Coefficient] = field(default_factory=list)
    place: Any = None  # LLVM's pointer to coefficient 0, where the series lies in memory


class InnerLoop:
    """A loop over j = 1 .. k - 1 that makes the sums of some products for the orders k and k + 1."""

    def __init__(self, series: Series) -> None:
        self.series, self.builder = series, series.builder
        self.block = self.builder.append_basic_block("sums")
        self._changing: list[tuple[Any, Any, Any]] = []  # LLVM's variable, its value at first, its next value
        self._loaded: dict[tuple[int, bool], Vec] = {}
        self._carried: dict[int, Vec] = {}
        self._made = 0
        self._j = self._variable(LONG)

    @property
    def full(self) -> bool:
        """Whether the loop has as many sums as it should."""
        return self._made == SETTINGS.most_sums

    def sums(self, forward: Row, backward: Row) -> tuple[Vec, Vec]:
        """sum a_j b_{k-j} and sum a_j b_{k+1-j} of a `forward`, b `backward`; a_1 b_k only if b_k is known before the loop."""
        self._made += 1
        with self.builder.goto_block(self.block):
            a, b = self._load(forward, False), self._load(backward, True)
            return self._sum(a, b), self._sum(a, self._before(backward, b))

    def _variable(self, kind: Any) -> Any:
        with self.builder.goto_block(self.block):
            self.builder.position_at_start(self.block)
            return self.builder.phi(kind)

    def _load(self, row: Row, backwards: bool) -> Vec:
        """Coefficient j, or k - j, of a series."""
        key = (id(row), backwards)
        if key not in self._loaded:
            index = self.builder.sub(self.series.order, self._j) if backwards else self._j
            self._loaded[key] = self.series._at(row, index)
        return self._loaded[key]

    def _before(self, row: Row, loaded: Vec) -> Vec:
        """Coefficient k + 1 - j, which the iteration before has loaded."""
        if id(row) not in self._carried:
            variable = self._variable(self.series._kind)
            start = self.series.memory.value(row.pair[0] if row.early else None)
            self._changing.append((variable, start, loaded.value))
            self._carried[id(row)] = Vec(self.builder, variable, self.series.memory.arithmetic)
        return self._carried[id(row)]

    def _sum(self, a: Vec, b: Vec) -> Vec:
        variable = self._variable(self.series._kind)
        total = a.fma(b, Vec(self.builder, variable, self.series.memory.arithmetic))
        self._changing.append((variable, a.as_value(0.0), total.value))
        return total

    def close(self, before: Any, after: Any) -> None:
        """Join the loop to the code before and after it."""
        with self.builder.goto_block(self.block):
            following = self.builder.add(self._j, LONG(1))
            self.builder.cbranch(self.builder.icmp_signed("<", following, self.series.order), self.block, after)
        for variable, start, value in [(self._j, LONG(1), following), *self._changing]:
            variable.add_incoming(start, before)
            variable.add_incoming(value, self.block)


class ModeLoops:
    """Writes the loops over modes at each order of a series."""

    def __init__(self, series: Any, rows: Any, inputs: list[Any]) -> None:
        self.series, self.rows, self.block, self.b = series, rows, rows.block, series.builder
        self._inputs = dict(zip(self.block.expressions, inputs, strict=True))  # their rows
        memory = series.memory
        self._rows = [memory.pointer(place) for place in (rows.positions, rows.velocities, rows.accelerations)]
        array = memory.arguments[rows.positions[0]]
        self._stride = LONG(series.layout.capacity) if len(array.shape) == 1 else array.shape[1]
        self._data = memory.pointer(memory.leaves["datum"])
        self._count = memory.whole(self._data)
        self._dof = self.b.add(LONG(self.block.first), self._count)
        with self.b.goto_entry_block():
            self._sums = self.b.alloca(self._one.value.type, max(1, len(self.block.forms) * (1 + rows.columns)))
        self._sums.align = min(CACHE_LINE, 8 * memory.arithmetic.width)

    def begin(self) -> None:
        """Put the state at the start into the series, where it is given elsewhere."""
        leaves = self.series.memory.leaves
        for which, kind in enumerate(("coordinate", "velocity")):
            if kind in leaves:
                given = self.series.memory.pointer(leaves[kind])
                for begin, end, first in ((0, 1, self.block.first), (1, 1 + self.rows.columns, 0)):
                    if begin < end:
                        self._copy_columns(begin, end, first, which, given)

    def _copy_columns(self, begin: int, end: int, first: int, which: int, given: Any) -> None:
        with loop(self.b, begin, end) as j:
            base = self.b.mul(j, self._dof)
            with loop(self.b, first, self._dof) as i:
                row = self.b.add(base, i)
                self._store(self._place(which, row, LONG(0)), self._load(self.b.gep(given, [row])))

    def sums(self) -> None:
        """Compute all sums over modes at order 0; those of the next orders come with the modes' coefficients (`_columns`)."""
        forms, b = self.block.forms, self.b
        if not forms or not self.series.starts:
            return
        with loop(self.b, 0, 1 + self.rows.columns) as j:
            base = b.add(b.mul(j, self._dof), LONG(self.block.first))
            for f in range(len(forms)):
                parts = [(w, lambda i, at=place: self._datum(i, at), base) for g, w, place in self._parts if g == f]
                self._store(self._sum_of(j, f), self._total(parts))

    def value(self, form: Any) -> Vec:
        """One of these sums."""
        column, own = (form.first - self.block.first) // self.block.dof, form._replace(first=self.block.first)
        return self._load(self.b.gep(self._sums, [LONG(column * len(self.block.forms) + self.block.forms.index(own))]))

    @property
    def _parts(self) -> list[tuple[int, int, int]]:
        """The parts of the sums: the number of the sum, of amplitudes (0) or rates (1), and the place of the coefficient."""
        given = [(f, which, form[which]) for f, form in enumerate(self.block.forms) for which in (0, 1)]
        return [(f, which, place) for f, which, place in given if place is not None]

    def _sum_of(self, column: Any, f: int) -> Any:
        """LLVM's pointer to a sum of a column."""
        return self.b.gep(self._sums, [self.b.add(self.b.mul(column, LONG(len(self.block.forms))), LONG(f))])

    def advance(self) -> None:
        """Compute the accelerations of all modes at this order, and integrate them."""
        self._columns(0, 1, [each for each in self.block.inputs if not each.local])
        begin, extra = 1, self.block.columns
        for column in range(1, 1 + self.rows.columns):
            if extra and (extra[column - 1] or any(self._pushed(column))):
                self._columns(begin, column, [])
                self._columns(column, column + 1, list(extra[column - 1]))
                begin = column + 1
        self._columns(begin, 1 + self.rows.columns, [])

    def _columns(self, begin: int, end: int, more: list[Any]) -> None:
        """The modes of some columns, with inputs that are expressions, and the sums over their coefficients of the next order."""
        if begin >= end:
            return
        b, block, series = self.b, self.block, self.series
        values = [(each, series.now(self._inputs[each.of])) for each in more]
        given = [(each, self._lifted(value)) for each, value in values if value is not None]
        inverse = series._divided(self._one, 1)
        with loop(self.b, begin, end) as j:
            base = b.mul(j, self._dof)
            local = [
                (
                    each,
                    self._load(self._place(int(each.of.op == "velocity"), b.add(base, LONG(each.of.value)), self._order)),
                )
                for each in block.inputs
                if each.local
            ]
            first = b.add(base, LONG(block.first))
            if begin > 0:
                self._advance_local(j, base, self._pushed(begin), begin < self.rows.kept)
            after = list[Vec]()
            with self._over_modes(len(self._parts), after) as (i, before):
                row = b.add(first, i)
                amplitude, rate = (self._load(self._place(which, row, self._order)) for which in (0, 1))
                total = -(self._datum(i, block.square) * amplitude)
                if block.coupled:
                    start = b.add(b.mul(self._count, LONG(block.record)), b.mul(i, self._count))
                    total = total - self._total([(1, lambda k: self._at(b.add(start, k)), first)])
                elif block.damping is not None:
                    total = total - self._datum(i, block.damping) * rate
                for each, value in (*given, *local):
                    factor = self._datum(i, each.place)
                    total = factor.fma(value if each.sign > 0.0 else -value, total)
                if begin < self.rows.kept:
                    self._store(self._place(2, row, self._order), total)
                following, new = b.add(self._order, LONG(1)), (rate * inverse, total * inverse)
                for which in (1, 0):
                    self._store(self._place(which, row, following), new[which])
                parts = zip(self._parts, before, strict=True)
                after += [self._datum(i, place).fma(new[which], sofar) for (_, which, place), sofar in parts]
            sums: dict[int, Vec] = {}
            for (f, _, _), value in zip(self._parts, after, strict=True):
                sums[f] = sums[f] + value if f in sums else value
            for f, value in sums.items():
                self._store(self._sum_of(j, f), value)

    def _pushed(self, column: int) -> list[Vec | None]:
        """The terms of a column's own in its local equations, at this order."""
        values = [self.series.now(self._inputs[push]) for push in self.block.pushes[column - 1]]
        return [None if value is None else self._lifted(value) for value in values]

    def _advance_local(self, column: Any, base: Any, pushed: list[Vec | None], kept: bool) -> None:
        """The local coordinates of a column."""
        b, found, inverse = self.b, list[Vec](), self.series._divided(self._one, 1)
        for i, row in enumerate(self.block.slopes):
            total: Any = pushed[i] if pushed and pushed[i] is not None else self.series.memory.arithmetic.number(b, 0.0)
            for leaf, slope in row:
                if leaf.op == "form":
                    value = self._load(self._sum_of(column, self.block.forms.index(leaf.value)))
                else:
                    value = self._load(self._place(int(leaf.op == "velocity"), b.add(base, LONG(leaf.value)), self._order))
                total = self._lifted(self._inputs[slope].first[0]).fma(value, total)
            found.append(total)
        following = b.add(self._order, LONG(1))
        for i, total in enumerate(found):
            place = b.add(base, LONG(i))
            if kept:
                self._store(self._place(2, place, self._order), total)
            self._store(self._place(0, place, following), self._load(self._place(1, place, self._order)) * inverse)
            self._store(self._place(1, place, following), total * inverse)

    @property
    def _order(self) -> Any:
        """This order, as LLVM's number."""
        order, ahead = self.series.order, self.series.ahead
        return LONG(order) if ahead is None else self.b.add(order, LONG(ahead))

    @property
    def _one(self) -> Vec:
        one: Vec = self.series.memory.arithmetic.number(self.b, 1.0)
        return one

    def _lifted(self, value: Any) -> Vec:
        return value if isinstance(value, Vec) else self.series.memory.arithmetic.number(self.b, value)

    def _place(self, which: int, row: Any, index: Any) -> Any:
        """LLVM's pointer to a coefficient of a coordinate (0), of its rate (1) or of its acceleration (2)."""
        return self.b.gep(self._rows[which], [self.b.add(self.b.mul(row, self._stride), index)])

    def _datum(self, i: Any, place: int) -> Vec:
        """A number of the record of a mode."""
        return self._at(self.b.add(self.b.mul(i, LONG(self.block.record)), LONG(place)))

    def _at(self, index: Any) -> Vec:
        """A number behind the number of modes."""
        return self._load(self.b.gep(self._data, [self.b.add(index, LONG(1))]))

    def _load(self, pointer: Any) -> Vec:
        return Vec(self.b, self.series.memory.load_from(pointer), self.series.memory.arithmetic)

    def _store(self, pointer: Any, value: Vec) -> None:
        self.b.store(value.value, pointer).align = 8

    def _total(self, parts: list[tuple[int, Any, Any]]) -> Vec:
        """The sum over modes of coefficients, which are functions of the mode, times coordinates or rates, from a row on."""
        after = list[Vec]()
        with self._over_modes(1, after) as (i, (total,)):
            for which, factor, base in parts:
                total = factor(i).fma(self._load(self._place(which, self.b.add(base, i), self._order)), total)
            after.append(total)
        return after[0]

    def _over_modes(self, carried: int, after: list[Vec]) -> Any:
        """A loop over the modes, and through it so many numbers that begin with 0."""
        return loop(self.b, 0, self._count, [self.series.memory.arithmetic.number(self.b, 0.0)] * carried, after)


def needs_sums(op: str, degrees: list[int | None]) -> bool:
    """Whether an operation multiplies two series neither of which ends."""
    if op == "mul":
        return degrees[0] is None and degrees[1] is None
    return op == "sqrt" or (op not in ("add", "sub") and degrees[-1 if op == "div" else 0] is None)


def mode_loops(series: Series, roots: list[int]) -> ModeLoops | None:
    """The loops over modes, if there are any: the last of the roots that are kept are their inputs."""
    rows, last = series.layout.modes, len(series.layout.roots)
    if rows is None:
        return None
    loops = ModeLoops(series, rows, [series.rows[root] for root in roots[last - len(rows.block.expressions) : last]])
    loops.begin()
    return loops
