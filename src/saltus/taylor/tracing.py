"""From a system to its structure: the expressions of the motion with symbols for every number, and
the numbers beside them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, TraceError, near
from saltus.systems import (
    ContactModel,
    DeclaredLoad,
    Harmonic,
    System,
    Transient,
    ask,
    friction_margins,
    mass_rows,
    numbers,
    on_sides,
    reactions,
    solved_motion,
    stick_margins,
)
from saltus.systems import substitute as substitute_numbers
from saltus.taylor.graph import (
    BRANCH,
    FRICTION,
    POINTWISE,
    Expr,
    as_expr,
    check_size,
    combine,
    comparing_symbols,
    differentiate,
    number,
    ordered,
    substitute,
    switching,
    told_of_switches,
    uses_velocity,
)
from saltus.taylor.load_tables import CORNER, LoadTime
from saltus.taylor.memory import (
    ColumnSum,
    LoopRows,
    ModeBlock,
    ModeInput,
    leaves_of,
    local_parts,
    mode_block,
    without_modes,
)
from saltus.taylor.multipliers import held_motion, time_derivative
from saltus.taylor.switches import Switches, called, pointwise

if TYPE_CHECKING:
    from fractions import Fraction

FREQUENCY = "load.frequency"
NO_SHARE = number(2.0)  # of the sides of a function along which no motion slides
MOST_BITS = (
    62  # of contacts, and two for each friction, surface and switch, in the number of a mode
)


@dataclass(frozen=True)
class SidedPart:
    """A part with two sides: what the row of a friction, a surface or a switch of the force says
    of it, by the names of `PartKind` and `PartColumn` (`flow/kernel/contact_layout.py`).
    """

    kind: str  # in lower case: "friction", "surface", "function", "relay"
    # that it acts along, or looks at; of a function, which has none, the number of coordinates
    coordinate: int
    contact: int = -1  # whose reaction presses it, -1 for none
    # further columns of its row, with their numbers: RESETS of one that resets the state
    marks: tuple[tuple[str, int], ...] = ()
    remembered: bool = False  # whether the state does not tell its side

    @property
    def is_surface(self) -> bool:
        """Whether it is no friction."""
        return self.kind != "friction"

    @property
    def is_function(self) -> bool:
        """Whether its guard is a function, whose series is in the place of its first margin."""
        return self.kind not in ("friction", "surface")

    @property
    def place(self) -> int:
        """The coordinate of a friction; -1 less that of all others."""
        return -1 - self.coordinate if self.is_surface else self.coordinate


@dataclass(eq=False)
class Trace:
    """The expressions of a system's motion; leaves are the time, the coordinates, the velocities,
    the side and the parameters.

    `acceleration`, one for each coordinate; `gap` and `gap_rate` (its derivative to the coordinate
    at contact); `contact`; `contact_acceleration`, the second derivative of the gap at rest at
    contact, a function of the time alone, and `contact_damping`, minus its derivative to the
    velocity; `next_side` and `velocity_after`, the reset; `margins` to stop at.

    A model with several contacts has `reactions`; `mass`, the mass matrix row by row;
    `restitution`, the rows of E; `positions`. Its leaves include `free`, 1 for each coordinate that
    no contact holds, else 0. With frictions there are, behind the reactions, the two margins of
    each (`stick_margins`), and the leaves `slide`, the direction in which each slides, 0 if it
    sticks. A surface has two numbers in the place of these margins, and its side. Frictions,
    surfaces and switches of the force are the parts `sided`, in this order, with their `levels`.

    With a tangent `acceleration` goes on after the model's own `dof` with that of its `columns`.
    Column j is the derivative to the j-th initial coordinate, then to the j-th initial velocity,
    then to the number at the j-th of `paths`. With u = dq/dc and z = dv/dc it obeys, along an arc,
    u' = z and

        z' = a_q u + a_v z + a_c.

    All derivatives are at a fixed time. If c is the forcing frequency W, one must note that the
    kernel's time counts from `origin`, whole forcing periods after 0, and that a load depends on n
    W (origin + t). Therefore a_c = a_W + (origin / W) a_t, where a_t leaves out the records.
    """

    model: str = ""  # its name
    parameters: list[str] = field(default_factory=list)
    dof: int = 1  # of the model
    first_order: int = 0  # how many of its coordinates, the last ones, are of first order
    # how many of these are sums of others, with minus their coefficients in their rows of `mass`
    dependent: int = 0
    columns: int = 0
    paths: tuple[str, ...] = ()  # of the parameters that the last columns are derivatives to
    # dotted path, order of the derivative (see `load_tables.py`)
    records: list[tuple[str, int]] = field(default_factory=list)
    side_count: int = 0  # of the contact
    acceleration: list[Expr] = field(default_factory=list)
    gap: Expr | None = None
    gap_rate: Expr | None = None
    contact: Expr | None = None
    contact_acceleration: Expr | None = None
    contact_damping: Expr | None = None
    next_side: Expr | None = None
    velocity_after: Expr | None = None
    margins: dict[str, Expr] = field(default_factory=dict)
    reactions: list[Expr] = field(default_factory=list)
    mass: list[Expr] = field(default_factory=list)
    restitution: list[Expr] = field(default_factory=list)
    # of contacts and frictions, behind them of surfaces, that multipliers hold: the entries and the
    # drift of each, then the gaps
    rows: list[Expr] = field(default_factory=list)
    limits: dict[str, Expr] = field(default_factory=dict)  # margins of these frictions
    with_pulls: bool = False  # whether the second derivatives of these gaps are series too
    positions: list[Expr] = field(default_factory=list)
    # for each contact, the coordinates of first order after an impact on it
    jumps: list[Expr] = field(default_factory=list)
    # for each surface that resets the state, the coordinates, then the velocities, after its event
    resets: list[Expr] = field(default_factory=list)
    signs: tuple[int, ...] = ()  # of the contacts
    contact_coordinates: tuple[int, ...] = ()  # the coordinate that each contact holds
    sided: tuple[SidedPart, ...] = ()  # frictions, surfaces, switches of the force
    # at which the guards of these are 0: the speed of a friction's ground, a surface's position
    levels: list[Expr] = field(default_factory=list)
    # with frictions in contacts: `has_phases`, then each
    coefficients: list[Expr] = field(default_factory=list)
    # of switches of the force, which are the last of the rows of frictions and surfaces, the names
    switches: tuple[str, ...] = ()
    jumping: frozenset[int] = frozenset()  # the rows of those at which the force may jump
    modes: ModeBlock | None = None  # of a structure; their accelerations are leaves "mode"
    # the accelerations of all columns, which are then leaves "mode" too
    sums: tuple[ColumnSum, ...] = ()

    @property
    def first_order_rows(self) -> tuple[int, ...]:
        """The coordinates of first order, those of the tangent's columns included: `acceleration`
        has their velocities.
        """
        return tuple(
            i for i in range(len(self.acceleration)) if i % self.dof >= self.dof - self.first_order
        )

    @property
    def local(self) -> int:
        """The number of its first coordinates on which impacts act: all, or the local ones of a
        structure.
        """
        return self.dof if self.modes is None else self.modes.first

    @property
    def repeats(self) -> bool:
        """Whether the breakpoints of its records are corners that return in each forcing period."""
        return any(code >= CORNER for _, code in self.records)

    @property
    def corner_column(self) -> int:
        """1 plus the column along the frequency, with which these corners move; 0 without them."""
        moves = self.repeats and FREQUENCY in self.paths
        return 1 + 2 * self.dof + self.paths.index(FREQUENCY) if moves else 0

    @property
    def several(self) -> bool:
        """Whether there are contacts or frictions that may hold its coordinates, one by one."""
        return bool(self.signs or self.sided)

    @property
    def contact_numbers(self) -> list[Expr]:
        """The mass matrix, E, positions, jumps, resets, coefficients of frictions in contacts,
        speeds of grounds, rows of multipliers: what events need.
        """
        return [
            *self.mass,
            *self.restitution,
            *self.positions,
            *self.jumps,
            *self.resets,
            *self.coefficients,
            *self.levels,
            *self.rows,
        ]

    @property
    def multipliers(self) -> int:
        """How many rows multipliers may hold, of contacts and frictions; surfaces are among them."""
        return len(self.signs) + len(self.sided) if self.rows else 0

    @property
    def flags(self) -> int:
        """How many leaves `free` there are: of coordinates, or of rows that multipliers hold."""
        return self.multipliers or self.local

    @property
    def has_fixed_rows(self) -> bool:
        """Whether the rows that multipliers hold do not change with the time at a fixed state."""
        return all(self.time_derivative(root) is number(0.0) for root in self.rows)

    @property
    def local_rows(self) -> list[int]:
        """The coordinates, with those of the tangent's columns, whose accelerations are expressions
        of their own.
        """
        return [i for i, a in enumerate(self.acceleration) if a.op != "mode"]

    def loop_rows(self, places: Sequence[Any], with_accelerations: bool) -> LoopRows | None:
        """The equations in loops over modes and columns, or None, with the places of the first
        coordinate's series.
        """
        first_order = tuple(i for i in self.first_order_rows if i < self.dof)
        at = (places[0], places[1], places[2])
        counts = (self.dof, self.columns)
        return (
            LoopRows(*at, *counts, with_accelerations, self.modes, self.sums, first_order)
            if self.modes or self.sums
            else None
        )

    @property
    def inputs_of_loops(self) -> list[Expr]:
        """The expressions that these loops read, which need no places."""
        return [] if (rows := self.loop_rows([("", 0)] * 3, False)) is None else rows.expressions

    @property
    def in_loops(self) -> bool:
        """Whether the tangent's equations are written once, in loops over columns; of one
        coordinate others are 5 % faster.
        """
        return self.columns > 0 and (self.dof > 1 or self.modes is not None)

    def symbol(self, path: str, value: float) -> Expr:
        """The symbol of the number at a dotted path."""
        self.parameters.append(path)
        return Expr("parameter", (), len(self.parameters) - 1)

    @property
    def functions(self) -> tuple[int, ...]:
        """The rows of sided parts that are functions."""
        return tuple(k for k, part in enumerate(self.sided) if part.is_function)

    @property
    def places(self) -> tuple[int, ...]:
        """The coordinate of each friction, then -1 less that of each other sided part."""
        return tuple(part.place for part in self.sided)

    @property
    def keeping_sides(self) -> frozenset[int]:
        """The rows of sided parts whose side is not always the sign of their guard: they remember
        it, or reset the state."""
        return frozenset(
            k for k, part in enumerate(self.sided) if part.remembered or dict(part.marks)
        )

    def append_switches(self, names: tuple[str, ...], functions: list[Expr]) -> None:
        """Append the rows of the switches of the force, behind those of the surfaces."""
        count = len(self.signs)
        first = len(self.sided)
        more = len(functions)
        if more and count + 2 * (first + more) > MOST_BITS:
            raise TraceError(
                f"{self.model} has {more} switches, such as absolute values and comparisons, and at"
                f" most {(MOST_BITS - count) // 2 - first} can be followed beside its parts"
            )
        empty = [number(0.0)] * more
        margins = [x for function in functions for x in (function, NO_SHARE)]
        series = self.reactions
        last = count + 2 * first
        held = last + count + first if self.rows else last
        between = series[last:held] + (empty if self.rows else [])
        self.reactions = series[:last] + margins + between + series[held:]
        if self.rows:
            gaps = len(self.rows) - count
            self.rows = self.rows[:gaps] + empty * (self.dof + 1) + self.rows[gaps:]
        if self.coefficients:
            self.coefficients = self.coefficients + empty
        self.levels = self.levels + empty
        self.sided += (SidedPart("function", self.dof),) * more
        self.switches = tuple(called(function, names, self.parameters) for function in functions)

    def let_slide(self, kept: set[Expr]) -> None:
        """Let the equations hold along functions too, with 0 for a side: there the accelerations
        are the mean of both sides by which the function stays at 0 (Filippov),

            h'(s) = (p + m s) / 2,    s = -p / m,

        with the sum p and the difference m of its rates on the sides +1 and -1. That s stands in
        the place of the second margin. What is 0 with a function, such as absolute values, is `kept` as it
        is.
        """
        found = dict[Expr, Any]()
        declared = len(self.sided) - len(self.switches)
        for k in self.functions:
            side = Expr("slide", (), k)
            place = len(self.signs) + 2 * k
            if (k >= declared and k not in self.jumping) or k in self.keeping_sides:
                continue
            own = {part: part for part in kept if side in ordered([part.args[0]])}
            means = [_mean_of_sides(a, side, own) for a in self.acceleration]
            mean = [each for each in means if each is not None]
            if len(mean) < len(means):
                continue
            above, below = (
                self.rate_along(
                    substitute(self.reactions[place], {side: s}),
                    [substitute(a, own | {side: s}) for a in mean],
                )
                for s in (1.0, -1.0)
            )
            apart = above - below
            if apart is number(0.0):
                continue
            self.acceleration = mean
            share = -((above + below) * apart) / (apart * apart + side * side)
            self.reactions[place + 1] = share
            found |= own
            found[side] = side + (1.0 - side * side) * share
        if found:
            for roots in (self.acceleration, self.reactions):
                shares = {len(self.signs) + 2 * k + 1 for k in self.functions}
                for i, root in enumerate(roots):
                    if roots is self.acceleration or i not in shares:
                        roots[i] = substitute(root, found)
            self.margins = {name: substitute(x, found) for name, x in self.margins.items()}

    def rate_along(self, root: Expr, accelerations: list[Expr]) -> Expr:
        """The time derivative of an expression of the state along the motion."""
        total = time_derivative(self, root)
        moving = self.dof - self.first_order
        for i, acceleration in enumerate(accelerations[: self.dof]):
            q, v = (Expr(op, (), i) for op in ("coordinate", "velocity"))
            rate = v if i < moving else acceleration
            total = total + differentiate(root, q) * rate
            if i < moving:
                total = total + differentiate(root, v) * acceleration
        return total

    def append_tangent(self, paths: tuple[str, ...]) -> None:
        """Append the tangent's columns as further coordinates; coordinate dof + j dof + d is u_d of
        column j.
        """
        own = list(self.acceleration)
        self.paths = paths
        self.columns = 2 * self.dof + len(paths)
        # the time derivative at a jump of the motion needs these
        for path, order in list(self.records):
            if (path, order + 1) not in self.records:
                self.records.append((path, order + 1))
        if self.in_loops:
            self.sums = tuple(map(self.column_sum, own[: self.local]))
            self.acceleration += [
                Expr("mode", (), place) for place in range(self.dof, self.dof * (1 + self.columns))
            ]
        else:
            self.acceleration += [self.derivative_along(own[0], j) for j in range(self.columns)]
        if self.modes is not None:
            self.modes = replace(
                self.modes, columns=tuple(self._inputs_of_modes(j) for j in range(self.columns))
            )

    def _inputs_of_modes(self, j: int) -> tuple[ModeInput, ...]:
        """The inputs of the modes of column j that are expressions."""
        assert self.modes is not None
        own = [each for each in self.modes.inputs if not each.local] if j >= 2 * self.dof else []
        slopes = [(each, self.partial_derivative(each.of, j)) for each in own]
        return tuple(each._replace(of=slope) for each, slope in slopes if slope is not number(0.0))

    def written_out(self, root: Expr) -> Expr:
        """An expression in which no accelerations of modes are leaves."""
        return root if self.modes is None else without_modes(root, self.modes)

    def tangent_leaves(self, j: int) -> tuple[list[Expr], list[Expr]]:
        """The leaves for u and z of column j, as coordinates and velocities."""
        places = range(self.dof * (1 + j), self.dof * (2 + j))
        return [Expr("coordinate", (), i) for i in places], [
            Expr("velocity", (), i) for i in places
        ]

    def derivative_along(self, root: Expr, j: int) -> Expr:
        """The derivative of an expression of the motion along column j, at a fixed time, written
        out.
        """
        total = self.partial_derivative(root, j)
        for leaf, slope in self.column_sum(root).terms:
            total = total + slope * Expr(leaf.op, (), leaf.value + self.dof * (1 + j))
        return total

    def column_sum(self, root: Expr, over: Expr | None = None) -> ColumnSum:
        """The derivative of an expression of the motion along each column, at a fixed time, divided
        by `over`.
        """
        pushes = [self.partial_derivative(root, j) for j in range(2 * self.dof, self.columns)]
        return ColumnSum.of(
            [(leaf, differentiate(root, leaf)) for leaf in leaves_of(root)], pushes, over
        )

    def partial_derivative(self, root: Expr, j: int) -> Expr:
        """The partial derivative of an expression to column j's parameter, at a fixed time and
        state; 0 for the other columns.
        """
        if j < 2 * self.dof:
            return number(0.0)
        path = self.paths[j - 2 * self.dof]
        leaf = Expr("parameter", (), self.parameters.index(path))
        derivative = differentiate(root, leaf)
        if path == FREQUENCY:
            derivative = derivative + Expr("origin") / leaf * differentiate(root, Expr("time"))
        return derivative

    def time_derivative(self, root: Expr) -> Expr:
        """The partial derivative of an expression to the time, records included."""
        total = differentiate(root, Expr("time"))
        for node in ordered([root]):
            if node.op == "record":
                path, order = self.records[node.value]
                total = total + differentiate(root, node) * Expr(
                    "record", (), self.records.index((path, order + 1))
                )
        return total


def trace(
    system: System,
    stop_at: tuple[str, ...] = (),
    sensitivities: tuple[str, ...] | None = None,
    energy: bool = False,
) -> Trace:
    """Trace the model, the load and the impact law of a system, and the margins at which a motion
    stops.

    If `sensitivities` is given, as dotted paths (maybe none), the tangent is traced as well: the
    derivatives to the state at the start and to the numbers at these paths. With `energy` the
    kinetic energy stands behind the margins.

    Raises
    ------
    TraceError
        There is an operation without a Taylor recurrence, a branch on the state, or a use of the
        time outside the load.
    ParameterError
        The model does not have a margin, or a path leads to no number.
    """
    paths = None if sensitivities is None else check_paths(system, sensitivities)
    sides = system.model.sides
    inner = system.in_gap_coordinates.model
    result = Trace(
        model=type(system.model).__name__, side_count=len(sides), dof=len(inner.coordinates)
    )
    result.first_order, result.dependent = len(inner.first_order), getattr(inner, "dependent", 0)
    result.with_pulls = paths is not None
    twin = substitute_numbers(system.in_gap_coordinates, result.symbol)
    _name_records(twin.load)
    object.__setattr__(twin, "load", DeclaredLoad(twin.load, twin.model))
    model = twin.model
    load = twin.load
    t = LoadTime(result)
    dof = result.dof
    coordinates, velocities = (
        tuple(Expr(op, (), i) for i in range(dof)) for op in ("coordinate", "velocity")
    )
    side = Expr("side") if sides else number(1.0)
    q, v = (coordinates[0], velocities[0]) if dof == 1 else (coordinates, velocities)
    several = model.holds_coordinates
    accelerations = (
        _trace_contacts(result, twin, t, q, v)
        if several
        else _trace_smooth(model, t, q, v, side, load)
    )
    if (
        dof > 1
        and len(accelerations if isinstance(accelerations, (tuple, list)) else [accelerations])
        != dof
    ):
        raise TraceError(
            f"{type(system.model).__name__}.acceleration must return {dof} values, got"
            f" {accelerations!r}"
        )
    one_by_one = accelerations if several or dof > 1 else (accelerations,)
    result.acceleration = [combine("add", a, 0.0) for a in one_by_one]
    # the side of one that remembers, or resets the state, is not the sign of its function
    declared = {
        k: result.reactions[len(result.signs) + 2 * k]
        for k in result.functions
        if k not in result.keeping_sides
    }
    switches = Switches(len(result.sided), declared)
    if several:
        result.acceleration = switches.written(result.acceleration)
        result.reactions = switches.written(result.reactions)
        result.jumps = [pointwise(root) for root in result.jumps]
        result.resets = [pointwise(root) for root in result.resets]
    if sides:
        _trace_contact(result, twin, t, coordinates, velocities, side)
    _check_powers(result.acceleration, _edges(model, result.contact, coordinates))
    _trace_margins(result, twin, t, q, v, side, stop_at)
    if several:
        margins = switches.written(result.margins.values())
        result.margins = dict(zip(result.margins, margins, strict=True))
        # a force may have none under the load that is given
        none = model.has_switches and not result.several and not switches.functions
        first = len(result.sided)
        result.jumping = frozenset(first + place for place in switches.jumping)
        result.append_switches(inner.coordinates, [number(1.0)] if none else switches.functions)
        result.let_slide(switches.kept)
    if energy:
        result.margins["kinetic_energy"] = combine(
            "add", ask_user(model, "kinetic_energy", t, q, v, side, load), 0.0
        )
    _check(result)
    if paths is not None:
        result.append_tangent(paths)
        check_size(result)
    return result


def _mean_of_sides(root: Expr, side: Expr, kept: Iterable[Expr]) -> Expr | None:
    """An expression of a side that is linear in it, and has the given values on both sides; None
    where its formula of one side may be no number on the other one.

    What is 0 where the side changes, such as its absolute values, is `kept` and does not count.
    """
    plain = substitute(root, {part: Expr("slide", (), -1 - i) for i, part in enumerate(kept)})
    if side not in ordered([differentiate(plain, side)]):
        return root
    for node in ordered([plain]):
        if node.op in ("sqrt", "log", "pow", "div") and side in ordered([node.args[-1]]):
            return None
        if node.op in ("sqrt", "log", "pow") and side in ordered([node.args[0]]):
            return None
    same: dict[Expr, Any] = {part: part for part in kept}
    above, below = (substitute(root, same | {side: s}) for s in (1.0, -1.0))
    return 0.5 * (above + below) + 0.5 * side * (above - below)


def _edges(model: Any, contact: Expr | None, coordinates: tuple[Expr, ...]) -> dict[str, Any]:
    """Where a motion begins anew: the coordinate and its value at each contact and surface, by the
    names of these."""
    found: dict[str, Any] = {}
    if contact is not None:
        found["the contact"] = coordinates[0], contact
    for part in (*model.contacts, *model.surfaces) if model.holds_coordinates else ():
        if not isinstance(part.coordinate, str):  # no coordinate has one value there
            continue
        place = model.coordinates.index(part.coordinate)
        what = f"the {type(part).__name__.lower()} {part.name!r}"
        found[what] = coordinates[place], as_expr(part.position)
    return found


def _check_powers(accelerations: list[Expr], edges: dict[str, Any]) -> None:
    """Refuse a root, or a power that is not whole, whose base is provably 0 at a contact or a
    surface: it has no Taylor series there, and no motion gets beyond it.
    """
    if not edges:
        return
    for node in ordered(accelerations):
        if node.op not in ("pow", "sqrt"):
            continue
        for what, (coordinate, place) in edges.items():
            if _known_number(substitute(node.args[0], {coordinate: place})) == 0:
                shown = "u**0.5" if node.op == "sqrt" else "u**p, such as u**1.5,"
                raise TraceError(
                    f"a power {shown} has no Taylor series where u is 0, and here u is 0 at {what}:"
                    " write np.maximum(u, 0)**p, whose switch is followed without a surface, such as"
                    " np.maximum(u, 0)**1.5 for Hertz's law of a sphere"
                )


def _name_records(load: Any) -> None:
    """Give every record and pulse of a symbolic load, and all that is given between corners, its
    path, by which its breakpoints are found when the numbers are known.
    """
    for name, signal in load.channels.items():
        terms = {f"load.{name}.{i}": term for i, term in enumerate(getattr(signal, "terms", ()))}
        for path, term in (terms or {f"load.{name}": signal}).items():
            if term.once or term.repeats:
                object.__setattr__(term, "path", path)


def _trace_contact(
    result: Trace, twin: Any, t: LoadTime, q: tuple[Expr, ...], v: tuple[Expr, ...], side: Expr
) -> None:
    model = twin.model
    load = twin.load
    if len(q) != 1:
        raise TraceError(
            "a model with sides must have one coordinate; give it `sides = ()` and stop at margins"
            " instead"
        )
    result.gap = combine("add", ask_user(model, "gap", q[0], side), 0.0)
    with comparing_symbols(refused=True):
        result.contact = combine("add", model.contact, 0.0)
    at_contact: dict[Expr, Any] = {q[0]: result.contact, v[0]: 0.0}
    _check_gap(result.gap, q[0], type(model).__name__)
    result.gap_rate = substitute(differentiate(result.gap, q[0]), at_contact)
    result.contact_acceleration = result.gap_rate * substitute(result.acceleration[0], at_contact)
    result.contact_damping = -substitute(differentiate(result.acceleration[0], v[0]), at_contact)
    next_side, after = ask_user(model, "reset", t, v[0], side, load, twin.impact)
    result.next_side = combine("add", next_side, 0.0)
    result.velocity_after = combine("add", after, 0.0)
    _check_next_side(result.next_side, twin.one_contact.sides, type(model).__name__)


def _check_gap(gap: Expr, coordinate: Expr, model: str) -> None:
    """Refuse a gap that is not provably a polynomial of degree 1 in the coordinate, as the flow
    assumes a single contact point."""
    slope = differentiate(gap, coordinate)
    if _known_number(differentiate(slope, coordinate)) != 0:
        raise TraceError(
            f"{model}.gap must be linear in the coordinate, such as side * (x - d): a model has one"
            " contact point, not two stops"
        )
    if _known_number(slope) == 0:
        raise TraceError(f"{model}.gap must depend on the coordinate, such as side * (x - d)")


def _check_next_side(next_side: Expr, sides: tuple[int, ...], model: str) -> None:
    """Refuse a reset that is known to lead to a side that the model does not have."""
    for side in sides:
        following = _known_number(substitute(next_side, {Expr("side"): side}))
        if following is not None and following not in sides:
            raise TraceError(
                f"{model}.reset leads from side {side} to side {float(following):g}, and the model"
                f" has the sides {sides}; a reset returns the next side and the velocity there"
            )


def _known_number(expression: Expr) -> float | Fraction | None:
    """The number to which an expression is provably equal, or None."""
    if not expression.args:
        value: float | None = expression.value if expression.op == "number" else None
        return value
    # seldom needed, and slow to import
    from saltus.taylor.exact_algebra import NoNormalForm, constant_value, normal_form

    try:
        return constant_value(normal_form(expression))
    except NoNormalForm:
        return None


@comparing_symbols(refused=True)
def ask_user(model: Any, method: str, *arguments: Any) -> Any:
    """Call a model's method with symbols, which it may not compare."""
    return ask(model, method, *arguments)


