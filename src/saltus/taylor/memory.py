"""The memory of generated code: the arguments of its function, from which it reads and into which
it writes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from saltus.taylor.graph import RECORD_WIDTH, Expr, combine, number, ordered, substitute
from saltus.taylor.load_tables import expand_record
from saltus.taylor.numba_types import Array
from saltus.taylor.rules import FUNCTIONS
from saltus.taylor.vectors import DOUBLE, LONG, Arithmetic, Vec, loop

Node = tuple[Any, ...]
Constants = dict[Expr, int]


@dataclass(frozen=True)
class Tape:
    """Nodes, and the places of the roots among them."""

    nodes: list[Node]
    roots: list[int]


def shared_constants(roots: Sequence[Expr]) -> Constants:
    """The largest parts of the roots that depend on parameters alone; they are computed once for a
    motion and kept in a table.
    """
    fixed: dict[int, bool] = {}
    table: Constants = {}
    for node in ordered(list(roots)):
        fixed[id(node)] = (
            all(fixed[id(a)] for a in node.args)
            if node.args
            else node.op in ("number", "parameter")
        )
        if not fixed[id(node)]:
            _enter(table, [a for a in node.args if fixed[id(a)]])
    _enter(table, [root for root in roots if fixed[id(root)]])
    return table


def _enter(table: Constants, nodes: list[Expr]) -> None:
    for node in nodes:
        if node.args:
            table.setdefault(node, len(table))


def tape(roots: Sequence[Expr], known: Constants | None = None, series: bool = False) -> Tape:
    """The tape of the roots; parts that are in the table `known` are leaves of it. For series it
    has the slopes of functions too."""
    nodes: list[Node] = []
    place: dict[int, int] = {}
    known, waiting = known or {}, list(reversed(roots))
    while waiting:
        for node in _below(waiting.pop(), place, known):
            place[id(node)] = len(nodes)
            rule = FUNCTIONS.get(node.op)
            if node in known:
                nodes.append(("constant", known[node]))
            elif not node.args:
                nodes.append((node.op,) if node.value is None else (node.op, node.value))
            elif series and rule is not None and rule.recurrence is None and node.degree != 0:
                slope, factor = _factored(rule.slope(node.args[0], node))
                waiting.insert(0, slope)
                nodes.append((node.op, place[id(node.args[0])], slope, factor))
            else:
                nodes.append((node.op, *(place[id(a)] for a in node.args)))
    placed = [
        tuple(place[id(part)] if isinstance(part, Expr) else part for part in node)
        for node in nodes
    ]
    return Tape(placed, [place[id(root)] for root in roots])


def _below(root: Expr, placed: dict[int, int], known: Constants) -> list[Expr]:
    """The nodes below a root that are not on the tape yet, operands first; parts that are known are
    leaves.
    """
    found: dict[int, Expr] = {}
    stack = [(root, False)]
    while stack:
        node, ready = stack.pop()
        if id(node) in placed or id(node) in found:
            continue
        if ready or node in known or not node.args:
            found[id(node)] = node
        else:
            stack.append((node, True))
            stack.extend((a, False) for a in reversed(node.args))
    return list(found.values())


def _factored(slope: Expr) -> tuple[Expr, float]:
    """A slope as a number times an expression that the tape may have anyway; for a cosine, -1 times
    the sine.
    """
    if slope.op == "mul" and slope.args[0].op == "number":
        return slope.args[1], slope.args[0].value
    return slope, 1.0


# the arrays that the argument `env` is made of
ENVIRONMENT = ("parameters", "constants", "breaks", "table")
# an argument and, where it is an array, the element, row of a matrix or slot of one vector
Place = tuple[str, int]


@dataclass(frozen=True)
class Places:
    """The arguments of a function, and which of them holds the leaves of each kind, from which
    element on.

    The kinds of leaves are `time`, `origin`, `side`; `coordinate`, `velocity`, `parameter` and
    `constant`, of which there are several; and `record`. Records are in `table`, and the code
    expands them about the time. If another argument is given for them, it holds their coefficients
    already expanded about the time `record_time`.

    `parts` are the names of parts of the first argument, in whose places names of arguments may
    stand; the argument `places` has their first slots, which are thus no part of the code.
    """

    arguments: tuple[str, ...]
    leaves: dict[str, Place]
    parts: tuple[str, ...] = ()


class Memory:
    """The arguments of a function while its code is written."""

    def __init__(
        self, builder: Any, arithmetic: Arithmetic, places: Places, arguments: tuple[Any, ...]
    ) -> None:
        self.builder, self.arithmetic, self.leaves = builder, arithmetic, places.leaves
        self.arguments: dict[str, Any] = dict(zip(places.arguments, arguments, strict=True))
        if "env" in self.arguments:
            self.arguments |= zip(ENVIRONMENT, self.arguments["env"], strict=True)
        self.arguments |= {name: self._part(k) for k, name in enumerate(places.parts)}

    def _part(self, k: int) -> Array:
        """A part of the first argument."""
        b = self.builder
        whole = next(iter(self.arguments.values()))
        first = b.load(b.gep(self.arguments["places"].data, [LONG(k)]))
        return Array(b.gep(whole.data, [b.mul(first, LONG(self.arithmetic.width))]), (None,))

    def pointer(self, place: Place) -> Any:
        """LLVM's pointer to an element of an array, to the first one of a row of a matrix, or to a
        slot of one vector.
        """
        name, index = place
        array = self.arguments[name]
        wide = self.arithmetic.width
        offset = (
            LONG(index * wide)
            if len(array.shape) == 1
            else self.builder.mul(LONG(index), array.shape[1])
        )
        return self.builder.bitcast(
            self.builder.gep(array.data, [offset]), self.arithmetic.of(DOUBLE).as_pointer()
        )

    def load(self, place: Place) -> Vec:
        """A number."""
        argument = self.arguments[place[0]]
        return Vec(
            self.builder,
            self.load_from(self.pointer(place)) if hasattr(argument, "shape") else argument,
            self.arithmetic,
        )

    def load_from(self, pointer: Any) -> Any:
        """LLVM's value behind a pointer."""
        loaded = self.builder.load(pointer)
        loaded.align = 8
        return loaded

    def whole(self, pointer: Any) -> Any:
        """LLVM's whole number of the number behind a pointer, the same in all lanes."""
        loaded = self.load_from(pointer)
        first = (
            loaded if self.arithmetic.width == 1 else self.builder.extract_element(loaded, LONG(0))
        )
        return self.builder.fptosi(first, LONG)

    def store(self, place: Place, value: Vec | float | None) -> None:
        """Put a number into an array."""
        self.builder.store(self.value(value), self.pointer(place)).align = 8

    def value(self, number: Vec | float | None) -> Any:
        """LLVM's value of a number."""
        return number.value if isinstance(number, Vec) else self.arithmetic.constant(number or 0.0)

    def leaf(self, node: Node) -> Vec | float:
        """The number of a leaf, at the time for which the leaves are given."""
        op, *index = node
        if op == "number":
            return float(index[0])
        if op == "record":
            coefficients = self._piece(index[0])
            since = self._since()
            value: Vec = coefficients[-1]
            for coefficient in coefficients[-2::-1]:
                value = value * since + coefficient
            return value
        if op == "form":
            return self._sum_over_modes(index[0])
        name, first = self.leaves[op]
        return self.load((name, first + (index[0] if index else 0)))

    def of_column(self, leaf: Node, dof: int, column: Any) -> Vec:
        """What LLVM's column of a tangent has in a leaf's place, in the state of a model of so many
        coordinates.
        """
        b = self.builder
        op, *index = leaf
        offset = column if op == "shift" else b.mul(LONG(dof), b.add(column, LONG(1)))
        if op == "form":
            return self._sum_over_modes(index[0], offset)
        name, first = self.leaves[op]
        own = self.pointer((name, first + (0 if op == "shift" else index[0])))
        return Vec(b, self.load_from(b.gep(own, [offset])), self.arithmetic)

    def _sum_over_modes(self, form: ModeSum, offset: Any = None) -> Vec:
        """A sum over modes at an instant, of the motion, or of a column whose state lies so far
        behind its own.
        """
        b = self.builder
        data = self.pointer(self.leaves["datum"])
        parts = list[tuple[Any, int]]()
        for op, place in (("coordinate", form.amplitudes), ("velocity", form.rates)):
            if place is not None:
                name, first = self.leaves[op]
                state = self.pointer((name, first + form.first))
                parts.append((state if offset is None else b.gep(state, [offset]), place))
        after = list[Vec]()
        with loop(b, 0, self.whole(data), [self.arithmetic.number(b, 0.0)], after) as (i, (total,)):
            for state, place in parts:
                datum = b.gep(data, [b.add(b.mul(i, LONG(form.record)), LONG(1 + place))])
                factor, value = (
                    Vec(b, self.load_from(p), self.arithmetic) for p in (datum, b.gep(state, [i]))
                )
                total = total + factor * value
            after.append(total)
        return after[0]

    def record_series(self, row: int) -> Any:
        """The Taylor coefficients of a record about the time."""
        coefficients = self._piece(row)
        if not self._in_table:
            return coefficients
        result = np.empty(RECORD_WIDTH, dtype=object)
        expand_record(coefficients, 0.0, self._since(), result)
        return result

    @property
    def _in_table(self) -> bool:
        return self.leaves["record"][0] == "table"

    def _piece(self, row: int) -> Any:
        """The coefficients of a record's current piece, as they are in memory."""
        name, first = self.leaves["record"]
        result = np.empty(RECORD_WIDTH, dtype=object)
        for k in range(RECORD_WIDTH):
            place = (
                self._element(row, k)
                if self._in_table
                else self.pointer((name, first + row * RECORD_WIDTH + k))
            )
            result[k] = Vec(self.builder, self.load_from(place), self.arithmetic)
        return result

    def _element(self, row: int, k: int) -> Any:
        """LLVM's pointer to a coefficient of the current piece in the table of records."""
        table = self.arguments["table"]
        b = self.builder
        piece = b.add(b.mul(LONG(row), table.shape[1]), self.arguments["piece"])
        return b.gep(table.data, [b.add(b.mul(piece, table.shape[2]), LONG(k))])

    def _since(self) -> Any:
        """The time since the instant from which a record's coefficients count."""
        time: Any = self.leaf(("time",))
        if not self._in_table:
            return time - self.load(self.leaves["record_time"])
        before = self.builder.sub(self.arguments["piece"], LONG(1))
        index = self.builder.select(self.builder.icmp_signed("<", before, LONG(0)), LONG(0), before)
        # as `load_tables.anchor` has it
        anchor = self.load_from(self.builder.gep(self.arguments["breaks"].data, [index]))
        return time + self.leaf(("origin",)) - Vec(self.builder, anchor, self.arithmetic)


