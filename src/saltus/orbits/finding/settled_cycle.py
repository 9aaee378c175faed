"""What a motion settles on where nothing acts that varies with time: a cycle, an equilibrium, or
rest."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from saltus.errors import MotionError
from saltus.flow import Motion, Stop, end_of, sensitivities, simulate
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.finding.cycles import (
    SETTINGS,
    natural_period,
    next_return,
    swing_of,
)
from saltus.orbits.finding.from_motion import cycle_from
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.systems import System, arguments_of

# A disturbance of an equilibrium that grows by more than this in a natural period, relatively.
REPELS = 1e-9
KICK = 1e-4  # how far from an equilibrium that repels a motion goes on, in natural units


class SettledKind(Enum):
    """What a motion has settled on."""

    CYCLE = auto()
    EQUILIBRIUM = auto()
    REST = auto()
    ENDED = auto()  # a margin of the model has ended it, or it cannot go on
    UNKNOWN = auto()  # it is chaotic, settles slowly, or is on a cycle that does not attract


@dataclass(frozen=True, eq=False)
class Settlement:
    """What a motion has settled on."""

    kind: SettledKind
    period: float  # of the cycle, 0 without one
    followed: float  # natural periods for which the motion was followed
    # from its last state: over the period of the cycle, else over some natural periods; None of one
    # that has ended
    motion: Motion | None


def settled_on(system: System, state: np.ndarray, longest: float, tol: float) -> Settlement:
    """What a motion from a state (d,) settles on within so many natural periods.

    A cycle is solved by its own equations, and is one only if its multipliers lie inside the unit
    circle.

    Parameters
    ----------
    system
        What moves, under a load without a frequency, on which nothing acts that varies.
    state
        The coordinates and velocities at the start, (d,).
    longest
        The natural periods, 2 pi natural times each, for which it is followed at most.
    tol
        The error that one step may make.
    """
    base = equations_of(system, Signature((), 1))
    unit = natural_period(system)
    wait = SETTINGS.settling
    passed = 0.0
    motion: Motion | None = None
    while passed < longest:
        wait = min(wait, longest - passed)
        try:
            before = simulate(
                system, **arguments_of(system, state), duration=wait * unit, dense=False, tol=tol
            )
            if before.limit is not None:
                return Settlement(SettledKind.ENDED, 0.0, passed, None)
            state = end_of(before)
            motion = simulate(
                system, **arguments_of(system, state), duration=SETTINGS.window * unit, tol=tol
            )
        except MotionError:
            return Settlement(SettledKind.ENDED, 0.0, passed, None)
        passed += wait
        if before.stop is Stop.REST and motion.stop is Stop.REST and not len(motion.events):
            return Settlement(SettledKind.REST, 0.0, passed, motion)
        if not before.phase_known or motion.limit is not None:
            break
        if _stands(base, motion):
            away = _way_off(base, state, unit)
            if away is None:
                return Settlement(SettledKind.EQUILIBRIUM, 0.0, passed, motion)
            state = state + np.append(away, np.zeros(len(state) - len(away)))
            wait *= 2.0
            continue
        orbit = _cycle_from(base, state)
        if orbit is not None:
            found = orbit.motion(tol=tol)
            return Settlement(SettledKind.CYCLE, float(orbit.period), passed, found)
        wait *= 2.0
    return Settlement(SettledKind.UNKNOWN, 0.0, passed, motion)


def _stands(base: OrbitEquations, motion: Motion) -> bool:
    """Whether a motion is at an equilibrium."""
    try:
        swing_of(base, motion)
    except MotionError:
        return True
    return False


def _way_off(base: OrbitEquations, state: np.ndarray, unit: float) -> np.ndarray | None:
    """A small step (d,) along which an equilibrium at a state repels, as a motion that is begun there
    would stay for good; None if it attracts.
    """
    try:
        over = sensitivities(base.system, **arguments_of(base.system, state), duration=unit).state
    except MotionError:
        return None
    if not np.isfinite(over).all():
        return None
    values, ways = np.linalg.eig(over)
    largest = int(np.argmax(np.abs(values)))
    if not abs(values[largest]) > 1.0 + REPELS:
        return None
    way = np.real(ways[:, largest])
    return np.asarray(KICK * way / np.abs(way / base.natural.state).max())


def _cycle_from(base: OrbitEquations, state: np.ndarray) -> PeriodicOrbit | None:
    """The attracting cycle on which a motion from a state (d,) is; None if it has not settled."""
    try:
        back = next_return(base, arguments_of(base.system, state), None)
        if back is None or not back.apart < SETTINGS.returned:
            return None
        orbit = cycle_from(base, back)
    except MotionError:
        return None
    return orbit if orbit is not None and orbit.stable else None
