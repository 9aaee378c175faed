"""The Taylor coefficients of all nodes of a tape in LLVM's code, two orders at a time (see `emit.py`).

The first orders are written out, every coefficient a vector register. The others are a loop over pairs of orders k, k + 1, in
which a product of two series takes for both orders a sum over coefficients that lie in memory,

    sum_{j=1}^{k-1} a_j b_{k-j}    and    sum_{j=1}^{k-1} a_j b_{k+1-j}.

An inner loop makes both for up to MOST_SUMS products: what it loads serves both orders, and its code is so short that the
processor keeps it decoded; written out order by order a call took 5 to 30 % longer at orders 12 to 20. What the newest
coefficients add comes after that loop. A series that ends, as the time's does, needs no loop: its few terms are written out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba.core import cgutils

from saltus.taylor.memory_layout import SERIES_LENGTH, LaneSlot
from saltus.taylor.tracing import RECORD_WIDTH
from saltus.taylor.vector_code import Tape, Writer, add, dot, multiply, subtract
from saltus.taylor.vectors import CACHE_LINE, DOUBLE, LONG, VECTOR, WIDTH, Vec, everywhere

if TYPE_CHECKING:
    from saltus.taylor.vector_functions import Slots

MOST_SUMS = 3  # products of an inner loop: their sums and what they load fit into the registers of AVX-512 and of AVX2
MOST_ENDING = 7  # the highest degree of a series whose end is made use of; the orders written out for it must be < LOWEST_ORDER
LEAVES = {"number": 0, "parameter": 0, "constant": 0, "side": 0, "origin": 0, "time": 1, "record": RECORD_WIDTH - 1}  # degrees

Coefficient = Vec | float | None  # None: zero


@dataclass(eq=False)
class Row:
    """One series: its coefficients of the first orders, and those of a pair of orders as far as they are known."""

    degree: int | None  # above which all coefficients vanish; None where it does not end
    early: bool  # whether the coefficient k of a pair is known before the sums are
    first: list[Coefficient] = field(default_factory=list)
    pair: list[Coefficient] = field(default_factory=list)
    place: Any = None  # LLVM's pointer to coefficient 0, where the series lies in memory


class Series(Writer):
    """Writes the series of all nodes, order by order, by `rules`: a function for each operation, see `recurrences.py`."""

    def __init__(self, slots: Slots, context: Any, builder: Any, array_type: Any, array: Any) -> None:
        super().__init__(slots, context, builder, array_type, array)
        self.positions, self.velocities = (
            [Row(None, True, place=self.pointer(self.at[f"{name}_series"] + row * SERIES_LENGTH)) for row in range(slots.rows)]
            for name in ("position", "velocity")
        )
        for name, rows in (("position", self.positions), ("velocity", self.velocities)):
            for i, row in enumerate(rows):
                row.first.append(self.load(self.at[name] + i))

    def read(self, nodes: Tape, rules: dict[str, Callable[..., None]]) -> None:
        """Take a tape: a series for each node."""
        self.nodes, self.rules, self.rows = nodes, rules, list[Row]()
        self.order: Any = 0  # a number among the first orders, then LLVM's number k of a pair
        self.ahead: int | None = None  # of a pair: 0 at order k, 1 at order k + 1; None among the first
        self._nodes: dict[int, tuple[Any, ...]] = {}  # that the rows are for
        self._beside: dict[tuple[int, str], Row] = {}
        self._inverses: dict[int, Any] = {}
        self._sums: dict[tuple[int, int], tuple[Vec, Vec]] = {}
        self._loops: list[_InnerLoop] = []
        self._kept: list[Row] = []
        self._lasts: dict[int, tuple[Row, Any]] = {}
        for node in nodes:
            self.rows.append(self._row(node))
        highest = max((row.degree for row in self.rows if row.degree is not None), default=0)
        self.written_out = 2 * (highest // 2 + 1)  # how many orders are
        self._tables = {sign: self._table([sign / max(k, 1) for k in range(SERIES_LENGTH + 2)]) for sign in (1.0, -1.0)}

    def _table(self, numbers: list[float]) -> Any:
        constant = ir.Constant(ir.ArrayType(DOUBLE, len(numbers)), numbers)
        return cgutils.global_constant(self.builder, "reciprocals", constant)

    def _row(self, node: tuple[Any, ...]) -> Row:
        row = self._new_row(node)
        self._nodes.setdefault(id(row), node)
        return row

    def _new_row(self, node: tuple[Any, ...]) -> Row:
        op = node[0]
        if op in ("coordinate", "velocity"):
            return (self.positions if op == "coordinate" else self.velocities)[node[1]]
        if op in LEAVES:
            return Row(LEAVES[op], True)
        args = [self.rows[i] for i in node[1:]]
        degrees = [row.degree for row in args]
        degree, early = _degree(op, degrees), all(row.early for row in args) and not _needs_sums(op, degrees)
        if op in ("sin", "cos"):  # whichever comes first on the tape makes both
            both = [self.beside(args[0], name, degree, early) for name in ("sin", "cos")]
            return both[op == "cos"]
        return Row(degree, early)

    # --- the orders ------------------------------------------------------------------------------------------------------------

    def each_order(self, order: Any) -> Iterator[None]:
        """Go through all orders below LLVM's number `order`: what is written meanwhile is for one of the first, or of a pair."""
        b = self.builder
        for k in range(self.written_out):
            self.order = k
            yield
        first, self._head, newest, end = b.block, *(b.append_basic_block(name) for name in ("pair", "newest", "end"))
        b.cbranch(b.icmp_signed("<", LONG(self.written_out), order), self._head, end)
        b.position_at_end(self._head)
        self.order = b.phi(LONG)
        self._number = everywhere(b, b.sitofp(self.order, DOUBLE))
        for row in (*self.positions, *self.velocities):
            row.pair.append(self._at(row, self.order))
        b.position_at_end(newest)
        for ahead in (0, 1):
            self.ahead = ahead
            yield
        for row in self._kept:
            self._keep(row, first)
        for row, last in self._lasts.values():
            last.add_incoming(self._value(row.first[self.written_out - 1]), first)
            last.add_incoming(self._value(row.pair[1]), b.block)
        following = b.add(self.order, LONG(2))
        self.order.add_incoming(LONG(self.written_out), first)
        self.order.add_incoming(following, b.block)
        b.cbranch(b.icmp_signed("<", following, order), self._head, end)
        blocks = [self._head, *(loop.block for loop in self._loops), newest]
        for loop, before, after in zip(self._loops, blocks, blocks[2:], strict=False):
            loop.close(before, after)
        with b.goto_block(self._head):
            b.branch(blocks[1])
        b.position_at_end(end)

    def advance(self) -> None:
        """Append the coefficient of this order to every node's series."""
        for row, node in zip(self.rows, self.nodes, strict=True):
            ended = self.ahead is not None and row.degree is not None
            if ended or node[0] in ("coordinate", "velocity") or self._is_known(row):
                continue
            if node[0] in LEAVES:
                self.push(row, self._leaf(node))
            else:
                with self._before_sums(row):
                    self.rules[node[0]](self, row, *(self.rows[i] for i in node[1:]))

    def _leaf(self, node: tuple[Any, ...]) -> Coefficient:
        k = self.order
        if node[0] == "time":
            return self.load(LaneSlot.NOW) if k == 0 else 1.0 if k == 1 else None
        if node[0] == "record":
            return self.load(self.at["records"] + node[1] * RECORD_WIDTH + k) if k < RECORD_WIDTH else None
        return self.known(node) if k == 0 else None

    def integrate(self, row: Row, slope: Coefficient) -> None:
        """Append to a position or velocity the coefficient of the next order, from that of its derivative at this one."""
        value = multiply(self._reciprocal(1), slope)
        if self.ahead != 1:
            self.push(row, value)
        self.write(row.place, value, 1)

    def write(self, place: Any, value: Coefficient, more: int = 0) -> None:
        """Put a coefficient of this order, or of a following one, into a series in memory."""
        index = LONG(self.order + more) if self.ahead is None else self.builder.add(self.order, LONG(self.ahead + more))
        self._put(place, index, value)

    # --- what a rule uses ------------------------------------------------------------------------------------------------------

    @property
    def starts(self) -> bool:
        """Whether this is order 0."""
        return self.ahead is None and self.order == 0

    def start(self, row: Row) -> Vec:
        """Coefficient 0, as a vector."""
        value = row.first[0]
        return value if isinstance(value, Vec) else self.number(value or 0.0)

    def push(self, row: Row, value: Coefficient) -> None:
        """Append the coefficient of this order to a series."""
        (row.first if self.ahead is None else row.pair).append(value)

    def now(self, row: Row) -> Coefficient:
        """The coefficient of this order."""
        if self.ahead is None:
            return row.first[self.order]
        return row.pair[self.ahead] if row.degree is None else None

    def beside(self, row: Row, name: str, degree: int | None, early: bool) -> Row:
        """A series that is needed besides one that has a node; empty at first."""
        return self._beside.setdefault((id(row), name), Row(degree, early))

    def scaled(self, u: Row, newest: bool = True) -> Row:
        """j u_j, up to this order, or up to the one before where u has no more."""
        row = self.beside(u, "scaled", u.degree, u.early)
        if not newest:
            return row
        if self.ahead is None:
            for j in range(len(row.first), self.order + 1):
                row.first.append(multiply(float(j), u.first[j]) if j else None)
        elif row.degree is None and not self._is_known(row):
            with self._before_sums(row):
                self.push(row, self._scaled_now(u))
        return row

    def _scaled_now(self, u: Row) -> Coefficient:
        """j u_j at this order of a pair, from velocities if u is made of positions and what does not change: known sooner so."""
        op, *places = self._nodes.get(id(u), ("",))
        if op == "coordinate":
            return self._back(self.velocities[places[0]], 1)
        if op in ("add", "sub", "mul"):
            a, b = (self.rows[i] for i in places)
            if op != "mul":
                one, other = (self.now(self.scaled(row)) for row in (a, b))
                return add(one, other) if op == "add" else subtract(one, other)
            if 0 in (a.degree, b.degree):
                constant, changing = (a, b) if a.degree == 0 else (b, a)
                return multiply(constant.first[0], self.now(self.scaled(changing)))
        return multiply(self._number + float(self.ahead or 0), self.now(u))

    def per_order(self, value: Coefficient, sign: float = 1.0) -> Coefficient:
        """A coefficient, or with the other sign, divided by this order."""
        return multiply(self._reciprocal(0, sign), value)

    def inverse(self, row: Row) -> Any:
        """One over coefficient 0."""
        if id(row) not in self._inverses:
            self._inverses[id(row)] = 1.0 / self.start(row)
        return self._inverses[id(row)]

    def product(self, a: Row, b: Row, first: bool = True, last: bool = True) -> Coefficient:
        """sum_{j=0}^{k} a_j b_{k-j} for this order k; without a_0 b_k if not `first`, without a_k b_0 if not `last`."""
        if self.ahead is None:
            k = self.order
            return dot([(a.first[j], b.first[k - j]) for j in range(0 if first else 1, k + 1 if last else k)])
        for one, other, whole in ((a, b, first), (b, a, last)):
            if one.degree is not None:
                return dot([(one.first[j], self._back(other, j)) for j in range(one.degree, -1 if whole else 0, -1)])
        forward, backward = (a, b) if b.early or not a.early else (b, a)
        newest = [(b.early, a.first[0], self.now(b))] if first else []
        newest += [(a.early, self.now(a), b.first[0])] if last else []
        if self.ahead == 1:
            newest += [(False, forward.pair[0], backward.first[1])]
            newest += [] if backward.early else [(False, forward.first[1], backward.pair[0])]
        newest.sort(key=lambda term: not term[0])  # what is known last is added last
        return dot([(one, other) for _, one, other in newest], self._earlier(forward, backward)[self.ahead])

    # --- memory ----------------------------------------------------------------------------------------------------------------

    def _is_known(self, row: Row) -> bool:
        return len(row.first) > self.order if self.ahead is None else len(row.pair) > self.ahead

    def _reciprocal(self, more: int, sign: float = 1.0) -> Any:
        """One, or minus one, over this order, or over a following one."""
        if self.ahead is None:
            return sign / (self.order + more)
        index = self.builder.add(self.order, LONG(self.ahead + more))
        return everywhere(self.builder, self.builder.load(self.builder.gep(self._tables[sign], [LONG(0), index])))

    def _before_sums(self, row: Row) -> AbstractContextManager[Any]:
        """Where the code for a series' coefficient goes: before the sums if it can."""
        return self.builder.goto_block(self._head) if self.ahead == 0 and row.early else nullcontext()

    def _back(self, row: Row, j: int) -> Coefficient:
        """The coefficient of the order that is j below this one, of a pair."""
        if j == 0:
            return self.now(row)
        if j == self.ahead:
            return row.pair[0] if row.degree is None else None
        assert self.ahead is not None
        if j == self.ahead + 1 and row.degree is None:
            return self._last(row)
        return self._at(row, self.builder.add(self.order, LONG(self.ahead - j)))

    def _last(self, row: Row) -> Vec:
        """The coefficient k - 1, kept from the pair before."""
        if id(row) not in self._lasts:
            with self.builder.goto_block(self._head):
                self.builder.position_at_start(self._head)
                self._lasts[id(row)] = row, self.builder.phi(VECTOR)
        return Vec(self.builder, self._lasts[id(row)][1])

    def _earlier(self, forward: Row, backward: Row) -> tuple[Vec, Vec]:
        """The sums of a product for both orders of a pair, made in an inner loop."""
        key = (id(forward), id(backward))
        if key not in self._sums:
            if not self._loops or self._loops[-1].full:
                self._loops.append(_InnerLoop(self))
            self._sums[key] = self._loops[-1].sums(forward, backward)
        return self._sums[key]

    def _at(self, row: Row, index: Any) -> Vec:
        """A coefficient from memory, where the series is from now on."""
        if row.place is None:
            with self.builder.goto_entry_block():
                row.place = self.builder.alloca(VECTOR, SERIES_LENGTH)
            row.place.align = min(CACHE_LINE, 8 * WIDTH)
            self._kept.append(row)
        loaded = self.builder.load(self.builder.gep(row.place, [index]))
        loaded.align = 8
        return Vec(self.builder, loaded)

    def _put(self, place: Any, index: Any, value: Coefficient) -> None:
        self.builder.store(self._value(value), self.builder.gep(place, [index])).align = 8

    def _value(self, coefficient: Coefficient) -> Any:
        """LLVM's vector."""
        return self.number(0.0).as_value(0.0 if coefficient is None else coefficient)

    def _keep(self, row: Row, first: Any) -> None:
        """Have a series in memory: the first orders from the block `first` on, the orders of a pair from here on."""
        ended = [None] * (SERIES_LENGTH - len(row.first)) if row.degree is not None else []
        with self.builder.goto_block(first):
            for j, value in enumerate([*row.first, *ended]):
                self._put(row.place, LONG(j), value)
        for j, value in enumerate(row.pair):
            self._put(row.place, self.builder.add(self.order, LONG(j)), value)


