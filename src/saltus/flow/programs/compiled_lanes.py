"""The compiled code of the lanes: one driver for all models, and three functions of each
structure.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

from saltus.flow.contacts import complementarity, held_rows, lane_handoff, lane_impacts, rows
from saltus.flow.contacts import impacts as contact_impacts
from saltus.flow.contacts import lane_step as contacts_step
from saltus.flow.kernel import contact_layout, roots, steps
from saltus.flow.kernel import layout as kernel_layout
from saltus.flow.kernel import memory as kernel_memory
from saltus.flow.kernel.event_derivatives import saltation
from saltus.flow.kernel.layout import SERIES_LENGTH
from saltus.flow.lane_steps import function_types, memory, sampling
from saltus.flow.lane_steps import steps as lane_steps
from saltus.flow.lane_steps.memory import SLOTS, MemoryPlan, Slot
from saltus.flow.one_contact import lane_handoff as one_contact_handoff
from saltus.flow.one_contact import lane_step
from saltus.flow.programs import forcing_periods, scalar_impact
from saltus.flow.programs import lane_driver as driver
from saltus.flow.programs import lane_handoff as handoff
from saltus.flow.programs.compiled import (
    constants,
    contacts_module,
    kernel_module,
    motion_roots,
    one_free,
)
from saltus.taylor import (
    Case,
    Expr,
    Places,
    Rows,
    SeriesOf,
    Trace,
    WrittenFunction,
    check_size,
    compiled_part,
    digest,
    entry_point,
    is_compiled,
    is_steep,
    lane_memory,
    lane_vectors,
    load_functions,
    load_module,
    load_tables,
    module_name,
    number,
    pointer,
    source_of,
    tape,
    vectors,
)
from saltus.taylor.vectors import LANES, WIDTH

_TYPES = (kernel_memory, function_types, memory, vectors, lane_memory, lane_vectors)
_WRITTEN_BY = digest(*(source_of(module) for module in _TYPES))
_SIGNATURES = f"""import math

import numpy as np

from saltus.flow.kernel.memory import *
from saltus.flow.lane_steps import function_types
from saltus.flow.lane_steps.function_types import *
from saltus.flow.lane_steps.memory import Closing, Stretch, Gap, Step
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import *
from saltus.taylor.numba_types import by_reference
from saltus.taylor.private_numba import cached_jit, inline_jit, jit, lean_jit, pointed_jit
# types and vectors of {_WRITTEN_BY}, for {WIDTH} lanes
"""
_OF_CONTACTS = (
    "shared, RUN_LANES, LANE_ROOT, SCALAR_MOTION, CONTACTS_IMPACT = function_types.CONTACTS\n"
)


@cache
def load_driver(several: bool = False) -> Callable[..., None]:
    """The driver of all lanes, `run_lanes` of `driver.py`, for models with one or several contacts;
    it releases Python's lock.
    """
    return entry_point(load_module("lanes", driver_text(several)).run_lanes)


def driver_text(several: bool) -> str:
    """The source of the driver."""
    step = (contact_layout, lane_impacts, contacts_step) if several else (lane_step,)
    common = (kernel_layout, memory, load_tables, lane_steps, sampling)
    return _text(several, *common, *step, forcing_periods, driver)


def _text(several: bool, *modules: ModuleType) -> str:
    """One source of the compiled parts of several files, for vectors of this machine's width."""
    header = _SIGNATURES + (_OF_CONTACTS if several else "")
    return header + "".join(compiled_part(module) for module in modules)


@cache
def compile_driver_aside(several: bool) -> subprocess.Popen[bytes] | None:
    """A process that compiles the driver while this one compiles the rest; None if the driver is
    already on disk.

    Further calls return the same process, which may have ended since.
    """
    if is_compiled(module_name("lanes", driver_text(several))):
        return None
    try:
        # the other process finds packages where this one does
        found = f"import sys; sys.path[:] = {sys.path!r}; "
        call = f"{found}from {__name__} import load_driver; load_driver({several})"
        return subprocess.Popen([sys.executable, "-c", call])
    except OSError:
        return None


@cache
def load_helpers(several: bool = False) -> tuple[Any, ...]:
    """The functions that the driver calls for one lane, in the order of `Helpers`."""
    names = ["first_root_of", "turning_range", "scalar_motion"]
    names += ["contacts_impact"] if several else []
    module = load_module("lane_helpers", helpers_text(several))
    return tuple(pointer(getattr(module, name)) for name in names)


