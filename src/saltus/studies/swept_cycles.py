"""Sweeps of a system on which nothing acts that varies with time: on which cycle, of which period, it
is left at each value.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from saltus.flow import Ending, Recurrence, end_of
from saltus.orbits import SettledKind, Settlement, settled_on
from saltus.systems import System

ENDINGS = {
    SettledKind.CYCLE: Ending.PERIODIC,
    # as `classify` has it: of any period, so that it has none here
    SettledKind.EQUILIBRIUM: Ending.PERIODIC,
    SettledKind.REST: Ending.REST,
    SettledKind.ENDED: Ending.ENDED,
    SettledKind.UNKNOWN: Ending.UNDECIDED,
}
EQUILIBRIUM = "equilibrium"  # the outcome of what is periodic and has no period


def recurrence_without_load(
    system: System,
    states: np.ndarray,
    periods: float,
    parameters: Mapping[str, np.ndarray] | None,
    tol: float,
) -> Recurrence:
    """What becomes of motions from states (n, d), each with parameters of its own, as of motions
    under a load.

    The period is a time, the last state lies anywhere on the cycle, and extrema and impacts are
    those of one period; of what is on no cycle those of some natural periods.

    Parameters
    ----------
    system
        What moves.
    states
        Where the motions begin, (n, d).
    periods
        The natural periods for which each is followed at most.
    parameters
        Numbers by dotted path, (n,) each, in place of the system's.
    tol
        The error that one step may make.
    """
    found = list[Settlement]()
    for i, state in enumerate(states):
        numbers = {path: float(values[i]) for path, values in (parameters or {}).items()}
        one = system.with_(numbers) if numbers else system
        found.append(settled_on(one, state, periods, tol))
    last = states.copy()
    extrema = np.full((len(states), 1, 2), np.nan)
    impacts = np.zeros((len(states), 1))
    for i, each in enumerate(found):
        if each.motion is None:
            continue
        last[i] = end_of(each.motion)
        extrema[i, 0] = each.motion.extrema.max(), each.motion.extrema.min()
        impacts[i, 0] = len(each.motion.impacts)
    return Recurrence(
        outcome=np.array([ENDINGS[each.kind] for each in found], dtype=np.int8),
        period=np.array([each.period for each in found]),
        periods=np.array([each.followed for each in found]),
        last=last,
        states=last[:, None],
        extrema=extrema,
        impact_counts=impacts,
    )