def _trace_smooth(model: Any, *arguments: Any) -> Any:
    """Trace the accelerations of a model that nothing holds."""
    with told_of_switches(isinstance(model, ContactModel)):
        return ask_user(model, "acceleration", *arguments)


@switching()
@comparing_symbols(refused=True)
def _trace_contacts(result: Trace, twin: Any, t: LoadTime, q: Any, v: Any) -> list[Any]:
    """Trace the accelerations of a model with several contacts, for any choice of closed ones."""
    model = twin.contact_model
    load = twin.load
    contacts = twin.contact_model.contacts
    frictions = twin.contact_model.frictions
    local = getattr(model, "local_count", result.dof)
    parts = (*frictions, *model.surfaces)
    names = model.coordinates
    # these may jump, and a motion may slide along them
    first_order = getattr(model, "own_class", model).first_order
    first = len(frictions)
    functions = [
        combine("add", part.guard(model, Expr("slide", (), first + number), t, q, v, load), 0.0)
        if part.function is not None
        else combine("sub", q[names.index(part.coordinate)] if len(names) > 1 else q, part.position)
        if part.coordinate in first_order
        else None
        for number, part in enumerate(model.surfaces)
    ]
    result.resets = [
        combine("add", x, 0.0)
        for part in model.surfaces
        if part.after_event is not None
        for x in _after_event(model, part.after_event, (t, q, v, load))
    ]
    beside = [
        x
        for function in functions
        for x in (number(1.0) if function is None else function, NO_SHARE)
    ]
    if local < result.dof:
        q, v = local_parts(q, v, local)
    a, slides = (
        [Expr(op, (), i) for i in range(n)]
        for op, n in (("acceleration", local), ("slide", len(parts)))
    )
    sums: dict[int, Any] = {}
    if model.has_multipliers:
        found, holding = _trace_multipliers(result, model, t, q, v, load, beside)
    else:
        found, along, sums = solved_motion(
            model, t, q, v, load, [Expr("free", (), i) for i in range(local)], slides
        )
        holding = [
            f
            for forces in (reactions, stick_margins)
            for f in forces(model, t, q, v, a, load, slides, along)
        ]
        holding += beside
    result.reactions = [combine("add", r, 0.0) for r in holding]
    if model.rubs_in_contacts:
        given = float(twin.impact.has_phases), *(getattr(part, "kinetic", 0.0) for part in parts)
        result.coefficients = [combine("add", mu, 0.0) for mu in given]
    speeds = (
        # in a row the speed of the ground is part of the drift
        *(0.0 if model.has_multipliers else friction.ground_speed for friction in frictions),
        *(
            part.position if function is None else 0.0  # which is part of the function
            for part, function in zip(model.surfaces, functions, strict=True)
        ),
    )
    result.levels = [combine("add", w, 0.0) for w in speeds]
    result.sided = _sided_parts(model, functions)
    result.mass = [
        combine("add", x, 0.0)
        for i, row in enumerate(mass_rows(model, q, t, load))
        for x in sums.get(i, row)
    ]
    result.restitution = [
        combine("add", entry, 0.0) for row in twin.impact.restitution_matrix(model) for entry in row
    ]
    result.positions = [combine("add", contact.position, 0.0) for contact in contacts]
    afters = [
        ask_user(model, "after_impact", contact.name, q, v)
        for contact in contacts
        if result.first_order
    ]
    result.jumps = [
        combine("add", x, 0.0)
        for after in afters
        for x in (after if isinstance(after, (tuple, list)) else (after,))
    ]
    result.signs = tuple(contact.sign for contact in contacts)
    result.contact_coordinates = tuple(
        0 if model.has_multipliers else model.coordinates.index(contact.coordinate)
        for contact in contacts
    )
    if local < result.dof:
        result.modes = mode_block(
            model.mode_equations(t, q, v, load), local, result.dof - local, q.sums
        )
        found += [Expr("mode", (), i) for i in range(local, result.dof)]
    return found


