"""A structure's functions for lanes, and the layout of the memory of a group of lanes that they read and write."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from saltus.flow.kernel.compiled import constants, motion_roots, one_free
from saltus.flow.kernel.event_derivatives import saltation
from saltus.flow.kernel.memory_layout import FIRST_PART, SERIES_LENGTH, LanePart, LaneSlot
from saltus.flow.lanes import function_types
from saltus.taylor import LANES, RECORD_WIDTH, Case, Expr, Places, Rows, SeriesOf, Trace, WrittenFunction, tape


@dataclass(frozen=True)
class Slots:
    """The sizes of the parts of the memory of a group of lanes, in slots of one vector (see `kernel/memory_layout.py`)."""

    rows: int  # coordinates, those of the sensitivities included
    own: int  # the model's own coordinates
    parameters: int
    contacts: int  # of a model with several
    frictions: int
    constants: int
    records: int
    stops: int
    guards: int | None = None  # where one coordinate is free; None without such equations
    constant_guards: int = 0

    @cached_property
    def places(self) -> dict[LanePart, int]:
        """The first slot of each part."""
        several, contacts = self.own if self.contacts or self.frictions else 0, self.contacts
        sizes = [self.rows] * 8 + [self.parameters + self.frictions, several, contacts, several**2, contacts**2]
        sizes += [several * (several + 2) + contacts, self.constant_guards, self.constants, self.records * RECORD_WIDTH]
        sizes += [rows * SERIES_LENGTH for rows in (self.rows, self.rows, self.own, self.stops)]
        return {part: FIRST_PART + sum(sizes[:part]) for part in LanePart}

    @property
    def end(self) -> int:
        """How many slots there are."""
        return self.places[LanePart.MARGINS] + self.stops * SERIES_LENGTH


def slots_of(trace: Trace) -> Slots:
    """The memory that a structure needs."""
    equations = one_free(trace)
    return Slots(
        rows=len(trace.acceleration),
        own=trace.dof,
        parameters=max(0 if trace.several else 1, len(trace.parameters)),
        contacts=len(trace.signs),
        frictions=len(trace.rubbed),
        constants=max(1, len(constants(trace))),
        records=len(trace.records),
        stops=len(trace.reactions) + len(trace.margins),
        guards=len(equations.guards) if equations else None,
        constant_guards=len(equations.constant_guards) if equations else 0,
    )


def lane_functions(trace: Trace) -> list[WrittenFunction]:
    """`lane_series`, `lane_impact` and `lane_field`; for a model with several contacts also `lane_one_free`."""
    slots, known = slots_of(trace), constants(trace)
    functions = [_series(trace, slots, known), _impact(trace, slots, known), _field(trace, slots, known)]
    return [*functions, _one_free(trace, slots, known)] if trace.several else functions


def _function(name: str, places: Places, content: Sequence[Any]) -> WrittenFunction:
    """A function of the lanes; its signature has its name in `function_types.py`."""
    return WrittenFunction(name, getattr(function_types, name.upper()), places, LANES, content)


def _leaves(slots: Slots, time: LaneSlot, position: LanePart, velocity: LanePart) -> dict[str, tuple[str, int]]:
    """The places of a trace's leaves in the lanes' memory, for one of the times and one of the states that it holds."""
    parts = {"coordinate": position, "velocity": velocity, "parameter": LanePart.PARAMETERS, "free": LanePart.FREE}
    parts |= {"constant": LanePart.CONSTANTS, "record": LanePart.RECORDS}
    numbers = {"time": time, "record_time": LaneSlot.NOW, "origin": LaneSlot.ORIGIN, "side": LaneSlot.SIDE}
    first = {op: slots.places[part] for op, part in parts.items()}
    first["slide"] = first["parameter"] + slots.parameters
    return {op: ("m", int(slot)) for op, slot in (first | numbers).items()}


def _series(trace: Trace, slots: Slots, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_series(m, order)`: the series of positions and velocities from the state, of the accelerations and of the margins.

    Positions and velocities have coefficients 0..order, the others 0..order - 1; the order is even, and at least LOWEST_ORDER.
    """

    def rows(part: LanePart, count: int) -> list[tuple[str, int]]:
        return [("m", slots.places[part] + row * SERIES_LENGTH) for row in range(count)]

    columns = [None] * (slots.rows - slots.own)
    targets = [*rows(LanePart.ACCELERATIONS, slots.own), *columns, *rows(LanePart.MARGINS, slots.stops)]
    positions, velocities = rows(LanePart.POSITIONS, slots.rows), rows(LanePart.VELOCITIES, slots.rows)
    margins = motion_roots(trace)[trace.gap is not None :]
    layout = Rows(positions, velocities, targets, SERIES_LENGTH, any_order=False)
    places = Places(("m", "order"), _leaves(slots, LaneSlot.NOW, LanePart.POSITION, LanePart.VELOCITY))
    return _function("lane_series", places, SeriesOf(layout, tape([*trace.acceleration, *margins], known, series=True)))


