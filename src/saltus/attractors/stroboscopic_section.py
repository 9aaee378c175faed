"""The stroboscopic section of a system: its states at phase 0 of the load."""

from __future__ import annotations

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import motions_from, stroboscopic
from saltus.systems import Load, System, check_system


def with_clock(system: System) -> System:
    """The system with a forcing period, which fixes the stroboscopic section: its load's, or 2 pi under a constant load.

    Equilibria are then orbits of period 1.

    Raises
    ------
    ParameterError
        Something that is no system, or a load of records or pulses, which never repeats.
    """
    check_system(system, "the search of attractors", several_contacts=True)
    check_periodic(system)
    if system.load.frequency is not None:
        return system
    return System(model=system.model, load=Load(frequency=1.0, **system.load.channels), impact=system.impact)


def check_periodic(system: System) -> None:
    """Refuse loads by records of samples and by pulses, under which motions have no long-term behaviour.

    Raises
    ------
    ParameterError
        The load does not repeat; the error names the channel.
    """
    for name, signal in system.load.channels.items():
        if signal.once:
            kind = next(type(term).__name__ for term in getattr(signal, "terms", (signal,)) if term.once)
            raise ParameterError(
                f"load.{name} is a {kind}, which does not repeat, so nothing settles under it; use Harmonic", f"load.{name}"
            )


def is_constant(load: Load) -> bool:
    """Whether no channel varies: the section is then the phase plane, and orbits of period 1 are equilibria."""
    return not any(signal.periodic for signal in load.channels.values())


def section_states(system: System, states: np.ndarray, periods: float, tol: float = 1e-13) -> np.ndarray:
    """The states after 1, 2, ... forcing periods from states (n, d) at phase 0, (n, periods, d); or after half a period."""
    return stroboscopic(system, motions_from(system, states, periods=periods, last="all", tol=tol))