def _sided_parts(model: Any, functions: list[Any]) -> tuple[SidedPart, ...]:
    """The rows of a model's frictions and surfaces; with each surface the expression that it
    is, or None where it is a coordinate."""
    names = model.coordinates
    presses = {None: -1} | {contact.name: i for i, contact in enumerate(model.contacts)}
    rows = [
        SidedPart(
            "friction",
            0 if model.has_multipliers else names.index(part.coordinate),
            presses[part.contact] if model.rubs_in_contacts else -1,
        )
        for part in model.frictions
    ]
    for part, function in zip(model.surfaces, functions, strict=True):
        marks = tuple(part.marks(model).items())
        if function is None:
            rows.append(SidedPart("surface", names.index(part.coordinate), marks=marks))
        else:
            kind = part.kind
            rows.append(SidedPart(kind, len(names), marks=marks, remembered=part.remembered))
    return tuple(rows)


def _after_event(model: Any, name: str, at: tuple[Any, ...]) -> list[Any]:
    """All coordinates and all velocities after an event; 0 for those of coordinates of first order,
    which follow from the state."""
    size = len(model.coordinates)
    rows = (tuple, list, np.ndarray)
    found = ask_user(model, name, *at)
    halves = found if isinstance(found, rows) else ()
    both = [list(half) if isinstance(half, rows) else [half] for half in halves]
    if [len(row) for row in both] != [size, size]:
        kind = getattr(model, "own_class", type(model)).__name__
        raise ParameterError(
            f"{kind}.{name} must return the coordinates and the velocities after the event, each"
            f" {'a number' if size == 1 else f'{size} numbers'}, got"
            f" {'None' if found is None else 'something else'}",
            "model",
        )
    moving = size - len(getattr(model, "own_class", model).first_order)
    return [*both[0], *both[1][:moving], *[0.0] * (size - moving)]


