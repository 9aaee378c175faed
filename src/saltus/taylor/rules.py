"""The elementary functions, each in one rule, and the Taylor recurrences of arithmetic.

An elementary function y = f(u) is added to everything (tracing, derivatives, one motion, ensembles)
by one entry of FUNCTIONS under its name in the C library: NumPy's function, its slope f'(u) in
terms of u and y, written with NumPy, and optional properties. The Taylor coefficients follow from
y' = f'(u) u', as the slope is a series like any other,

    k y_k = sum_{j=1}^{k} j u_j s_{k-j},    s = f'(u).

If there is a recurrence that needs no series of the slope, as for the logarithm, the entry gives
it. The tests go through the table and compare each function's coefficients with 40 digits
(tests/taylor/test_series.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.taylor.vectors import (
    CACHE_LINE,
    LONG,
    Coefficient,
    ColumnInputs,
    Vec,
    add,
    loop,
    multiply,
    subtract,
)

if TYPE_CHECKING:
    from saltus.taylor.series import Series

# arguments: the writer, the node's own series (still without this order), its operands' series
Rule = Callable[..., None]


@dataclass(frozen=True)
class Function:
    """An elementary function y = f(u)."""

    numpy: Callable[..., Any]
    slope: Callable[[Any, Any], Any]  # f'(u) of u and y
    # wherever it is defined: its bounds over an interval are then its values at the ends
    increasing: bool = False
    # Whether the function may change steeply within a step although its Taylor terms are below
    # rounding at the step's start; steps are then checked.
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
    """u y' = p u' y for y = u^p: k u_0 y_k = p sum_{j=1}^{k} j u_j y_{k-j} - sum_{j=1}^{k-1} u_j (k
    - j) y_{k-j}.
    """
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


ARITHMETIC: dict[str, Rule] = {
    "add": _sum_of(add),
    "sub": _sum_of(subtract),
    "mul": _product,
    "div": _quotient,
    "pow": _power,
}
FUNCTIONS: dict[str, Function] = {
    "sqrt": Function(
        np.sqrt, lambda u, y: 1.0 / (2.0 * y), increasing=True, recurrence=_square_root
    ),
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

    # The most products in an inner loop, whose sums and loaded coefficients fit into the registers
    # of AVX-512 and of AVX2.
    most_sums: int = 3
    # The highest degree of a polynomial whose vanishing coefficients are left out of the sums. The
    # orders that are written out for it must be fewer than the lowest order of an ensemble's
    # series.
    most_ending: int = 7


SETTINGS = SeriesSettings()


@dataclass(eq=False)
class Row:
    """One series: its coefficients of the first orders, and those of a pair of orders as far as
    they are known.
    """

    degree: int | None  # above which all coefficients vanish; None where it does not end
    early: bool  # whether the coefficient k of a pair is known before the sums are
    first: list[Coefficient] = field(default_factory=list)
    pair: list[Coefficient] = field(default_factory=list)
    place: Any = None  # LLVM's pointer to coefficient 0, where the series lies in memory


class Loops:
    """Writes the loops over modes, and over the columns of a tangent, at each order of a series."""

    def __init__(self, series: Any, rows: Any, inputs: list[Any]) -> None:
        self.series = series
        self.rows = rows
        self.block = rows.modes
        self.b = series.builder
        self._inputs = dict(zip(rows.expressions, inputs, strict=True))  # their rows
        memory = series.memory
        self._rows = [
            memory.pointer(place) for place in (rows.positions, rows.velocities, rows.accelerations)
        ]
        array = memory.arguments[rows.positions[0]]
        self._stride = LONG(series.layout.capacity) if len(array.shape) == 1 else array.shape[1]
        self._dof = LONG(rows.dof)
        self._forms = list[Any]()
        if self.block is not None:
            self._forms = list(self.block.forms)
            self._data = memory.pointer(memory.leaves["datum"])
            self._count = memory.whole(self._data)
            self._dof = self.b.add(LONG(self.block.first), self._count)
        self._sums = self._array(len(self._forms) * (1 + rows.columns))
        self._pushes = ColumnInputs(memory, rows.columns, [each.pushes for each in rows.sums])
        if rows.sums:
            self._offsets = [self.b.mul(LONG(i), self._stride) for i in range(len(rows.sums))]

    def _array(self, size: int) -> Any:
        """LLVM's pointer to memory for so many numbers."""
        with self.b.goto_entry_block():
            array = self.b.alloca(self._one.value.type, max(1, size))
        array.align = min(CACHE_LINE, 8 * self.series.memory.arithmetic.width)
        return array

    def begin(self) -> None:
        """Put the state at the start into the series, where it is given elsewhere."""
        leaves = self.series.memory.leaves
        for which, kind in enumerate(("coordinate", "velocity")):
            if kind in leaves:
                given = self.series.memory.pointer(leaves[kind])
                local = self._dof if self.block is None else LONG(self.block.first)
                for begin, end, first in (
                    (0, int(self.block is not None), local),
                    (1, 1 + self.rows.columns, LONG(0)),
                ):
                    if begin < end:
                        self._copy_columns(begin, end, first, which, given)

    def _copy_columns(self, begin: int, end: int, first: Any, which: int, given: Any) -> None:
        with loop(self.b, begin, end) as j:
            base = self.b.add(self.b.mul(j, self._dof), first)
            with loop(self.b, 0, self.b.sub(self._dof, first)) as i:
                row = self.b.add(base, i)
                self._store(self._place(which, row, LONG(0)), self._load(self.b.gep(given, [row])))

    def sums(self) -> None:
        """Compute all sums over modes at order 0; those of the next orders come with the modes'
        coefficients (`_columns`).
        """
        forms = self._forms
        b = self.b
        if not forms or not self.series.starts:
            return
        with loop(self.b, 0, 1 + self.rows.columns) as j:
            base = b.add(b.mul(j, self._dof), LONG(self.block.first))
            for f in range(len(forms)):
                parts = [
                    (w, lambda i, at=place: self._datum(i, at), base)
                    for g, w, place in self._parts
                    if g == f
                ]
                self._store(self._sum_of(j, f), self._total(parts))

    def value(self, form: Any) -> Vec:
        """One of these sums, of the motion."""
        return self._load(self._sum_of(LONG(0), self._forms.index(form)))

    @property
    def _parts(self) -> list[tuple[int, int, int]]:
        """The parts of the sums: the number of the sum, of amplitudes (0) or rates (1), and the
        place of the coefficient.
        """
        given = [(f, which, form[which]) for f, form in enumerate(self._forms) for which in (0, 1)]
        return [(f, which, place) for f, which, place in given if place is not None]

    def _sum_of(self, column: Any, f: int) -> Any:
        """LLVM's pointer to a sum of a column."""
        return self.b.gep(
            self._sums, [self.b.add(self.b.mul(column, LONG(len(self._forms))), LONG(f))]
        )

    def advance(self) -> None:
        """Compute the accelerations of columns and modes at this order, and integrate them."""
        if self.rows.sums:
            self._advance_columns()
        if self.block is None:
            return
        self._columns(0, 1, [each for each in self.block.inputs if not each.local])
        begin = 1
        extra = self.block.columns
        for column in range(1, 1 + self.rows.columns):
            if extra and extra[column - 1]:
                self._columns(begin, column, [])
                self._columns(column, column + 1, list(extra[column - 1]))
                begin = column + 1
        self._columns(begin, 1 + self.rows.columns, [])

    def _advance_columns(self) -> None:
        """The local equations of all columns, some of them side by side."""
        b = self.b
        count = self.rows.columns
        # so many do not wait for their sums, and four columns are what two coordinates have
        abreast = min(4, count)
        self._pushes.store(lambda push: self.series.now(self._inputs[push]))
        with loop(b, 0, -(-count // abreast)) as group:
            places = [b.add(b.mul(group, LONG(abreast)), LONG(1 + u)) for u in range(abreast)]
            places = [
                b.select(b.icmp_signed("<", place, LONG(count)), place, LONG(count))
                for place in places
            ]
            bases = [
                [b.gep(row, [b.mul(b.mul(place, self._dof), self._stride)]) for row in self._rows]
                for place in places
            ]
            found = [
                self._column_sums(i, each, places, bases) for i, each in enumerate(self.rows.sums)
            ]
            for i, totals in enumerate(found):
                for base, total in zip(bases, totals, strict=True):
                    self._integrate_column(i, base, total)

    def _column_sums(self, i: int, each: Any, places: list[Any], bases: list[Any]) -> list[Vec]:
        """A coordinate's acceleration, or velocity, in some columns at this order: sum_l sum_j s_lj
        x_l,k-j.
        """
        b = self.b
        series = self.series
        totals = [self._pushes.of(i, b.sub(place, LONG(1))) for place in places]
        looped = list[Any]()
        for leaf, slope in each.terms:
            row = self._inputs[slope]
            for index, coefficient in self._newest(row):
                for u, (place, base) in enumerate(zip(places, bases, strict=True)):
                    totals[u] = self._lifted(coefficient).fma(
                        self._of_column(leaf, place, base, index), totals[u]
                    )
            looped += [(leaf, row)] if series.ahead is not None and row.degree is None else []
        if not looped:
            return totals
        after = list[Vec]()
        with loop(b, 0, series.order, totals, after) as (j, sums):
            index = b.sub(self._order, j)
            there = [[b.gep(row, [index]) for row in base] for base in bases]
            for leaf, row in looped:
                factor = series._at(row, j)
                which = int(leaf.op == "velocity")
                offset = self._offsets[leaf.value]
                states = [self._load(b.gep(at[which], [offset])) for at in there]
                sums = [factor.fma(state, total) for state, total in zip(states, sums, strict=True)]
            after += sums
        return after

    def _newest(self, row: Any) -> list[tuple[Any, Any]]:
        """The coefficients of a slope that need no memory, each with the order of what it is
        multiplied by.
        """
        order = self.series.order
        ahead = self.series.ahead
        if ahead is None:
            pairs = [(LONG(order - j), row.first[j]) for j in range(order + 1)]
        elif row.degree is None:
            pairs = [(LONG(ahead - j), row.pair[j]) for j in range(ahead + 1)]
        else:
            pairs = [
                (self.b.add(order, LONG(ahead - j)), row.first[j]) for j in range(row.degree + 1)
            ]
        return [(index, coefficient) for index, coefficient in pairs if coefficient is not None]

    def _of_column(self, leaf: Any, place: Any, base: Any, index: Any) -> Vec:
        """A coefficient of what a column has in a leaf's place; of sums over modes there is that of
        this order alone.
        """
        if leaf.op == "form":
            return self._load(self._sum_of(place, self._forms.index(leaf.value)))
        return self._load(
            self.b.gep(base[leaf.op == "velocity"], [self.b.add(self._offsets[leaf.value], index)])
        )

    def _integrate_column(self, i: int, base: Any, total: Vec) -> None:
        """Put a coordinate's acceleration in a column, or of first order its velocity, into the
        series.
        """
        b = self.b
        order = self._order
        series = self.series
        offset = self._offsets[i]
        now = b.add(offset, order)
        following = b.add(offset, b.add(order, LONG(1)))
        pull = total
        zero = self.series.memory.arithmetic.number(b, 0.0)
        if i in self.rows.first_order:
            self._store(b.gep(base[1], [now]), total)
            pull = zero
            if self.rows.with_accelerations and not series.starts:
                number = self._lifted(
                    float(series.order)
                    if series.ahead is None
                    else series._number + float(series.ahead)
                )
                self._store(b.gep(base[2], [b.sub(now, LONG(1))]), number * total)
        if self.rows.with_accelerations:
            self._store(b.gep(base[2], [now]), pull)
        self._store(
            b.gep(base[0], [following]), series._divided(self._load(b.gep(base[1], [now])), 1)
        )
        self._store(b.gep(base[1], [following]), series._divided(pull, 1))

    def _columns(self, begin: int, end: int, more: list[Any]) -> None:
        """The modes of some columns, with inputs that are expressions, and the sums over their
        coefficients of the next order.
        """
        if begin >= end:
            return
        b = self.b
        block = self.block
        series = self.series
        values = [(each, series.now(self._inputs[each.of])) for each in more]
        given = [(each, self._lifted(value)) for each, value in values if value is not None]
        inverse = series._divided(self._one, 1)
        with loop(self.b, begin, end) as j:
            base = b.mul(j, self._dof)
            local = [
                (
                    each,
                    self._load(
                        self._place(
                            int(each.of.op == "velocity"),
                            b.add(base, LONG(each.of.value)),
                            self._order,
                        )
                    ),
                )
                for each in block.inputs
                if each.local
            ]
            first = b.add(base, LONG(block.first))
            after = list[Vec]()
            with self._over_modes(len(self._parts), after) as (i, before):
                row = b.add(first, i)
                amplitude, rate = (
                    self._load(self._place(which, row, self._order)) for which in (0, 1)
                )
                total = -(self._datum(i, block.square) * amplitude)
                if block.coupled:
                    start = b.add(b.mul(self._count, LONG(block.record)), b.mul(i, self._count))
                    total = total - self._total([(1, lambda k: self._at(b.add(start, k)), first)])
                elif block.damping is not None:
                    total = total - self._datum(i, block.damping) * rate
                for each, value in (*given, *local):
                    factor = self._datum(i, each.place)
                    total = factor.fma(value if each.sign > 0.0 else -value, total)
                if begin == 0 or self.rows.with_accelerations:
                    self._store(self._place(2, row, self._order), total)
                following = b.add(self._order, LONG(1))
                new = (rate * inverse, total * inverse)
                for which in (1, 0):
                    self._store(self._place(which, row, following), new[which])
                parts = zip(self._parts, before, strict=True)
                after += [
                    self._datum(i, place).fma(new[which], sofar)
                    for (_, which, place), sofar in parts
                ]
            sums: dict[int, Vec] = {}
            for (f, _, _), value in zip(self._parts, after, strict=True):
                sums[f] = sums[f] + value if f in sums else value
            for f, value in sums.items():
                self._store(self._sum_of(j, f), value)

    @property
    def _order(self) -> Any:
        """This order, as LLVM's number."""
        order = self.series.order
        ahead = self.series.ahead
        return LONG(order) if ahead is None else self.b.add(order, LONG(ahead))

    @property
    def _one(self) -> Vec:
        one: Vec = self.series.memory.arithmetic.number(self.b, 1.0)
        return one

    def _lifted(self, value: Any) -> Vec:
        return (
            value if isinstance(value, Vec) else self.series.memory.arithmetic.number(self.b, value)
        )

    def _place(self, which: int, row: Any, index: Any) -> Any:
        """LLVM's pointer to a coefficient of a coordinate (0), of its rate (1) or of its
        acceleration (2).
        """
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
        """The sum over modes of coefficients, which are functions of the mode, times coordinates or
        rates, from a row on.
        """
        after = list[Vec]()
        with self._over_modes(1, after) as (i, (total,)):
            for which, factor, base in parts:
                total = factor(i).fma(
                    self._load(self._place(which, self.b.add(base, i), self._order)), total
                )
            after.append(total)
        return after[0]

    def _over_modes(self, carried: int, after: list[Vec]) -> Any:
        """A loop over the modes, and through it so many numbers that begin with 0."""
        return loop(
            self.b,
            0,
            self._count,
            [self.series.memory.arithmetic.number(self.b, 0.0)] * carried,
            after,
        )


def needs_sums(op: str, degrees: list[int | None]) -> bool:
    """Whether an operation multiplies two series neither of which ends."""
    if op == "mul":
        return degrees[0] is None and degrees[1] is None
    return op == "sqrt" or (op not in ("add", "sub") and degrees[-1 if op == "div" else 0] is None)


def loops_of(series: Series, roots: list[int]) -> Loops | None:
    """The loops over modes and columns, if there are any: the last of the roots that are kept are
    what they read.
    """
    rows = series.layout.loops
    last = len(series.layout.roots)
    if rows is None:
        return None
    loops = Loops(
        series, rows, [series.rows[root] for root in roots[last - len(rows.expressions) : last]]
    )
    loops.begin()
    return loops
