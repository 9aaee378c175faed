"""Finding cycles of systems on which nothing acts that varies with time: a motion is followed until
it comes back to where it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from saltus.errors import MotionError
from saltus.flow import Motion, Stop, simulate
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.contract.event_sequence import relays_at, remembered_at, section_time
from saltus.orbits.equations.cycles import direction_at, passages, states_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES
from saltus.progress import Progress
from saltus.systems import System, arguments_of, natural_units


@dataclass(frozen=True)
class FindCycleSettings:
    """How long a motion is followed until it settles on a cycle, and which return is its period.

    Times are in natural periods, 2 pi natural times.
    """

    # How long a motion is followed in the first round to settle; each further round doubles it.
    settling: float = 50.0
    rounds: int = 6
    # How long a return is looked for first; this is doubled up to `longest`.
    window: float = 4.0
    longest: float = 4096.0
    # A settled motion comes back nearer to where it was than this share of its size.
    returned: float = 1e-6
    # Of a motion that has not settled, the first return counts that is no farther than the nearest
    # one by this factor.
    as_near: float = 3.0
    # A motion smaller than this, in natural units, stands still.
    still: float = 1e-6
    # One that swings in its second half by this share of its whole swing is no decaying one.
    kept: float = 0.99
    # Impacts that change speeds by less, in natural units, are touches: a motion settles on a swing that
    # touches as the root of the distance.
    touching: float = 1e-5


SETTINGS = FindCycleSettings()
SHRUNK = 1e-2  # A solution smaller than this share of the motion is none of its cycles.
SAMPLES = 4001  # of the second half of a small motion
NO_RETURN = 1e9  # the distance, in natural units, of a state with relays on other sides
SHORTEST = 1e-6  # of a round, as a share of the time of several rounds


class Return(NamedTuple):
    """A state to which a motion comes back."""

    state: np.ndarray
    time: float  # how long it is away
    apart: float  # how far it is away then, as a share of the motion's size
    size: float  # the motion's, in natural units
    remembered: dict[str, Any]  # the argument `relays` of `simulate` there, if it has some


def natural_period(system: System) -> float:
    """2 pi natural times."""
    return 2.0 * math.pi * natural_units(system).time


def settled_return(
    base: OrbitEquations, state: dict[str, Any], period: float | None, progress: Progress
) -> Return:
    """Where a motion from a state comes back to itself once it has settled.

    Raises
    ------
    MotionError
        It comes to rest or to an equilibrium, ends, or does not settle.
    """
    unit = natural_period(base.system)
    passed = 0.0
    nearest = None
    total = SETTINGS.settling * (2**SETTINGS.rounds - 1)
    for attempt in range(SETTINGS.rounds):
        progress(passed / total, "following the motion until it settles")
        wait = SETTINGS.settling * 2**attempt
        state = after(base.system, state, wait * unit)
        passed += wait
        nearest = next_return(base, state, period)
        if nearest is not None and nearest.apart < SETTINGS.returned:
            return nearest
    if nearest is None:
        raise MotionError(
            f"the motion does not come back to where it was within {SETTINGS.longest:g} natural"
            " periods: it is on no cycle"
        )
    raise MotionError(
        f"the motion has not settled on a cycle after {passed * unit:.6g}: it is chaotic or settles"
        " slowly; try another start, or settle=0 with period=... for a cycle near the start"
    )


def next_return(base: OrbitEquations, state: dict[str, Any], period: float | None) -> Return | None:
    """Where a motion from a state comes back to where it was: after about `period` or, if that is
    not given, for the first time; None if it does not.

    Raises
    ------
    MotionError
        It comes to rest or to an equilibrium, or ends.
    """
    unit = natural_period(base.system)
    duration = SETTINGS.window * unit if period is None else 2.5 * period
    while True:
        motion = simulate(base.system, **state, duration=duration)
        check_moving(motion, state)
        found = _returned(base, motion, period)
        if found is not None:
            return found
        duration *= 2.0
        if not duration <= SETTINGS.longest * unit:
            return None


def _returned(base: OrbitEquations, motion: Motion, period: float | None) -> Return | None:
    """The return of a motion, None if it has none."""
    units = base.natural.state
    size = swing_of(base, motion)
    begin = section_time(motion, 0.5 * (motion.time - motion.start))
    there = states_of(motion, np.array([begin]))[0]
    normal = direction_at(motion, begin, base)
    times = passages(motion, there, normal)
    times = times[times > begin + 1e-9 * (motion.time - motion.start)]
    if not times.size:
        return None
    apart = np.abs((states_of(motion, times) - there) / units)
    apart[:, base.following] = 0.0
    distance = apart.max(axis=1)
    sides = relays_at(motion, np.append(times, begin))
    distance[(sides[:-1] != sides[-1]).any(axis=1)] = NO_RETURN
    if period is not None:
        chosen = int(np.argmin(np.abs(times - begin - period)))
    else:
        near = max(SETTINGS.as_near * float(distance.min()), SETTINGS.returned * size)
        chosen = int(np.argmax(distance <= near))
    away = float(times[chosen] - begin)
    share = float(distance[chosen]) / size
    return Return(there, away, share, size, remembered_at(motion, begin))


def swing_of(base: OrbitEquations, motion: Motion) -> float:
    """The largest way of a coordinate, from its least to its largest value, in natural units.

    Raises
    ------
    MotionError
        The motion stands still.
    """
    size = size_of(base, motion)
    if not size > SETTINGS.still and not _keeps_swinging(base, motion, size):
        raise MotionError(
            "the motion comes to an equilibrium, which is no cycle; start farther from it"
        )
    return size


def size_of(base: OrbitEquations, motion: Motion) -> float:
    """The largest way of a coordinate, from its least to its largest value, in natural units."""
    return float((np.ptp(motion.extrema, axis=1) / base.natural.lengths).max())


def _keeps_swinging(base: OrbitEquations, motion: Motion, size: float) -> bool:
    """Whether a motion that is small in natural units, as beside walls that are far away, swings as
    far in its second half as in all of it, and farther than rounding.
    """
    places = np.linspace(0.5 * (motion.start + motion.time), motion.time, SAMPLES)
    position = np.atleast_2d(motion.at(places)[0])
    later = float((np.ptp(position, axis=1) / base.natural.lengths).max())
    rounding = float((np.abs(position).max(axis=1) / base.natural.lengths).max())
    return later > SETTINGS.kept * size and later > SETTINGS.returned * rounding


def check_is_cycle(base: OrbitEquations, orbit: PeriodicOrbit, back: Return) -> None:
    """Refuse a solution that is an equilibrium, and a cycle that only touches a contact: motions
    without impacts lie beside it, and it is solved to the root of rounding only.
    """
    # without loss an equilibrium solves the equations, too
    if not size_of(base, orbit.followed) > SHRUNK * back.size:
        raise MotionError(
            f"the motion comes back after {back.time:.9g}, but Newton's method finds an equilibrium"
            " near it alone: it settles slowly, or swings beside it are cycles, too; let it settle"
            " for longer (settle=...), or try another start"
        )
    impacts = orbit.followed.impacts
    jumps = np.abs(impacts.velocity_after - impacts.velocity_before)
    largest = float(jumps.max(initial=0.0))
    if 0.0 < largest < SETTINGS.touching * natural_units(orbit.system).speed:
        raise MotionError(
            f"the motion settles on a swing of the period {orbit.period:.9g} that only touches a"
            f" contact, which changes its speed by {largest:.1g}, and beside which others have no"
            " impact: whether it is stable, and alone, is undecided"
        )


def round_within(orbit: PeriodicOrbit) -> float | None:
    """The time of a shorter round that a cycle, solved as one, repeats; None if it repeats none."""
    equations: Any = orbit.equations
    motion = orbit.followed
    state = orbit.solution.unknowns[:-1]
    normal = np.split(np.array(orbit.signature.through), 2)[1]
    times = passages(motion, state, normal)
    # that of the start itself may lie on either side of both ends
    inside = (times > motion.start + SHORTEST * orbit.period) & (
        times < motion.time - SHORTEST * orbit.period
    )
    times = times[inside]
    if not times.size:
        return None
    apart = np.abs((states_of(motion, times) - state) / equations.natural.state)
    apart[:, equations.following] = 0.0
    back = apart.max(axis=1) < TOLERANCES.halves
    back &= (relays_at(motion, times) == orbit.signature.relays).all(axis=1)
    near = np.flatnonzero(back)
    return float(times[near[0]] - motion.start) if near.size else None


def after(
    system: System, state: dict[str, Any], duration: float, side: int | None = None
) -> dict[str, Any]:
    """The state of a motion later.

    Raises
    ------
    MotionError
        It comes to rest, or ends.
    """
    if duration == 0.0:
        return state
    motion = simulate(system, **state, side=side, duration=duration, dense=False)
    check_moving(motion, state)
    return arguments_of(system, motion.final_state) | remembered_at(motion)


def check_moving(motion: Motion, state: dict[str, Any]) -> None:
    """Refuse a motion that rests for good, that has lost its phase, or that ends at a margin."""
    start = ", ".join(f"{name}={value!r}" for name, value in state.items())
    if motion.limit is not None:
        raise MotionError(
            f"the motion from {start} ends at time {motion.time:.6g}, where its margin"
            f" {motion.limit} reaches 0: there is no cycle"
        )
    if motion.stop is Stop.REST:
        raise MotionError(
            f"the motion from {start} comes to rest for good, which is no cycle; start farther from"
            " rest"
        )
    if not motion.phase_known:
        raise MotionError(
            f"the impacts of the motion from {start} lose no energy and become too small to be"
            " followed, so that its phase is lost; start with more energy"
        )