def _trace_multipliers(
    result: Trace, model: Any, t: LoadTime, q: Any, v: Any, load: Any, beside: list[Expr]
) -> tuple[list[Any], list[Any]]:
    """Trace the accelerations of a model whose contacts and frictions are rows, and the series that
    events need: reactions, margins of frictions, gaps, sliding speeds."""
    surfaces = [number(0.0)] * len(model.surfaces)
    slides = [Expr("slide", (), k) for k in range(len(model.frictions) + len(surfaces))]
    held = held_motion(result, model, t, q, v, on_sides(model, load, slides))
    result.limits = held.limits
    rows = (*held.contacts, *held.frictions)
    empty = [number(0.0)] * (result.dof + 1)
    result.rows = [x for row in rows for x in (*row.entries, row.drift)]
    result.rows += [x for _ in surfaces for x in empty]
    result.rows += [row.value for row in held.contacts]
    gaps = [row.value for row in held.contacts]
    speeds = [row.value for row in held.frictions]
    series = [*held.reactions, *held.margins, *beside, *gaps, *speeds, *surfaces]
    if result.with_pulls:
        series += [_pull_of(row) for row in held.contacts]
    return held.accelerations, series


def _pull_of(row: Any) -> Expr:
    """The second derivative of a gap."""
    total: Expr = row.bend
    for i, entry in enumerate(row.entries):
        total = total + entry * Expr("acceleration", (), i)
    return total


