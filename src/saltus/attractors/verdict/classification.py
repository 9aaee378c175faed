"""Classification: where one motion ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.attractors.stroboscopic_section import with_clock
from saltus.attractors.verdict.nonsettling import SETTINGS, unsettled
from saltus.attractors.verdict.verdict import Verdict, VerdictRequest, settled
from saltus.checks import check_count, check_number
from saltus.errors import ParameterError
from saltus.flow import RECURRENCE
from saltus.progress import Progress, silent
from saltus.public_functions import Numbers
from saltus.systems import System


def classify(
    system: System,
    *,
    velocity: Numbers = 0.0,
    periods: int = 4000,
    transient: int = 500,
    max_period: int = RECURRENCE.compiled_max_period,
    seed: int = 0,
    tol: float = 1e-12,
    progress: Progress = silent,
    **coordinates: float,
) -> Verdict:
    """Where a motion ends: at rest, on a periodic orbit, on a torus, in chaos, or undecided, each with its evidence.

    * `rest`: proved to stay at the contact for all later loads (`capture_speed`), or at rest there where the load never pulls.
    * `periodic`: it repeats itself, and is on an orbit that solves its own equations, has all multipliers inside the unit circle
      and repeats itself in direct simulation. Under constant loads an equilibrium is such an orbit, of period 1.
    * `chaotic`: it has not settled after transient + periods. The largest Lyapunov exponent is above 0 by more than its error and
      the growth of regular motions, in both halves of a run and of a second one, twice as long, that continues the first. None of
      128 motions from states beside the last one settles within `periods`, or 2000 forcing periods if that is more: a chaotic
      transient would be noticed with a probability of 95 % if its mean life is less than 43 times as long. The 0-1 test, a
      second opinion, does not show a regular motion.
    * `quasi-periodic`: the exponents are 0 within their error and resolution, the 0-1 test shows a regular motion, and
      `excludes_tori` knows no reason against it.
    * `undecided`: everything else, with the reason.

    Parameters
    ----------
    system
        What moves, under constant or harmonic loads.
    velocity, coordinates
        The state at the start, at phase 0.
    periods
        Forcing periods in which it may settle, after the transient, and as many again for the exponents; at least 96.
    transient
        Forcing periods at the beginning.
    max_period
        The longest period looked for, at least 16.
    seed
        The seed of the companions' states and of the frequencies of the 0-1 test.
    tol
        The error that one step may make.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        An argument without meaning.

    Examples
    --------
    >>> str(saltus.classify(system, theta=0.3).kind)
    'periodic'
    """
    clock, start = with_clock(system), _start(system, velocity, coordinates)
    check_count("periods", periods, SETTINGS.thirds * 2 * LYAPUNOV.batches)
    check_count("transient", transient, 0)
    check_count("max_period", max_period, RECURRENCE.compiled_max_period)
    check_count("seed", seed, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    case = VerdictRequest(system, clock, int(periods), int(max_period), int(seed), float(tol), progress)
    ends = case.follow(start, int(transient + periods), max(SETTINGS.states, 4 * int(max_period)), (0.0, 0.1))
    verdict = settled(case, ends, start[0]) or unsettled(case, ends)
    progress(1.0, "verdict")
    return verdict


def _start(system: System, velocity: Any, coordinates: dict[str, float]) -> np.ndarray:
    """The state at the start as a row.

    Raises
    ------
    ParameterError
        Names of other coordinates, or values that are no numbers.
    """
    names = system.model.coordinates
    if set(coordinates) != set(names):
        wanted, given = ", ".join(f"{name}=..." for name in names), ", ".join(coordinates) or "no coordinate"
        raise ParameterError(f"the state at the start is {wanted} and velocity=..., got {given}", "coordinates")
    velocities = [velocity] * len(names) if np.ndim(velocity) == 0 else list(velocity)
    if len(velocities) != len(names):
        raise ParameterError(f"velocity must have {len(names)} value(s), got {velocity!r}", "velocity")
    for name in names:
        check_number(name, coordinates[name])
    for value in velocities:
        check_number("velocity", value)
    return np.array([[*(coordinates[name] for name in names), *velocities]], dtype=float)