def helpers_text(several: bool) -> str:
    """The source of these functions."""
    parts = [kernel_layout, memory, load_tables, roots]
    if several:
        parts += [
            steps,
            contact_layout,
            rows,
            complementarity,
            held_rows,
            contact_impacts,
            lane_impacts,
            lane_handoff,
        ]
        parts += [handoff, scalar_impact]
    else:
        parts += [one_contact_handoff, handoff]
    return _text(several, *parts)


def load_lane_functions(trace: Trace) -> tuple[MemoryPlan, tuple[Any, ...]]:
    """The memory that a structure needs, and its functions for lanes.

    Raises
    ------
    TraceError
        Compiling them would take minutes.
    """
    check_size(trace, lanes=True)
    return memory_plan(trace), tuple(load_functions("lane", lane_functions(trace), trace).values())


@cache
def load_advance(several: bool = False) -> Any:
    """The scalar kernel, which the driver calls for one lane."""
    return pointer(contacts_module().advance if several else kernel_module().advance)


def compile_everything(several: bool = False) -> None:
    """Compile the driver, its helpers and the scalar kernel, or load them from disk if they are
    there.
    """
    load_driver(several)
    load_helpers(several)
    load_advance(several)


def compile_beside(driver: subprocess.Popen[bytes], several: bool) -> None:
    """Compile the helpers and the scalar kernel while another process compiles the driver, and wait
    for that process.
    """
    load_helpers(several)
    load_advance(several)
    driver.wait()


def memory_plan(trace: Trace) -> MemoryPlan:
    """The memory that a structure needs."""
    equations = one_free(trace)
    return MemoryPlan(
        rows=len(trace.acceleration),
        own=trace.dof,
        local=trace.local,
        parameters=max(0 if trace.several else 1, len(trace.parameters)),
        contacts=len(trace.signs),
        frictions=len(trace.sided),
        constants=max(1, len(constants(trace))),
        data=0 if trace.modes is None else trace.modes.data,
        records=len(trace.records),
        stops=len(trace.reactions) + len(trace.margins),
        guards=len(equations.guards) if equations else None,
        constant_guards=len(equations.constant_guards) if equations else 0,
    )


def lane_functions(trace: Trace) -> list[WrittenFunction]:
    """`lane_series`, `lane_impact` and `lane_field`; for a model with several contacts also of
    `lane_one_free`.
    """
    plan = memory_plan(trace)
    known = constants(trace)
    functions = [
        _series(trace, plan, known),
        _impact(trace, plan, known),
        _field(trace, plan, known),
    ]
    return [*functions, _one_free(trace, plan, known)] if trace.several else functions


def _function(
    name: str, plan: MemoryPlan, leaves: dict[str, Slot], content: Any, *more: str
) -> WrittenFunction:
    """A function of the lanes; its signature has its name in `function_types.py`."""
    parts = plan.places._fields if plan.data else ()
    places = Places(("m", "places", *more), leaves, parts)
    return WrittenFunction(name, getattr(function_types, name.upper()), places, LANES, content)


def _leaves(plan: MemoryPlan, time: int, position: str, velocity: str) -> dict[str, Slot]:
    """The places of a trace's leaves in the lanes' memory, for one of the times and one of the
    states that it holds.
    """
    parts = {
        "coordinate": position,
        "velocity": velocity,
        "parameter": "parameters",
        "free": "free",
    }
    parts |= {"constant": "constants", "record": "records"}
    numbers = {"time": time, "record_time": SLOTS.now, "origin": SLOTS.origin, "side": SLOTS.side}
    behind = {
        "slide": plan.slot("parameters", plan.parameters),
        "datum": plan.slot("constants", plan.constants),
    }
    return (
        {op: plan.slot(part) for op, part in parts.items()}
        | {op: ("m", slot) for op, slot in numbers.items()}
        | behind
    )


