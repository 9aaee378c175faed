"""The mirror symmetry of a forced system, and orbits that are their own mirror images half a period later."""

from __future__ import annotations

import cmath
from dataclasses import replace

import numpy as np

from saltus.continuation import Corrected
from saltus.errors import ParameterError
from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.equations.contacts import ContactsEquations
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.tolerances import TOLERANCES
from saltus.public_functions import answered
from saltus.systems import Constant, Harmonic, Load, Signal, System, check_system


@answered
def is_symmetric(system: System) -> bool:
    """Whether the mirror image of every motion, half a forcing period later, is a motion too: -theta(t + T/2) for theta(t).

    It is if the model has a mirror symmetry and the mirrored load is the load half a period later (errata 18).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.

    Examples
    --------
    >>> saltus.orbits.is_symmetric(system)
    True
    """
    check_system(system, "is_symmetric", several_contacts=True)
    mirrored = system.mirrored()
    if mirrored is None or system.load.period is None:
        return False
    return all(_half_a_period_later(mirrored.load, system.load, name) for name in system.load.channels)


def _half_a_period_later(one: Load, other: Load, name: str) -> bool:
    """Whether a channel of one load is that of the other half a period later, up to a constant position of the ground."""
    first, second = _harmonics(one.channels[name]), _harmonics(other.channels[name])
    if first is None or second is None:
        return False
    orders = {*first, *second} - ({0} if name.startswith("ground_") else set())
    pairs = [(first.get(n, 0.0), (-1) ** n * second.get(n, 0.0)) for n in orders]
    return all(abs(a - b) <= TOLERANCES.load * (1.0 + abs(b)) for a, b in pairs)


def _harmonics(signal: Signal) -> dict[int, complex] | None:
    """The complex amplitudes of a signal, by the order of the harmonic; None for signals that are not harmonic."""
    if isinstance(signal, Constant):
        return {0: signal.value}
    if isinstance(signal, Harmonic):
        return {0: signal.mean, signal.order: signal.amplitude * cmath.exp(1j * signal.phase)}
    total: dict[int, complex] = {}
    for term in getattr(signal, "terms", (None,)):
        amplitudes = None if term is None else _harmonics(term)
        if amplitudes is None:
            return None
        for order, amplitude in amplitudes.items():
            total[order] = total.get(order, 0.0) + amplitude
    return total


def keeps_symmetry(system: System, path: str) -> bool:
    """Whether a system is symmetric and stays so as the parameter at `path` changes."""
    if not is_symmetric(system):
        return False
    value = float(system.get(path))
    for share in (1e-3, -1e-3):
        try:
            beside = system.with_({path: value * (1 + share) + share})
        except ParameterError:  # on one side of a limit of the parameter
            continue
        if is_symmetric(beside):
            return True
    return False


def half(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """An orbit that is its own mirror image, as a solution of the equations over half its period; None for other orbits."""
    equations, signature, unknowns = orbit.equations, orbit.signature, orbit.solution.unknowns
    n, odd = divmod(len(signature.sides) + len(signature.events), 2)
    if signature.symmetric or signature.period % 2 == 0 or odd:
        return None
    if signature.sides:
        first, second = unknowns.reshape(2, n, 2)
        if n % 2 == 0 or np.abs(second - first - [np.pi * signature.period, 0.0]).max() > TOLERANCES.halves:
            return None
    elif signature.events:
        assert isinstance(equations, ContactsEquations)
        both = equations.halves(unknowns, orbit.solution.evaluation)
        if both is None or np.abs(both[1] - both[0]).max() > TOLERANCES.halves:
            return None
    elif signature.closed or (equations.system.model.has_one_contact and not equations.passes_contact):
        return None
    short = equations.with_signature(replace(signature, sides=signature.sides[:n], events=signature.events[:n], symmetric=True))
    found = PeriodicOrbit.near(short, unknowns[: short.size], orbit.solution.values)
    moved = found is not None and not n and np.abs(found.solution.unknowns - unknowns).max() >= TOLERANCES.halves
    return None if moved else found


def over_full_period(equations: OneContactEquations, unknowns: np.ndarray) -> tuple[OneContactEquations, np.ndarray]:
    """The problem of the full period of a symmetric orbit, and the orbit's unknowns in it."""
    signature = equations.signature
    sides = (*signature.sides, *(-s for s in signature.sides))
    events = (*signature.events, *(event.image(equations.images) for event in signature.events))
    other = equations.with_signature(replace(signature, sides=sides, events=events, symmetric=False))
    return other, equations.repeated(unknowns) if sides or events else unknowns


def full_point(point: OrbitPoint) -> OrbitPoint:
    """A point with a symmetric orbit, on the curve of the equations over its full period."""
    n = point.orbit.equations.size
    other, unknowns = over_full_period(point.orbit.equations, point.place[:n])
    _, ahead = over_full_period(point.orbit.equations, point.place[:n] + point.tangent[:n])
    curve = point.curve.with_equations(other)
    found = curve.known(unknowns, point.parameters)
    assert found is not None, "a symmetric orbit can be followed over its full period"
    tangent = np.append(ahead - unknowns, point.tangent[n:])
    there: OrbitPoint = curve.point_at(found, tangent / curve.norm(tangent))
    return there


def half_point(point: OrbitPoint) -> OrbitPoint:
    """A point on the curve of the equations over half its period, if its orbit and the system are symmetric; else the point."""
    orbit = half(point.orbit) if point.curve.symmetric else None
    if orbit is None:
        return point
    curve, solution = point.curve.with_equations(orbit.equations), orbit.solution
    found = Corrected(np.append(solution.unknowns, solution.values), solution.evaluation, point.iterations)
    tangent = np.append(point.tangent[: orbit.equations.size], point.tangent[point.orbit.equations.size :])
    there: OrbitPoint = curve.point_at(found, tangent / curve.norm(tangent))
    return there


def full_period(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """A symmetric orbit as a solution of the equations over its full period."""
    # Newton's method is not used: where the symmetry breaks these equations are singular.
    found = PeriodicOrbit.known(*over_full_period(orbit.equations, orbit.solution.unknowns), orbit.solution.values)
    assert found is not None, "a symmetric orbit can be followed over its full period"
    return found