def _one_free(trace: Trace, slots: Slots, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_one_free(m, order)`: the same series if one coordinate is free, which is in row 0.

    The series of `OneFree.curved` are in the rows of the other coordinates, and the guards in the rows of margins.
    """
    leaves = _leaves(slots, LaneSlot.NOW, LanePart.POSITION, LanePart.VELOCITY)
    leaves |= {"coordinate": ("m", int(LaneSlot.FREE_POSITION)), "velocity": ("m", int(LaneSlot.FREE_VELOCITY))}
    places, equations = Places(("m", "order"), leaves), one_free(trace)
    if equations is None:
        return _function("lane_one_free", places, [])
    first = {part: ("m", slots.places[part]) for part in LanePart}
    guards = [("m", slots.places[LanePart.MARGINS] + i * SERIES_LENGTH) for i in range(len(equations.guards))]
    numbers = [("m", slots.places[LanePart.CONSTANT_GUARDS] + i) for i in range(len(equations.constant_guards))]
    curved = [("m", slots.places[LanePart.POSITIONS] + i * SERIES_LENGTH) for i in range(1, slots.own)]
    targets = [first[LanePart.ACCELERATIONS], *curved, *guards]
    state = [first[LanePart.POSITIONS]], [first[LanePart.VELOCITIES]]
    rows = Rows(*state, targets, SERIES_LENGTH, any_order=False, numbers=numbers)
    return _function("lane_one_free", places, SeriesOf(rows, tape(equations.roots, known, series=True)))


def _impact(trace: Trace, slots: Slots, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_impact(m)`: the side, positions and velocities after an impact at the new state, the tangent's columns included.

    For a model with several contacts it fills only the mass matrix and E at the new state.
    """
    if trace.several:
        entries = {LanePart.MASS: trace.mass, LanePart.RESTITUTION: trace.restitution}
        filled = {("m", slots.places[part] + i): root for part, roots in entries.items() for i, root in enumerate(roots)}
        return _at_new_state("lane_impact", slots, filled, known)
    if trace.contact is None or trace.next_side is None or trace.velocity_after is None:
        return _at_new_state("lane_impact", slots, {}, known)
    positions, velocities = [trace.contact], [trace.velocity_after]
    if trace.columns:
        jump = saltation(trace)
        positions, velocities = positions + jump.coordinate, velocities + jump.velocity
    results = {("m", int(LaneSlot.NEW_SIDE)): trace.next_side}
    for part, roots in ((LanePart.AFTER_POSITION, positions), (LanePart.AFTER_VELOCITY, velocities)):
        results |= {("m", slots.places[part] + row): root for row, root in enumerate(roots)}
    return _at_new_state("lane_impact", slots, results, known)


def _field(trace: Trace, slots: Slots, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_field(m)`: the accelerations at the new state, in the place of the velocities after an impact."""
    first = slots.places[LanePart.AFTER_VELOCITY]
    return _at_new_state("lane_field", slots, {("m", first + row): a for row, a in enumerate(trace.acceleration)}, known)


def _at_new_state(name: str, slots: Slots, results: dict[tuple[str, int], Expr], known: dict[Expr, int]) -> WrittenFunction:
    places = Places(("m",), _leaves(slots, LaneSlot.NEW_TIME, LanePart.NEW_POSITION, LanePart.NEW_VELOCITY))
    return _function(name, places, [Case(tape(list(results.values()), known), list(results))])