class _InnerLoop:
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
        """Whether it should make no further sums."""
        return self._made == MOST_SUMS

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
        """Coefficient k + 1 - j: what the turn before loaded."""
        if id(row) not in self._carried:
            variable = self._variable(VECTOR)
            start = self.series._value(row.pair[0] if row.early else None)
            self._changing.append((variable, start, loaded.value))
            self._carried[id(row)] = Vec(self.builder, variable)
        return self._carried[id(row)]

    def _sum(self, a: Vec, b: Vec) -> Vec:
        variable = self._variable(VECTOR)
        total = a.fma(b, Vec(self.builder, variable))
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


def _degree(op: str, degrees: list[int | None]) -> int | None:
    """Of what an operation makes of series of these degrees."""
    if all(degree == 0 for degree in degrees):
        return 0
    a, b = degrees[0], degrees[-1]
    if a is None or b is None or op not in ("add", "sub", "mul", "div") or (op == "div" and b > 0):
        return None
    degree = a + b if op == "mul" else max(a, b)
    return degree if degree <= MOST_ENDING else None


def _needs_sums(op: str, degrees: list[int | None]) -> bool:
    """Whether an operation multiplies two series neither of which ends."""
    if op == "mul":
        return degrees[0] is None and degrees[1] is None
    return op in ("tanh", "sqrt") or (op not in ("add", "sub") and degrees[-1 if op == "div" else 0] is None)