@comparing_symbols(refused=True)
def _trace_margins(
    result: Trace, twin: Any, t: LoadTime, q: Any, v: Any, side: Expr, stop_at: tuple[str, ...]
) -> None:
    a = tuple(Expr("acceleration", (), i) for i in range(result.dof))
    margins = (
        dict(
            ask_user(
                twin.model, "margins", t, q, v, a[0] if result.dof == 1 else a, side, twin.load
            )
        )
        if stop_at
        else {}
    )
    if result.rows:
        margins |= result.limits
    elif result.several and stop_at:
        free: list[Any] = [Expr("free", (), i) for i in range(result.local)] + [1.0] * (
            result.dof - result.local
        )
        slides = [Expr("slide", (), i) for i in range(len(result.sided))]
        margins |= friction_margins(twin.model, t, q, v, twin.load, free, slides)
    for name in stop_at:
        if name not in margins:
            message = (
                f"{type(twin.model).__name__} has no margin {name!r} to stop at;"
                f" {near(name, margins)}"
            )
            raise ParameterError(message, "stop_at")
        result.margins[name] = combine("add", margins[name], 0.0)


def _check(result: Trace) -> None:
    """Refuse comparisons in expressions that are expanded in series, and a gap that depends on more
    than the coordinate.
    """
    gap = [] if result.gap is None else [result.gap]
    expanded = [*result.acceleration, *result.reactions, *result.margins.values(), *gap]
    check_size(result)
    for node in ordered(expanded):
        if node.op == "velocity" and node.value in result.first_order_rows:
            raise TraceError(
                f"{result.model} reads the velocity of coordinate {node.value + 1}, which is of"
                " first order"
            )
        if node.op in POINTWISE:
            where = f"{result.model} uses {node.op} in an acceleration, a gap or a margin"
            raise TraceError(f"{where}; {FRICTION if uses_velocity(*node.args) else BRANCH}")
    if result.gap is not None:
        for node in ordered([result.gap]):
            if node.op in ("time", "record", "velocity"):
                raise TraceError(
                    f"{result.model}.gap may depend on the coordinate, the side and the parameters"
                    " only"
                )
    for node in ordered([*result.mass, *result.rows, *result.coefficients]):
        if node.op in POINTWISE:
            raise TraceError(
                f"{result.model} uses {node.op} in its mass matrix, or in a distance or a rate; only"
                " its force may have switches: give these as smooth functions"
            )
    _check_abs(result, expanded)


