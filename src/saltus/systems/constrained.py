"""Accelerations of a model that gives its mass matrix and force, with some of its coordinates held at contacts.

Everything here takes numbers, arrays or symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError

if TYPE_CHECKING:
    from saltus.systems.model import Model


def constrained_acceleration(
    model: Model, t: Any, q: Any, v: Any, load: Any, free: Sequence[Any], slides: Sequence[Any] = ()
) -> list[Any]:
    """The accelerations a of (D M D + 1 - D) a = D r, with D = diag(free): 1 where a coordinate is free, 0 where it is held.

    r has the force of each friction that slides, -mu_k N s with its direction s in `slides`, 0 where it sticks.

    q and v are scalars where there is one coordinate, else tuples. The matrix is eliminated from its first row on, without
    exchanging rows, as the pivots of a positive definite matrix are positive.
    """
    mass, force = mass_and_force(model, t, q, v, load)
    for friction, normal, s in zip(model.frictions, normal_forces(model, t, q, v, load), slides, strict=True):
        place = model.coordinates.index(friction.coordinate)
        force[place] = force[place] - s * friction.kinetic * normal
    size = len(force)
    matrix = [[_held(mass[i][j], i, j, free) for j in range(size)] for i in range(size)]
    right = [free[i] * force[i] for i in range(size)]
    for k in range(size):
        for i in range(k + 1, size):
            if _is_zero(matrix[i][k]):
                continue
            factor = matrix[i][k] / matrix[k][k]
            for j in range(k + 1, size):
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j]
            right[i] = right[i] - factor * right[k]
    solved: list[Any] = [0.0] * size
    for i in reversed(range(size)):
        value = right[i]
        for j in range(i + 1, size):
            if not _is_zero(matrix[i][j]):
                value = value - matrix[i][j] * solved[j]
        solved[i] = value / matrix[i][i]
    return solved


def reactions(model: Model, t: Any, q: Any, v: Any, a: Sequence[Any], load: Any) -> list[Any]:
    """The force of each contact along its sign, sign (M a - r)_i; 0 where its coordinate is free."""
    lacking = _lacking(model, t, q, v, a, load)
    return [contact.sign * lacking[model.coordinates.index(contact.coordinate)] for contact in model.contacts]


def stick_margins(model: Model, t: Any, q: Any, v: Any, a: Sequence[Any], load: Any) -> list[Any]:
    """mu_s N - l and mu_s N + l of each friction, one after the other, with the force l = (M a - r)_i that makes it stick."""
    lacking, margins = _lacking(model, t, q, v, a, load), []
    for friction, normal in zip(model.frictions, normal_forces(model, t, q, v, load), strict=True):
        force, most = lacking[model.coordinates.index(friction.coordinate)], friction.most * normal
        margins += [most - force, most + force]
    return margins


def normal_forces(model: Model, t: Any, q: Any, v: Any, load: Any) -> tuple[Any, ...]:
    """The normal force N of each friction.

    Raises
    ------
    ParameterError
        The model does not give as many as it has frictions.
    """
    given = model.normal_forces(t, q, v, load) if model.frictions else ()
    if len(given) != len(model.frictions):
        kind, count = type(model).__name__, len(model.frictions)
        raise ParameterError(f"{kind}.normal_forces must return {count} value(s), one for each friction, got {given!r}", "model")
    return tuple(given)


def _lacking(model: Model, t: Any, q: Any, v: Any, a: Sequence[Any], load: Any) -> list[Any]:
    """M a - r, the force that must act on each coordinate besides r for these accelerations."""
    mass, force = mass_and_force(model, t, q, v, load)
    return [sum(m * x for m, x in zip(row, a, strict=True) if not _is_zero(m)) - r for row, r in zip(mass, force, strict=True)]


def apart(model: Model, mass: Sequence[Sequence[Any]]) -> bool:
    """Whether the mass matrix connects no coordinate with a contact to one with a friction, whatever the state."""
    names, near = model.coordinates, {contact.coordinate for contact in model.contacts}
    for _ in names:
        near |= {b for a in near for b in names if not _is_zero(mass[names.index(a)][names.index(b)])}
    return not any(friction.coordinate in near for friction in model.frictions)


def mass_and_force(model: Model, t: Any, q: Any, v: Any, load: Any) -> tuple[list[list[Any]], list[Any]]:
    """M(q) as rows and r(t, q, v) as a list, for any number of coordinates."""
    mass, force = model.mass_matrix(q), model.force(t, q, v, load)
    if len(model.coordinates) == 1:
        return [[mass]], [force]
    return [list(row) for row in mass], list(force)


def _held(entry: Any, i: int, j: int, free: Sequence[Any]) -> Any:
    """An entry of D M D + 1 - D."""
    if i != j:
        return 0.0 if _is_zero(entry) else free[i] * free[j] * entry
    return 1.0 if isinstance(entry, float) and entry == 1.0 else free[i] * entry + (1.0 - free[i])


def _is_zero(entry: Any) -> bool:
    """Whether an entry is 0 for every state: the number 0, and not a symbol or an array."""
    return isinstance(entry, (int, float)) and entry == 0
