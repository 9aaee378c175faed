"""A structure's functions for lanes, and the layout of the memory of a group of lanes that they read and write."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from saltus.flow.kernel.compiled import constants, motion_roots, one_free
from saltus.flow.kernel.event_derivatives import saltation
from saltus.flow.kernel.memory_layout import SERIES_LENGTH
from saltus.flow.lanes import function_types
from saltus.flow.lanes.memory import SLOTS, MemoryPlan
from saltus.taylor import LANES, Case, Expr, Places, Rows, SeriesOf, Trace, WrittenFunction, tape


def memory_plan(trace: Trace) -> MemoryPlan:
    """The memory that a structure needs."""
    equations = one_free(trace)
    return MemoryPlan(
        rows=len(trace.acceleration),
        own=trace.dof,
        parameters=max(0 if trace.several else 1, len(trace.parameters)),
        contacts=len(trace.signs),
        frictions=len(trace.friction_coordinates),
        constants=max(1, len(constants(trace))),
        records=len(trace.records),
        stops=len(trace.reactions) + len(trace.margins),
        guards=len(equations.guards) if equations else None,
        constant_guards=len(equations.constant_guards) if equations else 0,
    )


def lane_functions(trace: Trace) -> list[WrittenFunction]:
    """`lane_series`, `lane_impact` and `lane_field`; for a model with several contacts also of `lane_one_free`."""
    plan, known = memory_plan(trace), constants(trace)
    functions = [_series(trace, plan, known), _impact(trace, plan, known), _field(trace, plan, known)]
    return [*functions, _one_free(trace, plan, known)] if trace.several else functions


def _function(name: str, places: Places, content: Sequence[Any]) -> WrittenFunction:
    """A function of the lanes; its signature has its name in `function_types.py`."""
    return WrittenFunction(name, getattr(function_types, name.upper()), places, LANES, content)


def _leaves(plan: MemoryPlan, time: int, position: int, velocity: int) -> dict[str, tuple[str, int]]:
    """The places of a trace's leaves in the lanes' memory, for one of the times and one of the states that it holds."""
    parts = {"coordinate": position, "velocity": velocity, "parameter": plan.places.parameters, "free": plan.places.free}
    parts |= {"constant": plan.places.constants, "record": plan.places.records}
    numbers = {"time": time, "record_time": SLOTS.now, "origin": SLOTS.origin, "side": SLOTS.side}
    parts["slide"] = parts["parameter"] + plan.parameters
    return {op: ("m", slot) for op, slot in (parts | numbers).items()}


def _series(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_series(m, order)`: the series of positions and velocities from the state, of the accelerations and of the margins.

    Positions and velocities have coefficients 0..order, the others 0..order - 1; the order is even, and at least LOWEST_ORDER.
    """

    def rows(part: int, count: int) -> list[tuple[str, int]]:
        return [("m", part + row * SERIES_LENGTH) for row in range(count)]

    columns, parts = [None] * (plan.rows - plan.own), plan.places
    targets = [*rows(parts.accelerations, plan.own), *columns, *rows(parts.margins, plan.stops)]
    positions, velocities = rows(parts.positions, plan.rows), rows(parts.velocities, plan.rows)
    margins = motion_roots(trace)[trace.gap is not None :]
    layout = Rows(positions, velocities, targets, SERIES_LENGTH, any_order=False)
    places = Places(("m", "order"), _leaves(plan, SLOTS.now, parts.position, parts.velocity))
    return _function("lane_series", places, SeriesOf(layout, tape([*trace.acceleration, *margins], known, series=True)))


def _one_free(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_one_free(m, order)`: the same series if one coordinate is free, which is in row 0.

    The series of `OneFree.curved` are in the rows of the other coordinates, and the guards in the rows of margins.
    """
    parts = plan.places
    leaves = _leaves(plan, SLOTS.now, parts.position, parts.velocity)
    leaves |= {"coordinate": ("m", SLOTS.free_position), "velocity": ("m", SLOTS.free_velocity)}
    places, equations = Places(("m", "order"), leaves), one_free(trace)
    if equations is None:
        return _function("lane_one_free", places, [])
    guards = [("m", parts.margins + i * SERIES_LENGTH) for i in range(len(equations.guards))]
    numbers = [("m", parts.constant_guards + i) for i in range(len(equations.constant_guards))]
    curved = [("m", parts.positions + i * SERIES_LENGTH) for i in range(1, plan.own)]
    targets = [("m", parts.accelerations), *curved, *guards]
    state = [("m", parts.positions)], [("m", parts.velocities)]
    rows = Rows(*state, targets, SERIES_LENGTH, any_order=False, numbers=numbers)
    return _function("lane_one_free", places, SeriesOf(rows, tape(equations.roots, known, series=True)))


def _impact(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_impact(m)`: the side, positions and velocities after an impact at the new state, the tangent's columns included.

    For a model with several contacts it fills only the mass matrix and E at the new state.
    """
    parts = plan.places
    if trace.several:
        entries = {parts.mass: trace.mass, parts.restitution: trace.restitution}
        filled = {("m", part + i): root for part, roots in entries.items() for i, root in enumerate(roots)}
        return _at_new_state("lane_impact", plan, filled, known)
    if trace.contact is None or trace.next_side is None or trace.velocity_after is None:
        return _at_new_state("lane_impact", plan, {}, known)
    positions, velocities = [trace.contact], [trace.velocity_after]
    if trace.columns:
        jump = saltation(trace)
        positions, velocities = positions + jump.coordinate, velocities + jump.velocity
    results = {("m", SLOTS.new_side): trace.next_side}
    for part, roots in ((parts.after_position, positions), (parts.after_velocity, velocities)):
        results |= {("m", part + row): root for row, root in enumerate(roots)}
    return _at_new_state("lane_impact", plan, results, known)


def _field(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_field(m)`: the accelerations at the new state, in the place of the velocities after an impact."""
    first = plan.places.after_velocity
    return _at_new_state("lane_field", plan, {("m", first + row): a for row, a in enumerate(trace.acceleration)}, known)


def _at_new_state(name: str, plan: MemoryPlan, results: dict[tuple[str, int], Expr], known: dict[Expr, int]) -> WrittenFunction:
    places = Places(("m",), _leaves(plan, SLOTS.new_time, plan.places.new_position, plan.places.new_velocity))
    return _function(name, places, [Case(tape(list(results.values()), known), list(results))])
