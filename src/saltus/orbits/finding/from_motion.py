"""Finding periodic orbits from motions: one that settles, whose signature is read, and states that
nearly return.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import Speeds, check_count, check_names, check_number
from saltus.errors import MotionError
from saltus.flow import (
    RECURRENCE,
    Motion,
    Stop,
    last_states,
    load_releases,
    motions_from,
    nearest_return,
    return_distances,
    return_period,
    sensitivities,
    simulate,
)
from saltus.orbits.beyond.symmetry import divide, half, has_symmetry, keeps_symmetry
from saltus.orbits.contract.equations import MotionToRead, OrbitEquations
from saltus.orbits.contract.event_sequence import STAYS, remembered_at
from saltus.orbits.equations.kinds import equations_of, kinds_of
from saltus.orbits.finding.cycles import (
    Return,
    after,
    check_is_cycle,
    next_return,
    round_within,
    settled_return,
)
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.verify import same_orbit
from saltus.progress import Progress, silent
from saltus.systems import (
    System,
    arguments_of,
    check_path,
    check_system,
    held_by_contacts,
    natural_units,
    on_this_side,
    read_start,
    state_with_sides,
    states_beside,
    units_with_sides,
)


@dataclass(frozen=True)
class FindOrbitSettings:
    """How long a motion is followed until it settles, and how its orbit is solved for."""

    # The longest period that is looked for if no limit is given, in forcing periods.
    max_period: int = 12
    # Number of forcing periods for which a motion is followed in the first round to settle; each
    # further round doubles it.
    settling: int = 160
    rounds: int = 5  # Number of such rounds.
    iterations: int = 25  # The largest number of Newton's iterations from a motion to its orbit.


SETTINGS = FindOrbitSettings()


def find_orbit(
    system: System,
    *,
    velocity: Speeds = 0.0,
    period: float | None = None,
    settle: float | None = None,
    max_period: int = SETTINGS.max_period,
    parameters: tuple[str, ...] = (),
    time: float = 0.0,
    side: int | None = None,
    relays: Mapping[str, bool] | None = None,
    progress: Progress = silent,
    **coordinates: float,
) -> PeriodicOrbit:
    """The periodic orbit on which a motion settles, or, with settle=0, the one that lies near it,
    stable or not.

    Under a load without a frequency, on which nothing acts that varies with time, it is a cycle,
    whose period is an unknown: `orbit.period` is then a time. The motion is followed until it comes
    back to where it was. `period` may give a guess of this time, and `settle` is a time as well.

    Where impacts have a loss and the load pulls the system off its contact in every period, the
    orbit may rest in between.

    Parameters
    ----------
    system
        What moves, under a load with a frequency or a constant one.
    velocity, coordinates
        The state at `time`, by the model's names: theta=0.3.
    period
        The period of the orbit in forcing periods, of a cycle a guess of its time; by default the
        shortest one, up to `max_period`, after which the motion returns.
    settle
        How many forcing periods, or for what time, the motion is followed first; by default until
        it has settled, up to 4960 forcing periods.
    max_period
        The longest period that is looked for, in forcing periods; without meaning for cycles.
    parameters
        Dotted paths along which the orbit will be continued; not needed for `continue_orbit`, which
        adds its own.
    time, side
        The time at the start, phase 0 by default, and the side to which the motion goes from a
        contact, as `simulate` takes them: `find_orbit(system, **orbit.start())` begins on an orbit.
    relays
        Whether each `Relay` of the model is on at the start, as `simulate` takes it; not needed
        where its functions say it. An orbit has the sides of its relays at the end of its period as
        at the start, in `signature.relays`.
    progress
        Called from time to time with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        An argument has no meaning.
    MotionError
        The motion comes to rest for good, does not settle, or Newton's method does not converge;
        the message says what to do.

    Examples
    --------
    >>> saltus.find_orbit(system, theta=0.3).signature.impact_count
    2
    """
    given = {"period": period, "max_period": max_period, "settle": settle}
    _check(system, parameters, given)
    check_number("time", time)
    others = ("parameters", "time", "side", "relays", "progress", *given)
    state = arguments_of(system, read_start(system, velocity, coordinates, others, time))
    if relays is not None:
        state["relays"] = relays
    if system.load.frequency is None:
        base = equations_of(system, Signature((), 1), tuple(parameters))
        return _cycle(base, state, side, period, settle, progress)
    period, settle = (None if count is None else int(count) for count in (period, settle))
    if side is not None or time:
        state = _at_phase_0(system, state, time, side)
    progress(0.0, "following the motion")
    # refuses systems that have no orbits
    base = equations_of(system, Signature((), 1), tuple(parameters))
    if settle is not None:
        state = _after(system, state, settle)
        return _polish(base, state, _period_of(system, state, period, max_period), None, progress)
    passed = 0
    for attempt in range(SETTINGS.rounds):
        progress(
            passed / sum(SETTINGS.settling * 2**k for k in range(SETTINGS.rounds)),
            "following the motion until it settles",
        )
        state = _after(system, state, wait := SETTINGS.settling * 2**attempt)
        passed += wait
        q = _returning(system, state, period, max_period)
        if q is not None:
            return _polish(base, state, q, passed, progress)
    raise MotionError(
        f"the motion has not settled on a periodic orbit of up to {period or max_period} forcing"
        f" periods after {passed}: it is chaotic, settles slowly or has a longer period; try "
        f"another start,"
        " max_period=..., or settle=0 with period=... for an unstable orbit near the start"
    )


def _check(system: System, parameters: Iterable[str], given: dict[str, Any]) -> None:
    """Refuse arguments without meaning."""
    check_system(
        system,
        "find_orbit",
        several_contacts=True,
        multipliers=True,
        switches=True,
        resets=True,
        relays=True,
    )
    for name, value in given.items():
        if value is None and name != "max_period":
            continue
        if system.load.frequency is not None or name == "max_period":
            check_count(name, value, 0 if name == "settle" else 1)
        elif name == "settle":
            check_number(name, value, at_least=0.0)
        else:
            check_number(name, value, above=0.0)
    for path in check_names("parameters", parameters, "parameters, such as ('load.frequency',)"):
        check_path(system, path, "parameters")


def _cycle(
    base: OrbitEquations,
    state: dict[str, Any],
    side: int | None,
    period: float | None,
    settle: float | None,
    progress: Progress,
) -> PeriodicOrbit:
    """The cycle on which a motion settles or, after `settle`, near which it is."""
    if side is not None:  # the state after a natural time is a start without a side
        state = after(base.system, state, natural_units(base.system).time, side)
    if settle is None:
        found: Return | None = settled_return(base, state, period, progress)
    else:
        found = next_return(base, after(base.system, state, settle), period)
    if found is None:
        raise MotionError(
            "the motion does not come back to where it was; give a guess of its period, "
            "period=..., or let it settle first"
        )
    progress(0.99, "solving for the orbit")
    orbit = cycle_from(base, found)
    if orbit is not None:
        progress(1.0, "done")
        return orbit
    raise MotionError(
        f"Newton's method finds no cycle near the motion, which comes back after {found.time:.9g};"
        " try another start, another period=..., or let it settle first (settle=...)"
    )


def cycle_from(base: OrbitEquations, found: Return) -> PeriodicOrbit | None:
    """The cycle near a state to which a motion comes back, over its least period; None where
    Newton's method finds none.

    Raises
    ------
    MotionError
        It finds an equilibrium, or a cycle that only touches a contact.
    """
    start = arguments_of(base.system, on_this_side(base.system, found.state)) | found.remembered
    orbit = orbit_from(base, start, 1, found.time)
    shorter = None if orbit is None else round_within(orbit)
    if orbit is not None and shorter is not None:
        orbit = orbit_from(base, orbit.equations.start(orbit.solution), 1, shorter) or orbit
    if orbit is None or not orbit.admissible:
        return None
    check_is_cycle(base, orbit, found)
    return orbit


def _at_phase_0(
    system: System, state: dict[str, Any], time: float, side: int | None
) -> dict[str, Any]:
    """The state at the next phase 0 of a motion that begins at a time."""
    period = system.load.period
    if period is None:
        return state  # refused where there is no period
    ahead = period - time % period
    motion = simulate(system, **state, time=time, side=side, duration=ahead, dense=False)
    _refuse_rest(system, motion, state)
    return arguments_of(system, motion.final_state) | remembered_at(motion)


def _after(system: System, state: dict[str, Any], periods: int) -> dict[str, Any]:
    """The state `periods` forcing periods later."""
    motion = simulate(system, **state, periods=periods, dense=False)
    _refuse_rest(system, motion, state)
    return arguments_of(system, motion.final_state) | remembered_at(motion)


def _refuse_rest(system: System, motion: Motion, state: dict[str, Any]) -> None:
    """Refuse a motion that stays at the contact for good, that has lost its phase there, or that
    ends at a margin.
    """
    if motion.limit is not None:
        raise MotionError(
            f"the motion ends at time {motion.time:.6g}, where its margin {motion.limit} reaches "
            f"0: there is no orbit"
        )
    if motion.side != 0 and motion.phase_known:
        return
    start = ", ".join(f"{name}={value!r}" for name, value in state.items())
    farther = "start farther from it, for instance with a larger coordinate or velocity"
    if system.dependent:  # not all of their contacts can be closed
        raise MotionError(STAYS)
    released = bool(load_releases(system))
    if not motion.phase_known and not released:
        raise MotionError(
            f"the motion from {start} settles on the undeformed state, which is not an orbit: its "
            f"impacts lose no energy and become ever smaller; {farther}"
        )
    if not motion.phase_known:
        raise MotionError(
            f"the impacts of the motion from {start} lose no energy and become too small to be "
            f"followed before the load pulls again, so that its phase is lost; give the impacts a "
            f"loss (an e below 1), so that it rests until the load"
            " pulls, which is an orbit, or take a higher frequency"
        )
    if not released:
        raise MotionError(
            f"the motion from {start} comes to rest at contact for good, as the load never pulls it"
            f" off: it settles on the undeformed state, which is not an orbit; {farther}"
        )


def _stroboscopic_states(system: System, state: dict[str, Any], count: int) -> np.ndarray:
    """The states after 0, 1, ..., count forcing periods, each with the sides of its relays."""
    states = [state_with_sides(system, state)]
    for _ in range(count):
        state = _after(system, state, 1)
        states.append(state_with_sides(system, state))
    return np.array(states)


def _returning(
    system: System, state: dict[str, Any], period: int | None, max_period: int
) -> int | None:
    """The fewest forcing periods after which a settled motion returns, or None."""
    states = _stroboscopic_states(system, state, period or max_period)[::-1]
    units = units_with_sides(system)
    if period is None:
        return int(return_period(states, max_period, units=units)) or None
    near = return_distances(states, period, units)[-1] < RECURRENCE.near_return
    return period if near else None


def _period_of(system: System, state: dict[str, Any], period: int | None, max_period: int) -> int:
    """The number of forcing periods after which a motion comes nearest to where it was, if it is
    not given.
    """
    if period is not None:
        return period
    states = _stroboscopic_states(system, state, max_period)[::-1]
    return nearest_return(states, max_period, units_with_sides(system))


def _polish(
    base: OrbitEquations,
    state: dict[str, Any],
    periods: int,
    passed: int | None,
    progress: Progress,
) -> PeriodicOrbit:
    """Solve for the orbit near a motion over one of its periods."""
    progress(0.99, "solving for the orbit")
    orbit = orbit_from(base, state, periods)
    if orbit is not None and orbit.admissible:
        if orbit.creeps:
            raise MotionError(
                "the motion creeps to where it sticks for good, slower and slower, as it could at "
                "any state beyond: the largest multiplier there, "
                f"{abs(orbit.multipliers[0]):.9g}, is 1 within its own accuracy, and this is not "
                "an isolated orbit"
            )
        progress(1.0, "done")
        return orbit
    when = "from the start" if passed is None else f"after {passed} forcing periods"
    lost = sensitivities(base.given, **state, periods=periods, dense=False).undefined
    if lost is not None:
        raise MotionError(
            f"the motion {when} would repeat itself after {periods} forcing periods where it has "
            f"no derivative, and so no multipliers: {lost}"
        )
    raise MotionError(
        f"Newton's method finds no orbit of period {periods} near the motion {when}; "
        "try another start, another period=..., or let it settle first (settle=...)"
    )


def orbit_from(
    base: OrbitEquations, state: dict[str, Any], periods: int, length: float | None = None
) -> PeriodicOrbit | None:
    """The orbit near a motion over `periods` forcing periods from a state at phase 0; it may be one
    that rests for a part of them. Of a cycle without a load, `length` is a guess of its period.

    Raises
    ------
    MotionError
        The motion leads to no orbit.
    """
    return orbit_near(base, state, periods, length)


def orbit_near(
    base: OrbitEquations, state: dict[str, Any], periods: int, length: float | None = None
) -> PeriodicOrbit | None:
    """The orbit with the signature of a motion over `periods` forcing periods from a state at phase
    0, by Newton's method: the first that is admissible of those of all kinds of equations.

    Raises
    ------
    MotionError
        It rests for good.
    """
    motion = MotionToRead(base.system, state, periods, length)
    orbit = None
    for kind in kinds_of(base.given):
        read = kind.read(base, motion)
        found = (
            None
            if read is None
            else PeriodicOrbit.near(*read, base.values, iterations=SETTINGS.iterations)
        )
        if found is not None:
            orbit = simplest(found)
        if orbit is not None and orbit.admissible:
            break
    if orbit is not None and orbit.reach[0] == orbit.reach[1] and orbit.motion().stop is Stop.REST:
        raise MotionError(STAYS)
    return orbit


def simplest(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """An orbit as a solution over its least period or, where it is its own mirror image, over half
    of that.
    """
    orbit = divide(orbit) or orbit
    return (half(orbit) if _is_symmetric(orbit.equations) else None) or orbit


def _is_symmetric(equations: OrbitEquations) -> bool:
    """Whether a system has the mirror symmetry, for all parameters at the equations' paths."""
    paths = equations.paths
    return keeps_symmetry(equations.given, paths[0]) if paths else has_symmetry(equations.given)


