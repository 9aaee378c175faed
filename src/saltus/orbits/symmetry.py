"""The mirror symmetry of a forced system, and orbits that are their own mirror images half a period later."""

from __future__ import annotations

import numpy as np

from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem
from saltus.orbits.signature import Signature
from saltus.orbits.tolerances import TOLERANCES
from saltus.systems import Load, System

SAMPLES = np.linspace(0.05, 0.95, 19)  # shares of a period at which loads are compared; a harmonic of order 9 needs 19


def is_symmetric(system: System) -> bool:
    """Whether -theta(t + T/2) moves as theta(t) does: a mirrored load that is the load half a period later (errata 18)."""
    mirrored = system.mirrored()
    period = system.load.period
    if mirrored is None or period is None:
        return False
    times = SAMPLES * period
    return all(_equal(system.load, mirrored.load, name, times, 0.5 * period) for name in system.load.channels)


def _equal(load: Load, mirrored: Load, name: str, times: np.ndarray, shift: float) -> bool:
    """Whether a channel of the mirrored load at `times` is that of the load `shift` later; grounds by their accelerations."""
    one, other = getattr(mirrored, name), getattr(load, name)
    if name.startswith("ground_"):
        left, right = one.acceleration(times), other.acceleration(times + shift)
    else:
        left, right = one(times), other(times + shift)
    return bool(np.allclose(left, right, rtol=TOLERANCES.load, atol=TOLERANCES.load))


def keeps_symmetry(system: System, path: str) -> bool:
    """Whether a system is symmetric and stays so as the parameter at `path` changes."""
    if not is_symmetric(system):
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
