"""The tangent of a traced motion: its derivatives to the state at the start and to parameters, as expressions of the graph.

Column j of the tangent is the derivative to the j-th initial coordinate, then to the j-th initial velocity, then to the number
at the j-th dotted path. With u = dq/dc and z = dv/dc it obeys, along an arc, u' = z and

    z' = a_q u + a_v z + a_c,

and at an event, whose time moves by dt for a unit of c, it jumps. Everything here is at a fixed time: where c is the forcing
frequency W, the kernel's time counts from `origin`, whole forcing periods after 0, and every load is a function of
n W (origin + t), so a_c = a_W + (origin / W) a_t, a_t without the records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from saltus.errors import ParameterError, near
from saltus.systems import Harmonic, System, numbers
from saltus.taylor.graph import Expr, differentiate, number, ordered, substitute

if TYPE_CHECKING:
    from saltus.taylor.tracing import Trace

FREQUENCY = "load.frequency"


@dataclass(frozen=True)
class Saltation:
    """What an impact makes of the tangent, one expression for each column.

    They are expressions of the tangent's coordinates and velocities before the impact, of velocity 0 (the model's own, v-, before
    the impact), the time, the origin, the side before the impact and the parameters.
    """

    coordinate: list[Expr]  # u+
    velocity: list[Expr]  # z+
    shift: list[Expr]  # dt, of the impact's time


def check_paths(system: System, paths: tuple[str, ...]) -> tuple[str, ...]:
    """The dotted paths to differentiate to, once each of them is known to name a number that can vary.

    Raises:
        ParameterError: a path that is not a number of the system, with the near ones; an order; a path given twice.
    """
    known = [path for path, _ in numbers(system)]
    for path in paths:
        if path not in known:
            system.get(str(path))  # refuses what leads nowhere
            below = [name for name in known if name.startswith(f"{path}.")]
            raise ParameterError(f"{path} is not a number, so there is no derivative to it; {near(str(path), below or known)}")
        if path.endswith(".order") and isinstance(system.get(path.rpartition(".")[0]), Harmonic):
            raise ParameterError(f"{path} is a whole number, so there is no derivative to it; choose another parameter")
    if len(set(paths)) < len(paths):
        raise ParameterError(f"each parameter may be named once, got {paths!r}")
    return tuple(paths)


def extend(trace: Trace, paths: tuple[str, ...]) -> None:
    """Append the tangent's columns to a trace, as further coordinates: number dof + j dof + d is u_d of column j."""
    own = list(trace.acceleration)
    trace.paths, trace.columns = paths, 2 * trace.dof + len(paths)
    for path, order in list(trace.records):  # what the time derivative of an event needs
        if (path, order + 1) not in trace.records:
            trace.records.append((path, order + 1))
    for j in range(trace.columns):
        trace.acceleration += [along(trace, a, j) for a in own]


def saltation(trace: Trace) -> Saltation:
    """The saltation of an impact, for a model with contact and a trace with columns.

    With the gap g(q, c), the point of contact x(c) and the reset v+ = R(v-, t, c), everything one-sided at the impact:

        dt = -(g_q u- + g_c) / (g_q v-),
        u+ = x_c - v+ dt,
        z+ = R_v (z- + a_old dt) + R_t dt + R_c - a_new dt.

    For x_c = 0 the determinant of (u-, z-) -> (u+, z+) is R_v v+ / v-.
    """
    assert trace.gap is not None
    assert trace.gap_rate is not None
    assert trace.velocity_after is not None
    assert trace.next_side is not None
    before, reset = Expr("velocity", (), 0), trace.velocity_after
    here = {Expr("coordinate", (), 0): trace.contact}
    old = substitute(trace.acceleration[0], here)
    new = substitute(trace.acceleration[0], here | {before: reset, Expr("side"): trace.next_side})
    slope, drift = differentiate(reset, before), rate(trace, reset)
    result = Saltation([], [], [])
    for j in range(trace.columns):
        (u,), (z,) = leaves(trace, j)
        shift = -(trace.gap_rate * u + substitute(partial(trace, trace.gap, j), here)) / (trace.gap_rate * before)
        result.shift.append(shift)
        result.coordinate.append(contact_shift(trace, j) - reset * shift)
        result.velocity.append(slope * (z + old * shift) + (drift - new) * shift + partial(trace, reset, j))
    return result


def contact_shift(trace: Trace, j: int) -> Expr:
    """x_c: how the point of contact moves with column j's parameter. At rest there it is u, and z is 0."""
    assert trace.contact is not None
    return partial(trace, trace.contact, j)