def _check_abs(result: Trace, expanded: list[Expr]) -> None:
    """Refuse abs of a coordinate, which is traced as side * coordinate, in models in which the two
    differ.
    """
    side = Expr("side")
    coordinates = [Expr("coordinate", (), i) for i in range(len(result.acceleration))]
    sized = {side * q for q in coordinates}
    if result.gap not in sized | {q * side for q in coordinates} and any(
        node in sized for node in ordered(expanded)
    ):
        raise TraceError(
            "abs of the coordinate can be traced only where the gap is side * coordinate; write it"
            " with the gap"
        )


def check_paths(system: System, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Check that each of the dotted paths to differentiate to names a number that can vary.

    Raises
    ------
    ParameterError
        A path leads to no number of the system (the message has similar paths), or to an order, or
        is given twice.
    """
    known = [path for path, _ in numbers(system)]
    for path in paths:
        if path not in known:
            system.get(str(path))  # refuses a path to a part that does not exist
            below = [name for name in known if name.startswith(f"{path}.")]
            raise ParameterError(
                f"{path} is not a number, so there is no derivative to it;"
                f" {near(str(path), below or known)}"
            )
        owner = system.get(path.rpartition(".")[0])
        if isinstance(owner, Transient) and path.rpartition(".")[2] in owner.moving:
            raise ParameterError(
                f"{path} moves the instants at which the load is not smooth, so there are no"
                " derivatives to it; take another"
            )
        if path.endswith(".order") and isinstance(owner, Harmonic):
            raise ParameterError(
                f"{path} is a whole number, so there is no derivative to it; choose another"
                " parameter"
            )
    if len(set(paths)) < len(paths):
        raise ParameterError(f"each parameter may be named once, got {paths!r}")
    return tuple(paths)
