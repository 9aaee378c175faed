"""The mirror symmetry of a forced system, and orbits that are their own mirror images half a period later."""

from __future__ import annotations

import cmath

import numpy as np

from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature
from saltus.orbits.tolerances import TOLERANCES
from saltus.public_functions import answered
from saltus.systems import Constant, Harmonic, Load, Signal, System, check_system


@answered
def is_symmetric(system: System) -> bool:
    """Whether -theta(t + T/2) moves as theta(t) does: a mirrored load that is the load half a period later (errata 18).

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
    """Whether a channel of a load is that of the other one half a period later; of the ground only its acceleration matters."""
    first, second = _harmonics(one.channels[name]), _harmonics(other.channels[name])
    if first is None or second is None:
        return False
    orders = {*first, *second} - ({0} if name.startswith("ground_") else set())
    pairs = [(first.get(n, 0.0), (-1) ** n * second.get(n, 0.0)) for n in orders]
    return all(abs(a - b) <= TOLERANCES.load * (1.0 + abs(b)) for a, b in pairs)


def _harmonics(signal: Signal) -> dict[int, complex] | None:
    """The complex amplitudes of a signal, by the order of the harmonic; None of one that has none."""
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
    if system.model.held or not is_symmetric(system):
        return False
    value = float(system.get(path))
    return any(is_symmetric(system.with_({path: value * (1 + s) + s})) for s in (1e-3, -1e-3))


def half(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """An orbit that is its own mirror image, as a solution of the equations of half its period; None where it is not."""
    problem, signature, unknowns = orbit.problem, orbit.signature, orbit.solution.unknowns
    n, odd = divmod(len(signature.sides), 2)
    if signature.symmetric or signature.period % 2 == 0 or odd:
        return None
    if n:
        first, second = unknowns.reshape(2, n, 2)
        if n % 2 == 0 or np.abs(second - first - [np.pi * signature.period, 0.0]).max() > TOLERANCES.halves:
            return None
    elif problem.system.model.sides and not problem.passes_contact:
        return None
    short = problem.with_signature(Signature(signature.sides[:n], signature.period, True, signature.side))
    found = PeriodicOrbit.near(short, unknowns[: short.size], orbit.solution.values)
    moved = found is not None and not n and np.abs(found.solution.unknowns - unknowns).max() >= TOLERANCES.halves
    return None if moved else found


def over_full_period(problem: Problem, unknowns: np.ndarray) -> tuple[Problem, np.ndarray]:
    """The problem of the full period of a symmetric orbit, and the orbit's unknowns in it."""
    signature = problem.signature
    sides = (*signature.sides, *(-s for s in signature.sides))
    other = problem.with_signature(Signature(sides, signature.period, False, signature.side))
    return other, problem.repeated(unknowns) if sides else unknowns


def full_period(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """A symmetric orbit as a solution of the equations of its full period."""
    found = PeriodicOrbit.near(*over_full_period(orbit.problem, orbit.solution.unknowns), orbit.solution.values)
    assert found is not None, "a symmetric orbit solves the equations of its full period"
    return found
