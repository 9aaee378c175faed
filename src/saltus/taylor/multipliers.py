"""The equations of a model whose contacts and frictions are held by multipliers, in its own
coordinates.

A contact has a gap g(t, q) and a friction a sliding speed u(t, q, v), in which v is linear. Both
give rows of one kind, which follow from the traced expressions by differentiation:

    g' = W v + b,    W = dg/dq,    b = dg/dt;    u = T v + w,    T = du/dv.

A row that is held stays at 0, A v + b = 0, by a multiplier l that acts along a column B:

    M v' = r + sum B l,    d/dt (A v + b) = 0,
    B = W' - sum mu s T'  of a contact with the frictions that slide in it,    B = T'  of a friction
    that sticks.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from saltus.errors import TraceError
from saltus.systems import (
    ask,
    eliminated,
    mass_and_force,
    normal_forces,
)
from saltus.taylor.graph import (
    Expr,
    as_expr,
    combine,
    comparing_symbols,
    differentiate,
    number,
    ordered,
    substitute,
)


class HeldRow(NamedTuple):
    """What a contact or a friction holds at 0 while it is closed, or sticks."""

    value: Expr  # the gap, or the sliding speed
    entries: list[Expr]  # A
    drift: Expr  # b
    bend: Expr  # d/dt (A v + b) without accelerations


class HeldMotion(NamedTuple):
    """The equations of motion for any choice of what is held, and what they need."""

    accelerations: list[Expr]
    contacts: list[HeldRow]
    frictions: list[HeldRow]
    reactions: list[Expr]  # of the contacts, 0 of open ones
    margins: list[Expr]  # what a friction can carry minus, then plus what it carries
    # what must stay positive, by the limit at which a motion ends
    limits: dict[str, Expr]


def held_motion(trace: Any, model: Any, t: Any, q: Any, v: Any, load: Any) -> HeldMotion:
    """The equations of a model, with leaves `free` and `slide` for what is held.

    `free` is 1 for a contact that is not held, then for a friction, and else 0.

    `slide` is the direction in which a friction slides, 0 where it has no force or is held. Of a
    friction that carries its static limit and does not move, it is twice that direction.
    """
    contacts = [_contact_row(trace, model, part, t, q, load) for part in model.contacts]
    frictions = [_friction_row(trace, model, part, t, q, v, load) for part in model.frictions]
    mass, force = mass_and_force(model, t, q, v, load)
    size = len(force)
    count = len(contacts)
    names = [part.name for part in model.contacts]
    slides = [Expr("slide", (), k) for k in range(len(frictions))]
    free = [Expr("free", (), r) for r in range(count + len(frictions))]
    normals = [as_expr(n) for n in normal_forces(model, t, q, v, load)]
    pushes = [list(row.entries) for row in (*contacts, *frictions)]
    right: list[Any] = [as_expr(r) for r in force]
    for part, row, slide, normal in zip(model.frictions, frictions, slides, normals, strict=True):
        slips = _slips(part, row.value, slide)
        if part.contact is None:
            right = [r - slips * normal * x for r, x in zip(right, row.entries, strict=True)]
        else:
            pressed = names.index(part.contact)
            pushes[pressed] = [
                b - slips * x for b, x in zip(pushes[pressed], row.entries, strict=True)
            ]
    total = size + len(free)
    matrix: list[list[Any]] = [[_plain(x) for x in row] + [0.0] * len(free) for row in mass]
    matrix += [[0.0] * total for _ in free]
    for r, (row, push) in enumerate(zip((*contacts, *frictions), pushes, strict=True)):
        held = 1.0 - free[r]
        for i in range(size):
            matrix[i][size + r] = _plain(-(held * push[i]))
            matrix[size + r][i] = _plain(held * row.entries[i])
        matrix[size + r][size + r] = free[r]
        right.append(-(held * row.bend))
    solved = [as_expr(x) for x in eliminated(matrix, right, range(total))]
    forces = [(1.0 - f) * x for f, x in zip(free, solved[size:], strict=True)]
    margins = list[Expr]()
    limits = dict[str, Expr]()
    for k, (part, normal) in enumerate(zip(model.frictions, normals, strict=True)):
        place = None if part.contact is None else names.index(part.contact)
        presses = normal if place is None else forces[place]
        most = part.most * presses
        margins += [most - forces[count + k], most + forces[count + k]]
        # where a pivot of a contact vanishes no reaction is the only one
        limits[part.limit] = (
            normal if place is None else as_expr(matrix[size + place][size + place])
        )
    return HeldMotion(solved[:size], contacts, frictions, forces[:count], margins, limits)


def _slips(part: Any, speed: Expr, slide: Expr) -> Expr:
    """mu s of a friction with a sliding speed, and mu_s s where `slide` is twice the direction."""
    square = slide * slide
    kinetic = part.coefficient(slide * speed) * (4.0 - square) / 3.0
    return as_expr(slide * (kinetic + part.most * (square - 1.0) / 6.0))


def _contact_row(trace: Any, model: Any, part: Any, t: Any, q: Any, load: Any) -> HeldRow:
    """The row of a contact."""
    if part.distance is None:
        gap = part.sign * (_kept(model, part, t, q, load) - part.position)
    else:
        gap = ask(model, part.distance, t, q, load)
    return _row_of_gap(trace, part.name, combine("add", gap, 0.0))


@comparing_symbols(refused=False)
def _row_of_gap(trace: Any, name: str, gap: Expr) -> HeldRow:
    """The row of a gap."""
    if any(node.op == "velocity" for node in ordered([gap])):
        raise TraceError(
            f"{trace.model}: the gap of {name!r} depends on a velocity; it may depend on time,"
            " coordinates and the load"
        )
    entries = [differentiate(gap, Expr("coordinate", (), i)) for i in range(trace.dof)]
    if all(entry is number(0.0) for entry in entries):
        raise TraceError(f"{trace.model}: the gap of {name!r} depends on no coordinate")
    return _row(trace, gap, entries, time_derivative(trace, gap))


def _friction_row(trace: Any, model: Any, part: Any, t: Any, q: Any, v: Any, load: Any) -> HeldRow:
    """The row of a friction."""
    if part.rate is None:
        speed = _rate_of(trace, as_expr(_kept(model, part, t, q, load)))
    else:
        speed = ask(model, part.rate, t, q, v, load)
    return _row_of_speed(trace, part.name, combine("sub", speed, part.ground_speed))


@comparing_symbols(refused=False)
def _row_of_speed(trace: Any, name: str, speed: Expr) -> HeldRow:
    """The row of a sliding speed."""
    velocities = [Expr("velocity", (), i) for i in range(trace.dof)]
    entries = [differentiate(speed, velocity) for velocity in velocities]
    if any(node.op == "velocity" for node in ordered(entries)):
        raise TraceError(
            f"{trace.model}: the sliding speed of {name!r} must be linear in the velocities"
        )
    if all(entry is number(0.0) for entry in entries):
        raise TraceError(f"{trace.model}: the sliding speed of {name!r} reads no velocity")
    drift = substitute(speed, dict.fromkeys(velocities, 0.0))
    return _row(trace, speed, entries, drift)


def _kept(model: Any, part: Any, t: Any, q: Any, load: Any) -> Any:
    """The coordinate of a part, or its sum."""
    known = dict(zip(model.coordinates, q if len(model.coordinates) > 1 else (q,), strict=True))
    if isinstance(part.coordinate, str):
        return known[part.coordinate]
    total: Any = 0.0
    for name, factor in part.coordinate.items():
        if name in known:
            term = known[name]
        elif name in model.channels:
            term = getattr(load, name)(t)
        else:
            term = ask(model, name, q)
        total = total + factor * term
    return total


@comparing_symbols(refused=False)
def _rate_of(trace: Any, root: Expr) -> Expr:
    """The time derivative of an expression of time and coordinates."""
    return _rate(trace, root, time_derivative(trace, root))


def _row(trace: Any, value: Expr, entries: list[Expr], drift: Expr) -> HeldRow:
    """A row with what its rate changes by along the motion, without accelerations."""
    total = drift
    for i, entry in enumerate(entries):
        total = total + entry * Expr("velocity", (), i)
    return HeldRow(value, entries, drift, _rate_of(trace, total))


def _rate(trace: Any, root: Expr, drift: Expr) -> Expr:
    """The time derivative of an expression along the motion without accelerations, from that at a
    fixed state."""
    total = drift
    for i in range(trace.dof):
        slope = differentiate(root, Expr("coordinate", (), i))
        total = total + slope * Expr("velocity", (), i)
    return total


def time_derivative(trace: Any, root: Expr) -> Expr:
    """The partial derivative of an expression to the time; the records that it reads are noted."""
    for node in ordered([root]):
        if node.op == "record":
            path, order = trace.records[node.value]
            if (path, order + 1) not in trace.records:
                trace.records.append((path, order + 1))
    derivative: Expr = trace.time_derivative(root)
    return derivative


def _plain(entry: Any) -> Any:
    """An entry of a matrix, as a number where it is one."""
    return entry.value if isinstance(entry, Expr) and entry.op == "number" else entry
