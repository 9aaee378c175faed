"""The Taylor coefficients of all nodes of a tape in LLVM's code, for one motion or for all lanes,
two orders at a time.

The first orders are written out, every coefficient in a register. The others are a loop over pairs
of orders k, k + 1, in which a product of two series takes for both orders a sum over coefficients
that lie in memory,

    sum_{j=1}^{k-1} a_j b_{k-j}    and    sum_{j=1}^{k-1} a_j b_{k+1-j}.

An inner loop computes both (`InnerLoop`). The terms with the newest coefficients are added after
it. A series that ends, such as that of the time, needs no loop: its few terms are written out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

from saltus.taylor.graph import LEAVES, RECORD_WIDTH, degree
from saltus.taylor.memory import LoopRows, Memory, Node, Place, Tape
from saltus.taylor.rules import ARITHMETIC, FUNCTIONS, SETTINGS, Row, by_slope, loops_of, needs_sums
from saltus.taylor.vectors import (
    CACHE_LINE,
    DOUBLE,
    LONG,
    Coefficient,
    InnerLoop,
    Vec,
    add,
    dot,
    inverses,
    multiply,
    quotient,
    subtract,
)


@dataclass(frozen=True)
class Rows:
    """The places of the coefficients of a motion, and their largest number.

    The first roots of the tape are the accelerations, one for each position; of a position in
    `first_order` its velocity, so that this row of `velocities` is computed and not integrated, and
    its acceleration has one coefficient less. With `any_order` the function's argument `order` is
    the highest order of the roots, odd or even; else it is the number of their orders, even and at
    least that of the orders written out.
    """

    positions: Sequence[Place]
    velocities: Sequence[Place]
    roots: Sequence[Place | None]  # where the series of each root is stored; None: it is not kept
    capacity: int  # the most coefficients of a series
    any_order: bool
    numbers: Sequence[Place] = ()  # where further roots that do not change are stored
    first_order: Sequence[int] = ()  # the positions of first order
    coordinates: Sequence[int] | None = None  # those whose positions these are, if they are not all
    loops: LoopRows | None = None  # the others, whose equations read the last of the roots
    orders: int = (
        0  # with as many, none is left to a loop: all coefficients are values of their own
    )


class Series:
    """Writes the series of all nodes, order by order."""

    def __init__(self, memory: Memory, tape: Tape, layout: Rows) -> None:
        self.memory, self.builder, self.nodes, self.layout = (
            memory,
            memory.builder,
            tape.nodes,
            layout,
        )
        self.order: Any = 0  # a number among the first orders, then LLVM's number k of a pair
        # of a pair: 0 at order k, 1 at order k + 1; None among the first
        self.ahead: int | None = None
        own = layout.coordinates or range(len(layout.positions))
        self.positions = {
            i: Row(None, True, place=memory.pointer(at))
            for i, at in zip(own, layout.positions, strict=True)
        }
        self.velocities = {
            i: Row(None, True, place=memory.pointer(at))
            for i, at in zip(own, layout.velocities, strict=True)
        }
        self.loops: Any = None
        self._nodes: dict[int, Node] = {}  # the node of each row, by the row's id
        self._scaled: dict[int, Row] = {}
        self._records: dict[int, Any] = {}
        self._inverses: dict[int, tuple[Vec, Vec]] = {}
        self._sums: dict[tuple[int, int], tuple[Vec, Vec]] = {}
        self._loops: list[InnerLoop] = []
        self._kept: list[Row] = []
        self._lasts: dict[int, tuple[Row, Any]] = {}
        self.rows = list[Row]()
        for node in tape.nodes:
            self.rows.append(self._row(node))
            self._nodes.setdefault(id(self.rows[-1]), node)
        self._slopes = [
            (layout.velocities[i], layout.roots[i], self.rows[tape.roots[i]])
            for i in layout.first_order
        ]
        for i in layout.first_order:
            self.velocities[i] = self.rows[tape.roots[i]]
        kept = [row for i, row in self.velocities.items() if i not in layout.first_order]
        self._integrated = [*self.positions.values(), *kept]
        highest = max((row.degree for row in self.rows if row.degree is not None), default=0)
        self.written_out = 2 * (highest // 2 + 1)
        # the number of orders whose code is written out
        self.written_out = max(self.written_out, layout.orders)
        self._tables = inverses(self.builder, layout.capacity + 2)

    def _row(self, node: Node) -> Row:
        op = node[0]
        if op in ("coordinate", "velocity"):
            return (self.positions if op == "coordinate" else self.velocities)[node[1]]
        if op == "form":
            return Row(None, False)
        if op in (*LEAVES, "constant"):
            return Row({"time": 1, "record": RECORD_WIDTH - 1}.get(op, 0), True)
        args = [self.rows[i] for i in (node[1:] if op in ARITHMETIC else node[1:2])]
        degrees = [row.degree for row in args]
        ends = degree(op, degrees)
        early = all(row.early for row in args) and not needs_sums(op, degrees)
        return Row(ends if ends is None or ends <= SETTINGS.most_ending else None, early)

    def write_motion(self, roots: list[int]) -> None:
        """Write all orders of a motion, whose accelerations are the first roots, and put them into
        memory.
        """
        first_order = self.layout.first_order
        for rows, kind in ((self.positions, "coordinate"), (self.velocities, "velocity")):
            for i, row in rows.items():
                if kind == "velocity" and i in first_order:
                    continue
                given = kind in self.memory.leaves
                row.first.append(self.memory.leaf((kind, i)) if given else self._at(row, LONG(0)))
                if given:
                    self._put(row.place, LONG(0), row.first[0])
        pulls = [self.rows[root] for root in roots[: len(self.positions)]]
        kept = [
            (self.memory.pointer(place), self.rows[root])
            for i, (place, root) in enumerate(zip(self.layout.roots, roots, strict=False))
            if place and i not in first_order
        ]
        slopes: list[Any] = [
            (*(place and self.memory.pointer(place) for place in places), row)
            for *places, row in self._slopes
        ]
        numbers = zip(self.layout.numbers, roots[len(self.layout.roots) :], strict=True)
        self.loops = loops_of(self, roots)
        for _ in self._each_order():
            if self.loops is not None:
                self.loops.sums()
            self._advance()
            if self.starts:
                for place, root in numbers:
                    self.memory.store(place, self.now(self.rows[root]))
            motion = zip(self.positions.items(), self.velocities.values(), pulls, strict=True)
            for (i, position), velocity, pull in motion:
                self._integrate(position, self.now(velocity))
                if i not in first_order:
                    self._integrate(velocity, self.now(pull))
            for rate, acceleration, slope in slopes:
                self._write_slope(rate, acceleration, self.now(slope))
            for pointer, row in kept:
                self._write(pointer, self.now(row))
            if self.loops is not None:
                self.loops.advance()

    # --- the orders ----------------------------------------------------------

    def _each_order(self) -> Iterator[None]:
        """Iterate over all orders; code that is written in an iteration is for one of the first
        orders, or for one of a pair.
        """
        b = self.builder
        any_order = self.layout.any_order
        order = self.memory.arguments["order"]
        order = b.add(order, LONG(1)) if any_order else order
        end = b.append_basic_block("end")
        for k in range(self.written_out):
            self.order = k
            if any_order and k:
                self._go_on_if(b.icmp_signed("<", LONG(k), order), end)
            yield
        if self.layout.orders:
            b.branch(end)
            b.position_at_end(end)
            return
        first, self._head, newest = (
            b.block,
            *(b.append_basic_block(name) for name in ("pair", "newest")),
        )
        b.cbranch(b.icmp_signed("<", LONG(self.written_out), order), self._head, end)
        b.position_at_end(self._head)
        self.order = b.phi(LONG)
        self._number = self.memory.arithmetic.everywhere(b, b.sitofp(self.order, DOUBLE))
        for row in self._integrated:
            row.pair.append(self._at(row, self.order))
        b.position_at_end(newest)
        for ahead in (0, 1):
            self.ahead = ahead
            if any_order and ahead:
                self._go_on_if(b.icmp_signed("<", b.add(self.order, LONG(1)), order), end)
            yield
        for row in self._kept:
            self._keep(row, first)
        for row, last in self._lasts.values():
            last.add_incoming(self.memory.value(row.first[self.written_out - 1]), first)
            last.add_incoming(self.memory.value(row.pair[1]), b.block)
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

    def _go_on_if(self, condition: Any, end: Any) -> None:
        following = self.builder.append_basic_block("order")
        self.builder.cbranch(condition, following, end)
        self.builder.position_at_end(following)

    def _advance(self) -> None:
        """Append the coefficient of this order to every node's series."""
        for row, node in zip(self.rows, self.nodes, strict=True):
            op = node[0]
            ended = self.ahead is not None and row.degree is not None
            if ended or op in ("coordinate", "velocity"):
                continue
            if op in (*LEAVES, "constant"):
                self.push(row, self.loops.value(node[1]) if op == "form" else self._leaf(node))
                continue
            with self._before_sums(row):
                self._apply(op, row, node[1:])

    def _apply(self, op: str, row: Row, operands: Node) -> None:
        """Append a coefficient by the operation's rule."""
        if op in ARITHMETIC:
            ARITHMETIC[op](self, row, *(self.rows[i] for i in operands))
        elif (recurrence := FUNCTIONS[op].recurrence) is not None:
            recurrence(self, row, self.rows[operands[0]])
        elif row.degree == 0:
            self.push(row, self.start(self.rows[operands[0]]).function(op) if self.starts else None)
        else:
            by_slope(self, row, self.rows[operands[0]], self.rows[operands[1]], operands[2], op)

    def _leaf(self, node: Node) -> Coefficient:
        if node[0] == "record":
            if self.starts:
                self._records[node[1]] = self.memory.record_series(node[1])
            return self._records[node[1]][self.order] if self.order < RECORD_WIDTH else None
        if self.order == 0:
            return self.memory.leaf(node)
        return 1.0 if node[0] == "time" and self.order == 1 else None

    def _integrate(self, row: Row, slope: Coefficient) -> None:
        """Append to a position or velocity the coefficient of the next order, from that of its
        derivative at this one.
        """
        value = self._divided(slope, 1)
        if self.ahead != 1:
            self.push(row, value)
        self._write(row.place, value, 1)

    def _write_slope(self, velocity: Any, acceleration: Any, value: Coefficient) -> None:
        """Put a coefficient of a velocity that is computed into memory, and that of its derivative
        one order below; those that would come next are 0."""
        self._write(velocity, value)
        self._write(velocity, None, 1)
        if acceleration is not None:
            number = float(self.order) if self.ahead is None else self._number + float(self.ahead)
            if not self.starts:
                self._write(acceleration, multiply(number, value), -1)
            self._write(acceleration, None)

    def _write(self, place: Any, value: Coefficient, more: int = 0) -> None:
        """Put a coefficient of this order, or of a following one, into a series in memory."""
        index = (
            LONG(self.order + more)
            if self.ahead is None
            else self.builder.add(self.order, LONG(self.ahead + more))
        )
        self._put(place, index, value)

    # --- what a rule uses ----------------------------------------------------

    @property
    def starts(self) -> bool:
        """Whether this is order 0."""
        return self.ahead is None and self.order == 0

    def start(self, row: Row) -> Vec:
        """Coefficient 0, as a vector."""
        return Vec(self.builder, self.memory.value(row.first[0]), self.memory.arithmetic)

    def push(self, row: Row, value: Coefficient) -> None:
        """Append the coefficient of this order to a series."""
        (row.first if self.ahead is None else row.pair).append(value)

    def now(self, row: Row) -> Coefficient:
        """The coefficient of this order."""
        if self.ahead is None:
            return row.first[int(self.order)]
        return row.pair[self.ahead] if row.degree is None else None

    def scaled(self, u: Row, newest: bool = True) -> Row:
        """The series j u_j, up to this order, or up to the one before if u is not known further."""
        row = self._scaled.setdefault(id(u), Row(u.degree, u.early))
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
        """j u_j at this order of a pair; from velocities, which are known sooner, if u is made of
        positions and constants.
        """
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

    def per_order(self, value: Coefficient) -> Coefficient:
        """A number divided by this order."""
        return self._divided(value, 0)

    def over(self, value: Coefficient, row: Row) -> Coefficient:
        """A number divided by coefficient 0 of a series."""
        if value is None:
            return None
        arithmetic = self.memory.arithmetic
        start = self.start(row)
        if not arithmetic.divides and id(row) not in self._inverses:
            self._inverses[id(row)] = start.inverse()
        if arithmetic.divides or (arithmetic.exact and self.ahead is None):
            return value / start
        return quotient(value, *self._inverses[id(row)])

    def product(self, a: Row, b: Row, first: bool = True, last: bool = True) -> Coefficient:
        """sum_{j=0}^{k} a_j b_{k-j} for this order k; without a_0 b_k if not `first`, without a_k
        b_0 if not `last`.
        """
        if self.ahead is None:
            k = self.order
            return dot(
                [
                    (a.first[j], b.first[k - j])
                    for j in range(0 if first else 1, k + 1 if last else k)
                ]
            )
        for one, other, whole in ((a, b, first), (b, a, last)):
            if one.degree is not None:
                return dot(
                    [
                        (one.first[j], self._back(other, j))
                        for j in range(one.degree, -1 if whole else 0, -1)
                    ]
                )
        forward, backward = (a, b) if b.early or not a.early else (b, a)
        newest = [(b.early, a.first[0], self.now(b))] if first else []
        newest += [(a.early, self.now(a), b.first[0])] if last else []
        if self.ahead == 1:
            newest += [(False, forward.pair[0], backward.first[1])]
            newest += [] if backward.early else [(False, forward.first[1], backward.pair[0])]
        newest.sort(key=lambda term: not term[0])  # terms that are known last are added last
        return dot(
            [(one, other) for _, one, other in newest], self._earlier(forward, backward)[self.ahead]
        )

    # --- memory --------------------------------------------------------------

    def _is_known(self, row: Row) -> bool:
        return len(row.first) > self.order if self.ahead is None else len(row.pair) > self.ahead

    def _divided(self, value: Coefficient, more: int) -> Coefficient:
        """A number divided by this order, or by a following one."""
        arithmetic = self.memory.arithmetic
        if value is None or (self.ahead is None and self.order + more == 1):
            return value
        if self.ahead is None:
            k = self.order + more
            return value / float(k) if arithmetic.exact else multiply(1.0 / k, value)
        if arithmetic.divides:
            return value / (self._number + float(self.ahead + more))
        index = self.builder.add(self.order, LONG(self.ahead + more))
        parts = [
            self.builder.load(self.builder.gep(table, [LONG(0), index])) for table in self._tables
        ]
        return quotient(value, *(arithmetic.everywhere(self.builder, part) for part in parts))

    def _before_sums(self, row: Row) -> AbstractContextManager[Any]:
        """The place for the code of a series' coefficient: before the sums if all that it needs is
        known there.
        """
        return (
            self.builder.goto_block(self._head) if self.ahead == 0 and row.early else nullcontext()
        )

    def _back(self, row: Row, j: int) -> Coefficient:
        """A row's coefficient j orders below the present one, while a pair of orders is written."""
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
                self._lasts[id(row)] = row, self.builder.phi(self._kind)
        return Vec(self.builder, self._lasts[id(row)][1], self.memory.arithmetic)

    def _earlier(self, forward: Row, backward: Row) -> tuple[Vec, Vec]:
        """The sums of a product for both orders of a pair, made in an inner loop."""
        key = (id(forward), id(backward))
        if key not in self._sums:
            if not self._loops or self._loops[-1].made == SETTINGS.most_sums:
                self._loops.append(InnerLoop(self))
            self._sums[key] = self._loops[-1].sums(forward, backward)
        return self._sums[key]

    def _at(self, row: Row, index: Any) -> Vec:
        """A coefficient from memory; the series is kept in memory from now on."""
        if row.place is None:
            with self.builder.goto_entry_block():
                row.place = self.builder.alloca(self._kind, self.layout.capacity)
            row.place.align = min(CACHE_LINE, 8 * self.memory.arithmetic.width)
            self._kept.append(row)
        return Vec(
            self.builder,
            self.memory.load_from(self.builder.gep(row.place, [index])),
            self.memory.arithmetic,
        )

    def _put(self, place: Any, index: Any, value: Coefficient) -> None:
        self.builder.store(self.memory.value(value), self.builder.gep(place, [index])).align = 8

    @property
    def _kind(self) -> Any:
        return self.memory.arithmetic.of(DOUBLE)

    def _keep(self, row: Row, first: Any) -> None:
        """Keep a series in memory: its first orders from the block `first` on, and the orders of
        pairs from here on.
        """
        ended = [None] * (self.layout.capacity - len(row.first)) if row.degree is not None else []
        with self.builder.goto_block(first):
            for j, value in enumerate([*row.first, *ended]):
                self._put(row.place, LONG(j), value)
        for j, value in enumerate(row.pair):
            self._put(row.place, self.builder.add(self.order, LONG(j)), value)