# --- modes and columns of a tangent, whose equations are written as loops (`Loops` in `rules.py`)
# ---

# The modes of a linear structure obey
#
#     z_i'' = -w_i^2 z_i - sum_j D_ij z_j' + sum_r c_ri s_r,
#
# where the inputs s_r are other coordinates, their rates, or expressions such as loads. The other
# coordinates read of them the sums sum_i k_i z_i + d_i z_i', the leaves "form" of their
# expressions. The columns of a tangent obey the same equations.
#
# The coefficients are numbers behind the constants, the leaves "datum": the number of modes, a
# record for each mode, and the rows of D where it couples modes. The code reads the number of modes
# there, and is the same for any number.


class ModeSum(NamedTuple):
    """A sum over modes, by the places in their records of the coefficients of their amplitudes and
    of their rates.
    """

    amplitudes: int
    rates: int | None  # None: the sum has none
    first: int  # the coordinate that is the first mode, of the motion or of a column of its tangent
    record: int  # how many numbers the record of a mode has


class ModeInput(NamedTuple):
    """An input of all modes: a sign, coefficients at a place in their records, and a coordinate, a
    rate or an expression.
    """

    of: Expr
    place: int
    sign: float

    @property
    def local(self) -> bool:
        """Whether it is a coordinate or its rate, in place of which a column of the tangent has its
        own.
        """
        return self.of.op in ("coordinate", "velocity")