@dataclass(frozen=True)
class NearReturnSettings:
    """Which states may lead to orbits, and how they are improved."""

    near: float = 0.15  # Newton's method is tried from returns nearer than this.
    # The largest number of such returns for each period at each value; the nearest ones are taken.
    guesses: int = 12
    apart: float = 0.05  # The least distance between two of these returns.
    iterations: int = 8  # Steps of Newton's method on the section.
    longest: float = 0.3  # The longest of these steps: beyond it the map is far from linear.
    # Distance of a state from its image below which it is taken to be on an orbit.
    converged: float = 1e-7
    same_state: float = 1e-5  # States at one value are on the same orbit if they are this near.
    # An orbit no larger than this, or a motion that stays this near to the contact, is at rest.
    still: float = 1e-6
    # With contacts or frictions and more state variables than this, derivatives are computed motion
    # by motion, by the code that branches need as well. The code for lanes would take longer to
    # compile (minutes for four cells).
    in_lanes: int = 4


NEAR_RETURNS = NearReturnSettings()


def orbits_near_returns(
    system: System,
    path: str,
    values: np.ndarray,
    states: np.ndarray,
    known: list[np.ndarray],
    max_period: int,
) -> list[PeriodicOrbit]:
    """Orbits of up to `max_period` forcing periods near which motions nearly return; orbits of a
    continuum are left out.

    Parameters
    ----------
    system, path
        What moves, and the parameter that is varied.
    values
        Its values, (n,).
    states
        Successive stroboscopic states of motions at each value, (n, motions, kept, d); nan where
        there are fewer.
    known
        For each value the states (k, d) at phase 0 of orbits that are known there, which are not
        returned again.
    """
    found: list[tuple[int, PeriodicOrbit]] = []
    units = natural_units(system).state
    known = [other.reshape(-1, system.dimension) for other in known]
    for period in range(1, min(max_period, states.shape[2] - 1) + 1):
        guesses = [_guesses(at_value, period, units) for at_value in states]
        rows = np.repeat(np.arange(len(values)), [len(at_value) for at_value in guesses])
        begin = np.concatenate(system.to_gaps(0.0, *np.split(np.concatenate(guesses).T, 2))).T
        improved, good = _improved(system.in_gap_coordinates, path, values[rows], begin, period)
        improved = np.concatenate(system.from_gaps(0.0, *np.split(improved.T, 2))).T
        for row, state in zip(rows[good].tolist(), improved[good], strict=True):
            if (
                len(known[row])
                and np.abs((known[row] - state) / units).max(axis=1).min() < NEAR_RETURNS.same_state
            ):
                continue
            known[row] = np.concatenate([known[row], state[None]])
            orbit = solved_near(system.with_({path: float(values[row])}), path, state, period)
            if (
                orbit is not None
                and orbit.isolated
                and not any(same_orbit(orbit, o) for place, o in found if place == row)
            ):
                found.append((row, orbit))
    return [orbit for _, orbit in found]


