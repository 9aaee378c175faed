"""The saltation of the tangent's columns at the events of a motion, and the shift of each event, as
expressions of a trace.

A column holds the derivatives to a number c, an initial value or a parameter. The shift dt is the
derivative of an event's time to c; at the event the column jumps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

from saltus.flow.kernel.layout import EventCode, ReleaseDetail, RestDetail
from saltus.flow.kernel.memory import INSTANT
from saltus.taylor import (
    Expr,
    Trace,
    differentiate,
    number,
    substitute,
)

NONE = number(math.nan)


@dataclass(frozen=True)
class Saltation:
    """The tangent after an impact, one expression for each column.

    The leaves of these expressions are the tangent's coordinates and velocities before the impact,
    and the model's own velocity v- before it (as velocity 0). The others are the time, the origin,
    the side before the impact and the parameters.
    """

    coordinate: list[Expr]  # u+
    velocity: list[Expr]  # z+
    shift: list[Expr]  # dt, of the impact's time


def changes(trace: Trace) -> list[tuple[EventCode, int, dict[Expr, Expr]]]:
    """For every event at the contact of a model with one: its kind, its detail, and the new
    expressions of the tangent's leaves.

    The leaf "shift" of a column is the shift of the event.
    """
    if trace not in _changes:
        _changes[trace] = _derive_changes(trace)
    return _changes[trace]


_changes: WeakKeyDictionary[Trace, list[tuple[EventCode, int, dict[Expr, Expr]]]] = (
    WeakKeyDictionary()
)


def _derive_changes(trace: Trace) -> list[tuple[EventCode, int, dict[Expr, Expr]]]:
    """`changes`, derived once: several functions of a structure are written from them."""
    if trace.gap is None or trace.columns == 0:
        return []
    jump = saltation(trace)
    after = _shifts(jump.shift)
    at_rest = dict[Expr, Expr]()
    none = dict[Expr, Expr]()
    for j in range(trace.columns):
        (u,), (z,) = trace.tangent_leaves(j)
        held = contact_shift(trace, j)
        after |= {u: jump.coordinate[j], z: jump.velocity[j]}
        at_rest |= {u: held, z: number(0.0)}
        known = j >= 2 * trace.dof and held is number(0.0)
        none |= {u: held if known else NONE, z: number(0.0) if known else NONE}
    still = [number(0.0)] * trace.columns
    unknown = [NONE] * trace.columns
    return [
        (EventCode.IMPACT, 0, after),
        (EventCode.RESET_SLOPES, 0, _reset_slopes(trace)),
        (EventCode.REST, RestDetail.AFTER_IMPACTS, at_rest | _shifts(rest_shift(trace))),
        (EventCode.REST, RestDetail.AT_ONCE, at_rest),
        (EventCode.REST, RestDetail.NEVER_AGAIN, none),
        (EventCode.RELEASE, ReleaseDetail.AT_A_ROOT, _shifts(release_shift(trace))),
        (EventCode.RELEASE, ReleaseDetail.AT_A_JUMP, _shifts(still)),
        (EventCode.RELEASE, ReleaseDetail.AT_NONE, _shifts(unknown)),
    ]


def _reset_slopes(trace: Trace) -> dict[Expr, Expr]:
    """The derivatives of the reset v+ = R(v-, t, c) at x(c) alone, at a fixed instant: u = x_c, z =
    R_v z + R_c, and R_t as the shift."""
    assert trace.velocity_after is not None
    reset = trace.velocity_after
    places = dict[Expr, Expr]()
    slope = differentiate(reset, Expr("velocity", (), 0))
    drift = trace.time_derivative(reset)
    for j in range(trace.columns):
        (u,), (z,) = trace.tangent_leaves(j)
        places |= {u: contact_shift(trace, j), z: slope * z + trace.partial_derivative(reset, j)}
    return places | _shifts([drift] * trace.columns)


def _shifts(values: list[Expr]) -> dict[Expr, Expr]:
    """The shift of each column, as a change of the state."""
    return {Expr("shift", (), j): value for j, value in enumerate(values)}


def saltation(trace: Trace) -> Saltation:
    """The saltation of an impact, for a model with contact and a trace with columns.

    With the gap g(q, c), the point of contact x(c) and the reset v+ = R(v-, t, c), everything
    one-sided at the impact:

        dt = -(g_q u- + g_c) / (g_q v-),
        u+ = x_c - v+ dt,
        z+ = R_v (z- + a_old dt) + R_t dt + R_c - a_new dt.

    For x_c = 0 the determinant of (u-, z-) -> (u+, z+) is R_v v+ / v-.
    """
    assert trace.gap is not None
    assert trace.gap_rate is not None
    assert trace.velocity_after is not None
    assert trace.next_side is not None
    before = Expr("velocity", (), 0)
    reset = trace.velocity_after
    here = {Expr("coordinate", (), 0): trace.contact}
    old = substitute(trace.acceleration[0], here)
    new = substitute(trace.acceleration[0], here | {before: reset, Expr("side"): trace.next_side})
    slope = differentiate(reset, before)
    drift = trace.time_derivative(reset)
    result = Saltation([], [], [])
    for j in range(trace.columns):
        (u,), (z,) = trace.tangent_leaves(j)
        shift = -(trace.gap_rate * u + substitute(trace.partial_derivative(trace.gap, j), here)) / (
            trace.gap_rate * before
        )
        result.shift.append(shift)
        result.coordinate.append(contact_shift(trace, j) - reset * shift)
        result.velocity.append(
            slope * (z + old * shift) + (drift - new) * shift + trace.partial_derivative(reset, j)
        )
    return result


def contact_shift(trace: Trace, j: int) -> Expr:
    """The derivative x_c of the point of contact to column j's parameter.

    At rest there, u is x_c and z is 0.
    """
    assert trace.contact is not None
    return trace.partial_derivative(trace.contact, j)


def release_shift(trace: Trace) -> list[Expr]:
    """The shift dt = -b_c / b_t of a release from rest, where the contact acceleration b(t, c) of
    the side passes through 0.

    Under constant loads, where b does not depend on t, it is nan.
    """
    pull = trace.contact_acceleration
    assert pull is not None
    slope = trace.time_derivative(pull)
    if slope is number(0.0):
        return [number(math.nan)] * trace.columns
    return [-trace.partial_derivative(pull, j) / slope for j in range(trace.columns)]


def rest_shift(trace: Trace) -> list[Expr]:
    """The shift of the end of an accumulation of impacts, from the state just after one of them, on
    its side.

    The shift of that impact is dt = (x_c - u) / v, and that of its speed dv = z + a dt. The time
    left is R = 2 w (1/abs(b_s) + e1/abs(b_n)) / (1 - e1 e2), as in `accumulation`. The shift of the
    rest is therefore dt + R_v dv + R_t dt + R_c, with the error of R, which is of the order of R^2.
    """
    v = Expr("velocity", (), 0)
    left = time_left(trace)
    acceleration = substitute(trace.acceleration[0], {Expr("coordinate", (), 0): trace.contact})
    slope = differentiate(left, v)
    drift = trace.time_derivative(left)
    result = []
    for j in range(trace.columns):
        (u,), (z,) = trace.tangent_leaves(j)
        shift = (contact_shift(trace, j) - u) / v
        result.append(
            shift
            + slope * (z + acceleration * shift)
            + drift * shift
            + trace.partial_derivative(left, j)
        )
    return result


def time_left(trace: Trace) -> Expr:
    """The time R that is left until an accumulation of impacts ends, from the velocity just after
    one of them, on its side.
    """
    pull = trace.contact_acceleration
    gap_rate = trace.gap_rate
    reset = trace.velocity_after
    turn = trace.next_side
    assert pull is not None
    assert gap_rate is not None
    assert reset is not None
    assert turn is not None
    v = Expr("velocity", (), 0)
    side = Expr("side")
    next_side, after = (substitute(x, {v: -v}) for x in (turn, reset))
    last_side, last = (substitute(x, {v: -after, side: next_side}) for x in (turn, reset))
    speed = gap_rate * v
    next_speed, last_speed = (
        substitute(gap_rate, {side: s}) * x for s, x in ((next_side, after), (last_side, last))
    )
    flights = speed / pull + next_speed / substitute(pull, {side: next_side})
    return -2.0 * flights / (1.0 - last_speed / speed)


def places_at_event(trace: Trace) -> dict[str, tuple[str, int]]:
    """The places of an event's instant, velocities and shifts."""
    count = len(trace.acceleration)
    first = len(trace.parameters) + len(trace.sided)
    instant = {op: ("parameters", first + i) for i, op in enumerate(INSTANT)}
    return instant | {"velocity": ("state", count), "shift": ("state", 2 * count)}