@dataclass(frozen=True)
class ModeBlock:
    """The modes of a traced structure."""

    first: int  # the coordinate that is the first of them
    # a number of the code's memory, so that it is no part of its text
    count: int = field(repr=False)
    square: int  # the place of w^2 in a record
    damping: int | None  # that of D's diagonal
    record: int  # how many numbers a record has
    coupled: bool  # whether D has rows, behind the records, or its diagonal alone
    forms: tuple[ModeSum, ...]
    inputs: tuple[ModeInput, ...]
    # of each column of the tangent, besides the inputs that are local
    columns: tuple[tuple[ModeInput, ...], ...] = ()

    @property
    def channels(self) -> int:
        """The number of the load's channels (see `ModeRecord` of structures)."""
        end = self.record if self.damping is None else self.damping
        return end - 1 - self.first

    @property
    def data(self) -> int:
        """How many numbers there are."""
        return 1 + self.record * self.count + (self.count**2 if self.coupled else 0)

    @property
    def expressions(self) -> list[Expr]:
        """The inputs that are expressions, of the motion and then of the columns."""
        return [
            each.of
            for each in (*self.inputs, *(x for column in self.columns for x in column))
            if not each.local
        ]

    def written_out(self, place: int) -> Expr:
        """The acceleration of a mode at its place among the coordinates, as an expression."""
        i = place - self.first
        total = -(self._datum(i, self.square) * Expr("coordinate", (), place))
        if self.damping is not None and not self.coupled:
            total = total - self._datum(i, self.damping) * Expr("velocity", (), place)
        for k in range(self.count if self.coupled else 0):
            total = total - self._datum(self.count, i * self.count + k) * Expr(
                "velocity", (), self.first + k
            )
        for each in self.inputs:
            total = total + each.sign * (self._datum(i, each.place) * each.of)
        return total

    def _datum(self, mode: int, place: int) -> Expr:
        return Expr("datum", (), 1 + mode * self.record + place)