def _series(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_series(m, places, order)`: the series of positions and velocities from the state, of
    the accelerations and of the margins.

    Positions and velocities have coefficients 0..order, the others 0..order - 1; the order is even,
    and at least LOWEST_ORDER.
    """

    def row(part: str, number: int) -> Slot:
        return plan.slot(part, number * SERIES_LENGTH)

    own = trace.local_rows
    inputs = trace.inputs_of_loops
    stops = [row("margins", i) for i in range(plan.stops)]
    targets = [
        *(row("accelerations", i) if i < plan.own else None for i in own),
        *stops,
        *[None] * len(inputs),
    ]
    loops = trace.loop_rows(
        [plan.slot(part) for part in ("positions", "velocities", "accelerations")], False
    )
    margins = motion_roots(trace)[trace.gap is not None :]
    moving, rates = ([row(part, i) for i in own] for part in ("positions", "velocities"))
    first_order = [i for i in trace.first_order_rows if i in own]
    length = SERIES_LENGTH
    layout = Rows(
        moving,
        rates,
        targets,
        length,
        any_order=False,
        first_order=first_order,
        coordinates=own,
        loops=loops,
    )
    leaves = _leaves(plan, SLOTS.now, "position", "velocity")
    expanded = [*(trace.acceleration[i] for i in own), *margins, *inputs]
    return _function(
        "lane_series", plan, leaves, SeriesOf(layout, tape(expanded, known, series=True)), "order"
    )


def _one_free(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_one_free(m, places, order)`: the same series if one coordinate is free, which is in row
    0.

    The series of `OneFree.curved` are in the rows of the other coordinates, and the guards in the
    rows of margins.
    """
    leaves = _leaves(plan, SLOTS.now, "position", "velocity")
    leaves |= {"coordinate": ("m", SLOTS.free_position), "velocity": ("m", SLOTS.free_velocity)}
    equations = one_free(trace)
    if equations is None:
        return _function("lane_one_free", plan, leaves, [], "order")
    guards = [plan.slot("margins", i * SERIES_LENGTH) for i in range(len(equations.guards))]
    numbers = [plan.slot("constant_guards", i) for i in range(len(equations.constant_guards))]
    curved = [plan.slot("positions", i * SERIES_LENGTH) for i in range(1, plan.own)]
    targets = [plan.slot("accelerations"), *curved, *guards]
    state = [plan.slot("positions")], [plan.slot("velocities")]
    rows = Rows(*state, targets, SERIES_LENGTH, any_order=False, numbers=numbers)
    return _function(
        "lane_one_free",
        plan,
        leaves,
        SeriesOf(rows, tape(equations.roots, known, series=True)),
        "order",
    )


def _impact(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_impact(m, places)`: the side, positions and velocities after an impact at the new
    state, the tangent's columns included.

    For a model with several contacts it fills only the mass matrix and E at the new state.
    """
    if trace.several:
        entries = {"mass": trace.mass, "restitution": trace.restitution}
        filled = {
            plan.slot(part, i): root
            for part, roots in entries.items()
            for i, root in enumerate(roots)
        }
        if trace.modes is not None:  # the lanes' memory is made of zeros
            filled = {place: root for place, root in filled.items() if root is not number(0.0)}
        return _at_new_state("lane_impact", plan, filled, known)
    if trace.contact is None or trace.next_side is None or trace.velocity_after is None:
        return _at_new_state("lane_impact", plan, {}, known)
    positions = [trace.contact]
    velocities = [trace.velocity_after]
    if trace.columns:
        jump = saltation(trace)
        positions, velocities = positions + jump.coordinate, velocities + jump.velocity
    results: dict[Slot, Expr] = {("m", SLOTS.new_side): trace.next_side}
    for part, roots_of_part in (("after_position", positions), ("after_velocity", velocities)):
        results |= {plan.slot(part, row): root for row, root in enumerate(roots_of_part)}
    return _at_new_state("lane_impact", plan, results, known)


def _field(trace: Trace, plan: MemoryPlan, known: dict[Expr, int]) -> WrittenFunction:
    """`lane_field(m, places)`: the model's own accelerations at the new state, in the place of the
    velocities after an impact.

    They are needed for derivatives and where steps are checked; otherwise nothing is written.
    """
    own = trace.acceleration[: trace.dof] if trace.columns or is_steep(trace.acceleration) else []
    fields = {plan.slot("after_velocity", row): trace.written_out(a) for row, a in enumerate(own)}
    return _at_new_state("lane_field", plan, fields, known)


def _at_new_state(
    name: str, plan: MemoryPlan, results: dict[Slot, Expr], known: dict[Expr, int]
) -> WrittenFunction:
    leaves = _leaves(plan, SLOTS.new_time, "new_position", "new_velocity")
    return _function(name, plan, leaves, [Case(tape(list(results.values()), known), list(results))])