def number_slopes(trace: Trace) -> dict[int, Any]:
    """The derivatives (`ColumnSum`) of the numbers that events at contacts need, at an instant that
    moves with its shift; those of numbers that do not change are left out."""
    found = dict[int, Any]()
    shift = Expr("shift", (), 0)
    for i, root in enumerate(trace.contact_numbers if trace.columns else ()):
        if root.op != "number":
            along = trace.column_sum(root)
            drift = trace.time_derivative(root)
            found[i] = (
                along
                if drift is number(0.0)
                else along._replace(terms=(*along.terms, (shift, drift)))
            )
    return {i: along for i, along in found.items() if along.expressions}


def shifts(trace: Trace) -> list[tuple[EventCode, int, Any]]:
    """For every margin, and every reaction of several contacts, the kind and the detail of the
    event at which it reaches 0, and the event's shift; for a reaction its derivative at a fixed
    time, which is -dt times its rate."""
    if trace.columns == 0:
        return []
    a = trace.acceleration[: trace.dof]
    accelerations = {Expr("acceleration", (), i): each for i, each in enumerate(a)}
    both = (trace.margins.values(), trace.reactions)
    margins, reactions = (
        [trace.written_out(substitute(each, accelerations)) for each in given] for given in both
    )
    found = [(EventCode.LIMIT, i, margin_shift(trace, margin)) for i, margin in enumerate(margins)]
    return [
        *found,
        *(
            (EventCode.RELEASE, i, trace.column_sum(reaction))
            for i, reaction in enumerate(reactions)
        ),
    ]


def margin_shift(trace: Trace, margin: Expr) -> Any:
    """The shift of the instant at which a margin m(q, v, t, c) reaches 0: -(m_q u + m_v z + m_c) /
    (m_t + m_q v + m_v a).
    """
    speed = trace.time_derivative(margin)
    for i, a in enumerate(trace.acceleration[: trace.dof]):
        speed = speed + differentiate(margin, Expr("coordinate", (), i)) * Expr("velocity", (), i)
        speed = speed + differentiate(margin, Expr("velocity", (), i)) * a
    return trace.column_sum(margin, over=trace.written_out(-speed))