def solved_near(system: System, path: str, state: np.ndarray, period: int) -> PeriodicOrbit | None:
    """The orbit of a system near a state at phase 0 that nearly repeats itself, to be followed
    along a parameter; or None.
    """
    try:
        start = arguments_of(system, on_this_side(system, state.copy()))
        orbit = orbit_from(equations_of(system, Signature((), 1), (path,)), start, period)
    except MotionError:
        return None
    if orbit is None or not orbit.admissible:
        return None
    still = NEAR_RETURNS.still * orbit.equations.natural.length
    return orbit if orbit.size > still else None


def _guesses(states: np.ndarray, period: int, units: np.ndarray) -> np.ndarray:
    """The states (k, d) at which motions (n, kept, d) nearly return after `period`, without
    repeating themselves, in units of the state variables; nearest first."""
    apart = (states[:, period:] - states[:, :-period]) / units
    distance = np.abs(apart).max(axis=2).ravel()
    begin = states[:, :-period].reshape(-1, states.shape[-1])
    chosen = begin[:0]
    for i in np.flatnonzero(distance < NEAR_RETURNS.near)[
        np.argsort(distance[distance < NEAR_RETURNS.near], kind="stable")
    ]:
        if len(chosen) >= NEAR_RETURNS.guesses:
            break
        beside = np.abs((begin[i] - chosen) / units).max(axis=1)
        again = len(chosen) and beside.min() < NEAR_RETURNS.apart
        if distance[i] > RECURRENCE.near_return and not again:
            chosen = np.concatenate([chosen, begin[i : i + 1]])
    return chosen