class ColumnSum(NamedTuple):
    """A number that each column of a tangent has: the sum over leaves of the slope to it times what
    the column has in its place, and what is pushed in the columns of parameters; divided by `over`,
    if it is given."""

    terms: tuple[tuple[Expr, Expr], ...]  # (leaf, slope)
    pushes: tuple[Expr | None, ...]  # of the last columns; None: nothing
    over: Expr | None = None

    @classmethod
    def of(
        cls, terms: Sequence[tuple[Expr, Expr]], pushes: Sequence[Expr], over: Expr | None
    ) -> ColumnSum:
        """The sum without what is 0."""
        pushed = tuple(None if push is number(0.0) else push for push in pushes)
        return cls(tuple(term for term in terms if term[1] is not number(0.0)), pushed, over)

    @property
    def expressions(self) -> list[Expr]:
        """All that is computed once for all columns."""
        pushes = [push for push in self.pushes if push is not None]
        return [
            *(slope for _, slope in self.terms),
            *pushes,
            *([] if self.over is None else [self.over]),
        ]


@dataclass(frozen=True)
class LoopRows:
    """The equations that are loops over modes and the columns of a tangent, and the places of the
    first coordinate's series.
    """

    positions: tuple[str, int]
    velocities: tuple[str, int]
    accelerations: tuple[str, int]
    dof: int = field(repr=False)  # of the model; that of modes is a number of the code's memory
    columns: int  # of the tangent
    with_accelerations: bool  # whether those of the columns are kept
    modes: ModeBlock | None
    sums: tuple[ColumnSum, ...]  # the accelerations of the local coordinates of the columns
    first_order: tuple[int, ...]  # those of them that are velocities

    @property
    def expressions(self) -> list[Expr]:
        """The series of the motion that the loops read."""
        own = [] if self.modes is None else self.modes.expressions
        return [*own, *(x for each in self.sums for x in each.expressions)]


class LocalPart(tuple[Expr, ...]):
    """The local coordinates of a structure, or their rates, for its equations with the modes in
    loops (see `memory.py`).
    """

    first: int  # the coordinate that is the first mode
    sums: list[ModeSum]

    def sum_over_modes(self, record: int, amplitudes: int, rates: int | None = None) -> Expr:
        """The sum over modes of coefficients, at places in their records of that length, times
        amplitudes and rates.
        """
        form = ModeSum(amplitudes, rates, self.first, record)
        self.sums += [] if form in self.sums else [form]
        return Expr("form", (), form)


def local_parts(q: Any, v: Any, local: int) -> tuple[LocalPart, LocalPart]:
    """The local coordinates and their rates."""
    parts = (LocalPart(q[:local]), LocalPart(v[:local]))
    sums = list[ModeSum]()
    for part in parts:
        part.first = local
        part.sums = sums
    return parts


def mode_block(equations: Any, first: int, count: int, sums: Sequence[ModeSum]) -> ModeBlock:
    """The modes from what a model answers to `mode_equations`."""
    places, coupled, given = equations
    inputs = [ModeInput(combine("add", of, 0.0), place, sign) for of, place, sign in given]
    known = tuple(each for each in inputs if each.of is not number(0.0))
    return ModeBlock(
        first, count, places.square, places.damping, places.size, coupled, tuple(sums), known
    )


def without_modes(root: Expr, block: ModeBlock) -> Expr:
    """An expression in which no accelerations of modes are leaves."""
    leaves: dict[Expr, Any] = {
        node: block.written_out(node.value) for node in ordered([root]) if node.op == "mode"
    }
    return substitute(root, leaves) if leaves else root


def leaves_of(root: Expr) -> list[Expr]:
    """What of the state an expression depends on, in an order that is always the same."""
    leaves = {node for node in ordered([root]) if node.op in ("coordinate", "velocity", "form")}
    return sorted(leaves, key=lambda leaf: (leaf.op == "form", leaf.value, leaf.op))
