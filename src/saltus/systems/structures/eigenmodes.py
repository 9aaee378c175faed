"""The motion of a structure between its events in its eigenmodes, of which those that have died out
limit no step.

While the contacts of a structure and the sides of its surfaces do not change, its state obeys x' =
A x + B u. The inputs u are the channels of the load, 1, and the positions at which contacts hold
it. In A's eigenvectors each coordinate y has an equation of its own,

    y' = lambda y + f(t).

Its Taylor coefficients follow forwards from its value, y_(k+1) = (lambda y_k + f_k) / (k + 1). They
limit the step to a few 1 / abs(lambda), however small y is, as the rounding error of y grows as
fast in them. But one polynomial of the same degree n obeys the equation up to the power t^n. It is
computed backwards: y_k = ((k + 1) y_(k+1) - f_k) / lambda from y_n = -f_n / lambda. If the real
part of lambda is negative, a solution differs from it by at most what it does at the start and the
polynomial's last term. So a mode whose value is that of its polynomial to within the error that a
step may make is followed on it.

`in_modes` in `flow/kernel/steps.py` computes both, from the table that is made here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np


def eigenmodes_of(structure: Any, spacing: int, derivatives: bool = False) -> np.ndarray:
    """The table of a structure's eigenmodes that the kernel reads; empty where its own Taylor
    series are faster or more accurate.

    It begins with the number of channels and the place of a channel's series behind that of the one
    before. Then follow numbers for each set of closed contacts and of surfaces on whose side +1 it
    is. They are lambda, how far a mode reaches in units of the state, the rows of the inverse of
    the eigenvectors, the eigenvectors' coordinates, and the factors of the inputs; then the
    reactions of the contacts by eigenmodes, which are measured from where constant inputs hold
    them, and by inputs. The real and the imaginary part of a mode
    have rows of their own.

    Parameters
    ----------
    structure
        The structure.
    spacing
        The most coefficients that a series has.
    derivatives
        Whether the derivatives of its motions follow from the eigenmodes, too.
    """
    # Forces that switch with functions are in no set of them.
    if structure.switched or any(part.function is not None for part in structure.surfaces):
        return np.zeros(0)
    # The eigenmodes of all sets are kept.
    if len(structure.contacts) + len(structure.surfaces) > MOST_PARTS:
        return np.zeros(0)
    fewer = longer_steps(structure)
    size = len(structure.names)
    # A step takes as long as 3 of the other kind for 12 coordinates, 5 for 40, 15 for 100. With
    # derivatives, which have no series then, it takes less from some 10 coordinates on. But
    # reactions have ten times the rounding, so that branches of small structures end sooner.
    worth = fewer >= 1.0 + size / 6.0 or (derivatives and size >= FEWEST)
    return _table(structure, spacing) if worth else np.zeros(0)


MOST_PARTS = 3
FEWEST = 24  # coordinates


@lru_cache(maxsize=8)
def _table(structure: Any, spacing: int) -> np.ndarray:
    contacts = structure.contacts
    surfaces = structure.surfaces
    blocks = [np.array([len(structure.channels), spacing, *(1.0 / np.arange(1, spacing + 1))])]
    for bits in range(1 << len(contacts) + len(surfaces)):
        closed = [c for i, c in enumerate(contacts) if bits >> i & 1]
        pressed = [
            s
            for i, s in enumerate(surfaces)
            if (2 * (bits >> len(contacts) + i & 1) - 1) * s.sign > 0
        ]
        block = _block(first_order_form(structure, closed, pressed), len(structure.channels))
        if block is None:
            return np.zeros(0)
        blocks.append(block)
    return np.concatenate(blocks)


def longer_steps(structure: Any) -> float:
    """How many times fewer steps the eigenmodes make of a period of the slowest mode with an impact
    in it: each mode is then followed until it is 1e-10 of what it was. The modes are those with all
    contacts closed, without the terms that couple them.
    """
    a = first_order_form(structure, structure.contacts, ())[0]
    size = len(structure.names)
    modes = np.arange(structure.local_count, size)
    square = -a[size + modes, modes]
    half = -0.5 * a[size + modes, size + modes]
    if not modes.size or not np.all(square > 0.0) or not np.any(half > 0.0):
        return 1.0
    root = np.sqrt((half**2 - square).astype(complex))
    values = np.append(root - half, -root - half)
    period = 2.0 * math.pi / math.sqrt(square.min())
    with np.errstate(divide="ignore"):
        lives = np.minimum(period, 23.0 / np.maximum(-values.real, 0.0))
    order = np.argsort(-lives, kind="stable")
    fastest = np.maximum.accumulate(np.abs(values[order]))
    ends = lives[order]
    return float(period * fastest[-1] / np.sum(fastest * (ends - np.append(ends[1:], 0.0))))


def first_order_form(
    structure: Any, closed: Sequence[Any], pressed: Sequence[Any]
) -> tuple[np.ndarray, ...]:
    """A, B, P and Q of x' = A x + B u and of the reactions P x + Q u, (contacts,), while some
    contacts are closed. The state x has the coordinates, then their rates; u has the channels of
    the load, 1, and the local displacements, of which those that are held act.

    Parameters
    ----------
    closed, pressed
        The contacts that hold their coordinates, and the surfaces on whose side +1 the structure
        is.
    """
    modes = vars(structure)["_modes"]
    local = structure.form[0]
    m = len(local)
    n = len(structure.names)
    mass = np.eye(n)
    push = np.zeros((n, 1))
    stiffness = np.array(modes.stiffness)
    damping = np.zeros((n, n)) if modes.damping is None else np.array(modes.damping)
    mass[:m, :m] = modes.mass
    if not modes.coupled:  # but for rounding
        damping[m:, m:] = np.diag(np.diag(damping[m:, m:]))
    for surface in pressed:
        i = local.index(surface.coordinate)
        stiffness[i, i] += surface.stiffness
        damping[i, i] += surface.damping
        push[i] += surface.stiffness * surface.position
    held = [i for i, name in enumerate(local) if name in {contact.coordinate for contact in closed}]
    free = [i for i in range(n) if i not in held]
    forces = np.hstack([-stiffness, -damping, modes.forces, push, np.zeros((n, m))])
    forces[:, 2 * n + modes.forces.shape[1] + 1 + np.array(held, dtype=int)] = forces[:, held]
    forces[:, [*held, *(n + i for i in held)]] = 0.0
    rates = np.zeros((2 * n, forces.shape[1]))
    rates[free, [n + i for i in free]] = 1.0
    rates[[n + i for i in free]] = np.linalg.solve(mass[np.ix_(free, free)], forces[free])
    reactions = np.zeros((len(structure.contacts), forces.shape[1]))
    for row, contact in zip(reactions, structure.contacts, strict=True):
        if contact in closed:
            i = local.index(contact.coordinate)
            row[:] = contact.sign * (mass[i] @ rates[n:] - forces[i])
    return rates[:, : 2 * n], rates[:, 2 * n :], reactions[:, : 2 * n], reactions[:, 2 * n :]


def _block(form: Any, channels: int) -> np.ndarray | None:
    """The numbers of one set of closed contacts and pressed surfaces."""
    a, b, reactions, by_inputs = form
    free = np.flatnonzero(np.abs(a[: len(a) // 2]).sum(axis=1))
    moving = np.append(free, len(a) // 2 + free)
    made = decoupled(a[np.ix_(moving, moving)])
    if made is None:
        return None
    values, vectors, inverse = made
    size = len(a)
    count = len(moving)
    table = {
        name: np.zeros(shape)
        for name, shape in (("value", (size, 2)), ("reach", size), ("to", (size, size)))
    }
    back = np.zeros((size, size))
    row = 0
    for value, vector, left in zip(values, vectors.T, inverse, strict=True):
        if value.imag < 0.0:
            continue
        parts = (
            ((left.real, vector.real),)
            if value.imag == 0.0
            else ((left.real, 2.0 * vector.real), (left.imag, -2.0 * vector.imag))
        )
        for ahead, behind in parts:
            table["value"][row] = value.real, value.imag
            table["reach"][row] = 2.0 * np.abs(vector).max()
            table["to"][row, moving] = ahead
            back[moving, row] = behind
            row += 1
    assert row == count
    inputs = table["to"] @ b
    held = reactions @ back
    by_inputs = by_inputs - _at_rest(table["value"][:count], inputs[:count], held, channels)
    return np.concatenate(
        [
            np.asarray(x, dtype=float).ravel()
            for x in (*table.values(), back[: size // 2], inputs, held, by_inputs)
        ]
    )


def _at_rest(values: np.ndarray, inputs: np.ndarray, held: np.ndarray, channels: int) -> np.ndarray:
    """By how much reactions follow more from inputs that are constant, if modes with losses are
    measured from where these hold them: (contacts, inputs), in the kernel's own numbers.
    """
    more = np.zeros((len(held), inputs.shape[1]), dtype=np.longdouble)
    row = 0
    while row < len(values):
        real, imaginary = values[row].astype(np.longdouble)
        width = 1 if imaginary == 0.0 else 2
        if real < 0.0:
            drives = inputs[row : row + width].astype(np.longdouble)
            turned = np.array([[real, imaginary], [-imaginary, real]])[:width, :width]
            rest = turned @ drives / (real**2 + imaginary**2)
            more += held[:, row : row + width].astype(np.longdouble) @ rest
        row += width
    more[:, :channels] = 0.0
    return np.asarray(more)


def decoupled(a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Eigenvalues, eigenvectors and their inverse; None where two of one shape nearly agree, as
    with critical damping.

    Those of slow modes have errors of the rounding of the fastest one. Residuals in extended
    precision, where the machine has it, give their corrections. Modes of different shapes may be as
    close as they like: what then couples them is rounding.
    """
    values, vectors = np.linalg.eig(a)
    exact = values.astype(np.clongdouble)
    shapes = vectors.astype(np.clongdouble)
    real = values.imag == 0.0
    half = len(a) // 2
    known = [(np.flatnonzero(row), row[row != 0.0].astype(np.longdouble)) for row in a]
    if not np.linalg.cond(vectors) < 1.0 / np.finfo(float).eps:
        return None
    for _ in range(2):
        moved = np.array([row @ shapes[columns] for columns, row in known])
        error = np.linalg.solve(shapes.astype(complex), (moved - shapes * exact).astype(complex))
        apart = (exact[None, :] - exact[:, None]).astype(complex)
        turned = np.divide(
            error, apart, out=np.zeros_like(error), where=np.abs(error) < 1e-3 * np.abs(apart)
        )
        exact = exact + np.diag(error)
        exact[real] = exact[real].real
        shapes = shapes + shapes.astype(complex) @ turned
        shapes[:, real] = shapes[:, real].real
    vectors = shapes.astype(complex)
    inverse = np.linalg.inv(vectors)
    parts = ((vectors[part], inverse[:, part]) for part in (slice(half), slice(half, None)))
    amplified = sum(
        np.linalg.norm(one, axis=0) * np.linalg.norm(other, axis=1) for one, other in parts
    )
    return (exact.astype(complex), vectors, inverse) if np.all(amplified < 1e4) else None