def release_shift(trace: Trace) -> list[Expr]:
    """dt of a release from rest, where the contact acceleration b(t, c) of the side passes through 0: -b_c / b_t.

    Under constant loads there is none.
    """
    pull = trace.contact_acceleration
    assert pull is not None
    slope = rate(trace, pull)
    if slope is number(0.0):
        return [number(math.nan)] * trace.columns
    return [-partial(trace, pull, j) / slope for j in range(trace.columns)]


def rest_shift(trace: Trace) -> list[Expr]:
    """dt of coming to rest at the end of an accumulation of impacts, from the state just after one of them on its side.

    That impact moved by dt = (x_c - u) / v, and its speed by dv = z + a dt. The time left is
    R = 2 w (1/abs(b_s) + e1/abs(b_n)) / (1 - e1 e2), as in `contact.accumulation`, so rest moves by
    dt + R_v dv + R_t dt + R_c. The error is that of R, of the order of R^2.
    """
    v, left = Expr("velocity", (), 0), time_left(trace)
    acceleration = substitute(trace.acceleration[0], {Expr("coordinate", (), 0): trace.contact})
    slope, drift, result = differentiate(left, v), rate(trace, left), []
    for j in range(trace.columns):
        (u,), (z,) = leaves(trace, j)
        shift = (contact_shift(trace, j) - u) / v
        result.append(shift + slope * (z + acceleration * shift) + drift * shift + partial(trace, left, j))
    return result


def time_left(trace: Trace) -> Expr:
    """R: what is left of an accumulation of impacts, from the velocity just after one of them on its side."""
    pull, gap_rate, reset, turn = trace.contact_acceleration, trace.gap_rate, trace.velocity_after, trace.next_side
    assert pull is not None
    assert gap_rate is not None
    assert reset is not None
    assert turn is not None
    v, side = Expr("velocity", (), 0), Expr("side")
    next_side, after = (substitute(x, {v: -v}) for x in (turn, reset))
    last_side, last = (substitute(x, {v: -after, side: next_side}) for x in (turn, reset))
    speed = gap_rate * v
    next_speed, last_speed = (substitute(gap_rate, {side: s}) * x for s, x in ((next_side, after), (last_side, last)))
    flights = speed / pull + next_speed / substitute(pull, {side: next_side})
    return -2.0 * flights / (1.0 - last_speed / speed)


def margin_shift(trace: Trace, name: str) -> list[Expr]:
    """dt of a margin m(q, v, a, t, c) reaching 0: -(m_q u + m_v z + m_c) / (m_t + m_q v + m_v a), a being the model's own."""
    a = trace.acceleration[: trace.dof]
    margin = substitute(trace.margins[name], {Expr("acceleration", (), i): a[i] for i in range(trace.dof)})
    speed = rate(trace, margin)
    for i in range(trace.dof):
        speed = speed + differentiate(margin, Expr("coordinate", (), i)) * Expr("velocity", (), i)
        speed = speed + differentiate(margin, Expr("velocity", (), i)) * a[i]
    return [-along(trace, margin, j) / speed for j in range(trace.columns)]


def leaves(trace: Trace, j: int) -> tuple[list[Expr], list[Expr]]:
    """u and z of column j: the coordinates and the velocities that stand for them."""
    places = range(trace.dof * (1 + j), trace.dof * (2 + j))
    return [Expr("coordinate", (), i) for i in places], [Expr("velocity", (), i) for i in places]


def along(trace: Trace, root: Expr, j: int) -> Expr:
    """The derivative of an expression of the motion along column j, at a fixed time."""
    total = partial(trace, root, j)
    for i, (u, z) in enumerate(zip(*leaves(trace, j), strict=True)):
        total = total + differentiate(root, Expr("coordinate", (), i)) * u
        total = total + differentiate(root, Expr("velocity", (), i)) * z
    return total


def partial(trace: Trace, root: Expr, j: int) -> Expr:
    """The partial derivative of an expression to column j's parameter, at a fixed time and state; 0 for the state's columns."""
    if j < 2 * trace.dof:
        return number(0.0)
    path = trace.paths[j - 2 * trace.dof]
    leaf = Expr("parameter", (), trace.parameters.index(path))
    derivative = differentiate(root, leaf)
    if path == FREQUENCY:
        derivative = derivative + Expr("origin") / leaf * differentiate(root, Expr("time"))
    return derivative


def rate(trace: Trace, root: Expr) -> Expr:
    """The partial derivative of an expression to the time, records included."""
    total = differentiate(root, Expr("time"))
    for node in ordered([root]):
        if node.op == "record":
            path, order = trace.records[node.value]
            total = total + differentiate(root, node) * Expr("record", (), trace.records.index((path, order + 1)))
    return total
