"""The mirror symmetry of a forced system: the mirror image of every motion, half a forcing period later, is a motion too."""

from __future__ import annotations

import cmath

from saltus.errors import ParameterError
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
    orders = {*first, *second} - ({0} if name.startswith("ground") else set())
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