def _improved(
    system: System, path: str, values: np.ndarray, states: np.ndarray, period: int
) -> tuple[np.ndarray, np.ndarray]:
    """The states (n, d) after Newton's method for x = Phi(x), and the numbers of those that have
    converged.
    """
    states, active, good = states.copy(), np.arange(len(states)), np.zeros(len(states), dtype=bool)
    units = natural_units(system).state
    for _ in range(NEAR_RETURNS.iterations):
        if not active.size:
            break
        ends, slope = _mapped(system, path, values[active], states[active], period)
        apart = ends - states[active]
        sound = np.isfinite(slope).all(axis=(1, 2)) & np.isfinite(apart).all(axis=1)
        good[active] = sound & (np.abs(apart / units).max(axis=1) < NEAR_RETURNS.converged)
        going = sound & ~good[active]
        active, apart, slope = active[going], apart[going], slope[going]
        steps = [
            np.linalg.lstsq(np.eye(len(a)) - d, a, rcond=None)[0]
            for d, a in zip(slope, apart, strict=True)
        ]
        step = np.array(steps).reshape(-1, states.shape[1])
        longest = np.abs(step / units).max(axis=1, initial=0.0)
        step = step / np.maximum(1.0, longest / NEAR_RETURNS.longest)[:, None]
        states[active] = states_beside(system, states[active], step)
    return states, np.flatnonzero(good)


