"""Whether a traced graph is the user's own Python: it is compared with what that returns for floats.

A model may ask for the type of a number, as by `isinstance`, or of a coordinate. Symbols are of
another type, and no operation of theirs sees that another equation is chosen.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.errors import TraceError
from saltus.systems import DeclaredLoad, System, mass_rows, natural_units, numbers, solved_motion
from saltus.taylor.graph import Expr, substitute
from saltus.taylor.tracing import Trace

# States, in natural units, at which both are evaluated: coordinates, velocities and shares of a
# period; any numbers would do.
STATES = ((0.31, -0.23, 0.37), (-0.27, 0.41, 0.11), (1.7, 1.3, 0.71), (-2.1, -0.9, 0.93))
ROUNDING = 1e-7  # of differences, relative to the largest of the numbers


def check_agreement(system: System, traced: Trace) -> None:
    """Refuse a model whose equations differ for symbols and for numbers.

    Parameters
    ----------
    system
        What was traced.
    traced
        Its trace, without a tangent.

    Raises
    ------
    TraceError
        The error names the class and the part that differs.
    """
    if traced.modes is not None:
        return
    inner = system.in_gap_coordinates
    given = dict(numbers(inner))
    values = {
        Expr("parameter", (), i): float(given[path])
        for i, path in enumerate(traced.parameters)
        if path in given
    }
    units = natural_units(inner)
    period = system.load.period or units.time
    for at, rate, share in STATES:
        time = share * period
        q = [at * float(length) / (1 + i) for i, length in enumerate(units.lengths)]
        v = [rate * float(speed) / (1 + i) for i, speed in enumerate(units.speeds)]
        for side in system.model.every_side:
            if system.model.sides:  # beyond the contact abs(q) is another expression
                inward = float(inner.one_contact.inward(side))
                q = [float(inner.one_contact.contact) + inward * abs(at) * units.length]
            leaves: dict[Expr, Any] = {
                **values,
                **{Expr("coordinate", (), i): x for i, x in enumerate(q)},
                **{Expr("velocity", (), i): x for i, x in enumerate(v)},
                Expr("time"): time,
                Expr("origin"): 0.0,
                Expr("side"): float(side),
            }
            _compare(inner, traced, leaves, (time, q, v, side))


def _compare(
    system: System, traced: Trace, leaves: dict[Expr, Any], state: tuple[float, Any, Any, int]
) -> None:
    frictions = len(traced.sided)
    directions = [1.0 if k % 2 else -1.0 for k in range(frictions)]
    if traced.rows:  # they are compared without friction
        directions[: len(system.model.frictions)] = [0.0] * len(system.model.frictions)
    leaves |= {Expr("free", (), i): 1.0 for i in range(traced.flags)}
    leaves |= {Expr("slide", (), k): direction for k, direction in enumerate(directions)}
    first = len(traced.sided) - len(traced.switches)
    # Sides of functions are those of the state, as a formula may have the same switch.
    functions = [k for k in traced.functions if k < first and k not in traced.keeping_sides]
    for k in (*functions, *range(first, len(directions))):
        value = substitute(traced.reactions[len(traced.signs) + 2 * k], leaves)
        if value.op != "number":
            return  # a record or a pulse is read from a table
        directions[k] = 1.0 if value.value >= 0.0 else -1.0
        leaves[Expr("slide", (), k)] = directions[k]
    directions = directions[:first]
    for part, own in _own_values(system, traced, state, directions):
        roots = getattr(traced, part)
        roots = roots if isinstance(roots, list) else [roots]
        graph = [substitute(root, leaves) for root in roots]
        if any(node.op != "number" for node in graph):
            continue  # a record or a pulse is read from a table
        values = np.array([node.value for node in graph], dtype=float)
        size = float(np.abs(values).max(initial=0.0))
        if not (np.isfinite(own).all() and math.isfinite(size)) or own.shape != values.shape:
            continue
        size = max(size, float(np.abs(own).max(initial=0.0)))
        if np.abs(values - own).max(initial=0.0) > ROUNDING * size:
            i = int(np.abs(values - own).argmax())
            raise TraceError(
                f"{traced.model} gives other equations for symbols than for numbers: {WORDS[part]}"
                f" {own[i]:.6g} for numbers and {values[i]:.6g} as traced; what chooses between"
                " equations, as isinstance or type do, is a ClassVar, or two classes of model"
            )


WORDS = {
    "acceleration": "an acceleration is",
    "mass": "an entry of the mass matrix is",
    "positions": "the position of a contact is",
    "levels": "the ground speed of a friction, or the position of a surface, is",
    "gap": "the gap is",
}


def _own_values(
    system: System, traced: Trace, state: tuple[float, Any, Any, int], slides: list[float]
) -> list[tuple[str, np.ndarray]]:
    """What the user's own Python returns for floats, by the part of the trace; nothing where it
    cannot be asked."""
    model: Any = system.model
    time, q, v, side = state
    x, rate = (q[0], v[0]) if len(q) == 1 else (tuple(q), tuple(v))
    load = DeclaredLoad(system.load, model)
    found = list[tuple[str, Any]]()
    try:
        with np.errstate(all="ignore"):
            if model.holds_coordinates:
                free = [1.0] * traced.local
                found.append(
                    ("acceleration", solved_motion(model, time, x, rate, load, free, slides)[0])
                )
                rows = mass_rows(model, x, time, load)
                if not getattr(model, "dependent", 0):
                    found.append(("mass", [entry for row in rows for entry in row]))
                found.append(("positions", [contact.position for contact in model.contacts]))
                speeds = [
                    0.0 if traced.rows else friction.ground_speed for friction in model.frictions
                ]
                first = len(model.frictions)
                places = [
                    0.0 if first + k in traced.functions else surface.position
                    for k, surface in enumerate(model.surfaces)
                ]
                switches = [0.0] * len(traced.switches)
                found.append(("levels", [*speeds, *places, *switches]))
            else:
                value = model.acceleration(time, x, rate, side, load)
                found.append(("acceleration", value if len(q) > 1 else [value]))
                if traced.gap is not None:
                    found.append(("gap", [model.gap(x, side)]))
        if any(np.iscomplexobj(value) for _, own in found for value in own):
            return []  # a power of a negative number, on the side that `np.where` does not take
        return [(part, np.array([float(value) for value in own])) for part, own in found]
    # a user's code may raise anything; what cannot be asked with floats is known as traced alone
    except Exception:
        return []
