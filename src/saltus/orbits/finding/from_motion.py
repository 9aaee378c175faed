"""Finding a periodic orbit from a state: the motion settles, its signature is read, and the equations are solved."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import check_count, check_names
from saltus.errors import MotionError
from saltus.flow import (
    RECURRENCE,
    Motion,
    load_releases,
    nearest_return,
    return_distances,
    return_period,
    simulate,
)
from saltus.orbits.branches.images import divide, half
from saltus.orbits.equations.contract import MotionToRead, OrbitEquations
from saltus.orbits.equations.kinds import KINDS, equations_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.symmetry import is_symmetric, keeps_symmetry
from saltus.public_functions import Numbers
from saltus.systems import System, arguments_of, check_path, check_system, read_start, state_of


@dataclass(frozen=True)
class FindOrbitSettings:
    """How long a motion is followed until it settles, and how its orbit is solved for."""

    max_period: int = 12  # The longest period that is looked for if no limit is given, in forcing periods.
    # Number of forcing periods for which a motion is followed in the first round to settle; each further round doubles it.
    settling: int = 160
    rounds: int = 5  # Number of such rounds.
    iterations: int = 25  # The largest number of Newton's iterations from a motion to its orbit.


SETTINGS = FindOrbitSettings()


def find_orbit(
    system: System,
    *,
    velocity: Numbers = 0.0,
    period: int | None = None,
    settle: int | None = None,
    max_period: int = SETTINGS.max_period,
    parameters: tuple[str, ...] = (),
    **coordinates: float,
) -> PeriodicOrbit:
    """The periodic orbit on which a motion settles, or, with settle=0, the one that lies near it, stable or not.

    Where impacts have a loss and the load pulls the system off its contact in every period, the orbit may rest in between.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    velocity, coordinates
        The state at phase 0, by the model's names: theta=0.3.
    period
        The period of the orbit in forcing periods; by default the shortest one, up to `max_period`, after which the motion
        returns.
    settle
        How many forcing periods the motion is followed first; by default until it has settled, up to 4960.
    max_period
        The longest period that is looked for.
    parameters
        Dotted paths along which the orbit will be continued; not needed for `continue_orbit`, which adds its own.

    Raises
    ------
    ParameterError
        An argument has no meaning.
    MotionError
        The motion comes to rest for good, does not settle, or Newton's method does not converge; the message says what to do.

    Examples
    --------
    >>> saltus.find_orbit(system, theta=0.3).signature.impact_count
    2
    """
    counts = {"period": period, "max_period": max_period, "settle": settle}
    _check(system, parameters, counts)
    state = arguments_of(system, read_start(system, velocity, coordinates, ("parameters", *counts)))
    base = equations_of(system, Signature((), 1), tuple(parameters))  # refuses systems that have no orbits
    if settle is not None:
        state = _after(system, state, settle)
        return _polish(base, state, _period_of(system, state, period, max_period), None)
    passed = 0
    for attempt in range(SETTINGS.rounds):
        state = _after(system, state, wait := SETTINGS.settling * 2**attempt)
        passed += wait
        q = _returning(system, state, period, max_period)
        if q is not None:
            return _polish(base, state, q, passed)
    raise MotionError(
        f"the motion has not settled on a periodic orbit of up to {period or max_period} forcing periods after {passed}: it is "
        "chaotic, slow to settle or longer; try another start, max_period=..., or settle=0 with period=... for an unstable orbit "
        "near the start"
    )


def _check(system: System, parameters: Iterable[str], counts: dict[str, int | None]) -> None:
    """Refuse arguments without meaning."""
    check_system(system, "find_orbit", several_contacts=True)
    for name, count in counts.items():
        if count is not None or name == "max_period":
            check_count(name, count, 0 if name == "settle" else 1)
    for path in check_names("parameters", parameters, "parameters, such as ('load.frequency',)"):
        check_path(system, path, "parameters")


def _after(system: System, state: dict[str, Any], periods: int) -> dict[str, Any]:
    """The state `periods` forcing periods later."""
    motion = simulate(system, **state, periods=periods, dense=False)
    _refuse_rest(system, motion, state)
    return arguments_of(system, motion.final_state)


def _refuse_rest(system: System, motion: Motion, state: dict[str, Any]) -> None:
    """Refuse a motion that stays at the contact for good, that has lost its phase there, or that ends at a margin."""
    if motion.limit is not None:
        raise MotionError(f"the motion ends at time {motion.time:.6g}, where its margin {motion.limit} reaches 0: no orbit there")
    if motion.side != 0 and motion.phase_known:
        return
    start = ", ".join(f"{name}={value!r}" for name, value in state.items())
    farther = "start farther from it, for instance with a larger coordinate or velocity"
    released = bool(load_releases(system))
    if not motion.phase_known and not released:
        raise MotionError(
            f"the motion from {start} settles on the undeformed state, which is no orbit to follow: its impacts lose nothing "
            f"and get ever smaller without end; {farther}"
        )
    if not motion.phase_known:
        raise MotionError(
            f"the impacts of the motion from {start} lose nothing and become too small to be followed before the load pulls "
            "again, so its phase is lost and no orbit can be read from it; give the impacts a loss (an e below 1), so that it "
            "rests until the load pulls, which is an orbit, or take a higher frequency"
        )
    if not released:
        raise MotionError(
            f"the motion from {start} comes to rest at contact for good, as the load never pulls it off: it settles on the "
            f"undeformed state, which is no orbit to follow; {farther}"
        )


def _stroboscopic_states(system: System, state: dict[str, Any], count: int) -> np.ndarray:
    """The states after 0, 1, ..., count forcing periods."""
    states = [state_of(system, state)]
    for _ in range(count):
        state = _after(system, state, 1)
        states.append(state_of(system, state))
    return np.array(states)


def _returning(system: System, state: dict[str, Any], period: int | None, max_period: int) -> int | None:
    """The fewest forcing periods after which a settled motion returns, or None."""
    states = _stroboscopic_states(system, state, period or max_period)[::-1]
    if period is None:
        return int(return_period(states, max_period)) or None
    return period if return_distances(states, period)[-1] < RECURRENCE.near_return else None


def _period_of(system: System, state: dict[str, Any], period: int | None, max_period: int) -> int:
    """The number of forcing periods after which a motion comes nearest to where it was, if it is not given."""
    if period is not None:
        return period
    return nearest_return(_stroboscopic_states(system, state, max_period)[::-1], max_period)


def _polish(base: OrbitEquations, state: dict[str, Any], periods: int, passed: int | None) -> PeriodicOrbit:
    """Solve for the orbit near a motion over one of its periods."""
    orbit = orbit_from(base, state, periods)
    if orbit is not None and orbit.admissible:
        return orbit
    when = "from the start" if passed is None else f"after {passed} forcing periods"
    raise MotionError(
        f"Newton's method finds no orbit of period {periods} near the motion {when}; "
        "try another start, another period=..., or let it settle first (settle=...)"
    )


def orbit_from(base: OrbitEquations, state: dict[str, Any], periods: int) -> PeriodicOrbit | None:
    """The orbit near a motion over `periods` forcing periods from a state at phase 0; it may be one that rests for a part of
    them.

    Raises
    ------
    MotionError
        The motion leads to no orbit.
    """
    return orbit_near(base, state, periods)


def orbit_near(base: OrbitEquations, state: dict[str, Any], periods: int) -> PeriodicOrbit | None:
    """The orbit with the signature of a motion over `periods` forcing periods from a state at phase 0, by Newton's method: the
    first that is admissible of those of all kinds of equations."""
    motion, orbit = MotionToRead(base.system, state, periods), None
    for kind in KINDS:
        read = kind.read(base, motion)
        found = None if read is None else PeriodicOrbit.near(*read, base.values, iterations=SETTINGS.iterations)
        if found is not None:
            orbit = simplest(found)
        if orbit is not None and orbit.admissible:
            break
    return orbit


def simplest(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """An orbit as a solution over its least period or, where it is its own mirror image, over half of that."""
    orbit = divide(orbit) or orbit
    return (half(orbit) if _is_symmetric(orbit.equations) else None) or orbit


def _is_symmetric(equations: OrbitEquations) -> bool:
    """Whether a system has the mirror symmetry, for all parameters at the equations' paths."""
    paths = equations.paths
    return keeps_symmetry(equations.system, paths[0]) if paths else is_symmetric(equations.system)