def _mapped(
    system: System, path: str, values: np.ndarray, states: np.ndarray, period: int
) -> tuple[np.ndarray, np.ndarray]:
    """The states (n, d) `period` forcing periods later, and their derivatives to the states at the
    start, (n, d, d).

    A contact that is closed at the start stays closed: derivatives to its coordinate and velocity
    are 0.
    """
    if system.model.holds_coordinates and system.dimension > NEAR_RETURNS.in_lanes:
        return _mapped_singly(system, path, values, states, period)
    options: dict[str, Any] = {
        "periods": period,
        "sample": (),
        "tol": RECURRENCE.tol,
        "sensitivities": (),
    }
    result = motions_from(system, states, parameters={path: values}, **options)
    return last_states(system, result), np.where(
        held_by_contacts(system, states)[:, None], 0.0, result["derivative"].values
    )


def _mapped_singly(
    system: System, path: str, values: np.ndarray, states: np.ndarray, period: int
) -> tuple[np.ndarray, np.ndarray]:
    """As `_mapped`, one motion after the other; nan where a motion cannot be followed or has no
    derivatives.
    """
    equations = equations_of(system, Signature((), period, section=0.0), (path,), RECURRENCE.tol)
    held = held_by_contacts(system, states)
    ends = np.full(states.shape, np.nan)
    slopes = np.full((*states.shape, states.shape[1]), np.nan)
    for i, (value, state) in enumerate(zip(values, states, strict=True)):
        evaluation = equations.evaluate(state, np.array([value]))
        if evaluation is not None:
            ends[i], slopes[i] = (
                state + evaluation.residual,
                np.where(held[i], 0.0, evaluation.here[0]),
            )
            ends[i, equations.following] = state[equations.following]
    return ends, slopes
