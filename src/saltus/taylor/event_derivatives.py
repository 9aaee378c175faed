"""From a trace to the source of `tangent`: what each event makes of the tangent's columns, and how the event moves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from saltus.taylor import derivatives as tangent
from saltus.taylor.graph import Expr, differentiate, number
from saltus.taylor.memory_layout import EventCode, ReleaseDetail, RestDetail, StatePlace

if TYPE_CHECKING:
    from saltus.taylor.scalar_source import Emitter
    from saltus.taylor.tracing import Trace

NONE = number(math.nan)


def tangent_source(emitter: Emitter) -> str:
    """The function `tangent(kind, detail, t, origin, side, env, piece, state)`, which changes the kernel's state in place.

    After the coordinates and the velocities, those of the columns among them, the state holds the shifts: for each column by
    how much the event moves.
    """
    trace = emitter.trace
    lines = ["@lowered_jit(TANGENT, fused=False)", "def tangent(kind, detail, t, origin, side, env, piece, state):"]
    lines.append("    p, c, breaks, table = env")
    for kind, detail, changes in _events(trace) if trace.columns else []:
        statements, values = emitter.statements(list(changes.values()), lambda node: _place(trace, node), first=len(lines))
        targets = ", ".join(_place(trace, target) for target in changes)
        lines.append(f"    if kind == {kind} and detail == {detail}:")
        lines += [f"        {line}" for line in [*statements, f"{targets} = {', '.join(values)}"]]
    return "\n".join([*lines, "    return", "", ""])


def _events(trace: Trace) -> list[tuple[EventCode, int, dict[Expr, Expr]]]:
    """(kind, detail, what becomes of the places in the state) of every event that the structure can have."""
    events = [(EventCode.LIMIT, i, _shifts(tangent.margin_shift(trace, name))) for i, name in enumerate(trace.margins)]
    if trace.gap is None:
        return events
    jump = tangent.saltation(trace)
    after, at_rest, none = _shifts(jump.shift), dict[Expr, Expr](), dict[Expr, Expr]()
    for j in range(trace.columns):
        (u,), (z,) = tangent.leaves(trace, j)
        held = tangent.contact_shift(trace, j)
        after |= {u: jump.coordinate[j], z: jump.velocity[j]}
        at_rest |= {u: held, z: number(0.0)}
        known = j >= 2 * trace.dof and held is number(0.0)
        none |= {u: held if known else NONE, z: number(0.0) if known else NONE}
    still, unknown = [number(0.0)] * trace.columns, [NONE] * trace.columns
    return [
        *events,
        (EventCode.IMPACT, 0, after),
        (EventCode.RESET_SLOPES, 0, _reset_slopes(trace)),
        (EventCode.RESTING, RestDetail.AFTER_IMPACTS, at_rest | _shifts(tangent.rest_shift(trace))),
        (EventCode.RESTING, RestDetail.AT_ONCE, at_rest),
        (EventCode.RESTING, RestDetail.NEVER_AGAIN, none),
        (EventCode.RELEASE, ReleaseDetail.AT_A_ROOT, _shifts(tangent.release_shift(trace))),
        (EventCode.RELEASE, ReleaseDetail.AT_A_JUMP, _shifts(still)),
        (EventCode.RELEASE, ReleaseDetail.AT_NONE, _shifts(unknown)),
    ]


def _reset_slopes(trace: Trace) -> dict[Expr, Expr]:
    """u = x_c, z = R_v z + R_c, and R_t as the shift: v+ = R(v-, t, c) at x(c) as its arguments change, whenever that may be."""
    assert trace.velocity_after is not None
    reset, places = trace.velocity_after, dict[Expr, Expr]()
    slope, drift = differentiate(reset, Expr("velocity", (), 0)), tangent.rate(trace, reset)
    for j in range(trace.columns):
        (u,), (z,) = tangent.leaves(trace, j)
        places |= {u: tangent.contact_shift(trace, j), z: slope * z + tangent.partial(trace, reset, j)}
    return places | _shifts([drift] * trace.columns)


def _shifts(values: list[Expr]) -> dict[Expr, Expr]:
    """The shift of each column, as a change of the state."""
    return {Expr("shift", (), j): value for j, value in enumerate(values)}


def _place(trace: Trace, node: Expr) -> str:
    """Where the kernel's state keeps a coordinate, a velocity or a shift."""
    count = len(trace.acceleration)
    starts = {
        "coordinate": StatePlace.COORDINATES,
        "velocity": StatePlace.COORDINATES + count,
        "shift": StatePlace.COORDINATES + 2 * count,
    }
    return f"state[{starts[node.op] + node.value}]"
