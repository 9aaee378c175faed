"""Simulation: from a system and a state to a motion; and the request for one, its arguments, read
and checked once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from copy import copy
from operator import is_
from typing import Any, NamedTuple, overload

import numpy as np

from saltus.checks import (
    LIMITS,
    Numbers,
    Speeds,
    check_memory,
    check_number,
    check_size,
    notice_degrees,
    real_array,
)
from saltus.errors import MotionError, ParameterError, shown
from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.motion.events import Stop
from saltus.flow.motion.kernel_state import (
    MOST,
    Again,
    ContactState,
    KernelState,
    Recorder,
    remember,
    time_of,
)
from saltus.flow.motion.motion import Motion, in_own_coordinates, motion_of
from saltus.flow.motion.validity import DenseOutput, crushed, paradox
from saltus.flow.programs.compiled import Program, known_program, limits_of, taylor_order
from saltus.progress import Progress, shown_if_long, silent
from saltus.systems import DeclaredLoad, System, check_system, natural_units, read_start
from saltus.taylor import structure_key

# The arguments of `simulate` and `sensitivities`: a misspelt one arrives among the coordinates.
ARGUMENTS = (
    "velocity",
    "periods",
    "duration",
    "tol",
    "time",
    "side",
    "relays",
    "stop_at",
    "dense",
    "progress",
)

MOST_PERIODS = 2**53  # as many as can be counted exactly


class Clock(NamedTuple):
    """When motions start and end; each a number, or an array for many motions."""

    first: Any  # the forcing period that they start in; 0 where the load has none
    local: Any  # the time within it
    last: Any  # the forcing period that they end in
    end: Any  # the local time within that
    length: Any  # of a forcing period; 0 where the load has none


def clock(time: Any, length: Any, periods: float | None, duration: float | None) -> Clock:
    """The start and the end of motions that begin at `time`, under loads of period `length` (or
    None), and last `periods` or `duration`.

    Raises
    ------
    ParameterError
        Both of `periods` and `duration` are given, or neither; one is negative or too long to
        count; or `periods` is given without a forcing period.
    """
    if (periods is None) == (duration is None):
        raise ParameterError("say how long: either periods=... or duration=...", "periods")
    span = periods if duration is None else duration
    check_number(
        "periods" if duration is None else "duration", span, at_least=0.0, at_most=LIMITS.periods
    )
    assert span is not None
    if length is None:
        if periods is not None:
            raise ParameterError(
                "the load has no frequency, so there are no forcing periods; give duration=..."
                " instead",
                "periods",
            )
        return Clock(0, time, 0, time + span, 0.0)
    one = isinstance(time, float) and isinstance(length, float)  # without arrays, which take longer
    longest = length if one else float(np.max(length, initial=0.0))
    if longest > LIMITS.value:
        raise ParameterError(
            f"the period of the load must be at most {LIMITS.value:g}, got {longest:g}",
            "load.frequency",
        )
    divided = divmod if one else np.divmod
    reach = abs(time) / length + (span / length if periods is None else span)
    reach = reach if one else np.max(reach, initial=0.0)
    if not reach < MOST_PERIODS:
        raise ParameterError(
            f"the motion must start and end within 2^53 forcing periods, got {reach:g} of them",
            "time",
        )
    first, local = divided(time, length)
    if periods is None:
        passed, end = divided(local + span, length)
    else:
        passed = math.floor(periods)
        end = local + (periods - passed) * length
    return Clock(first, local, first + passed, end, length)


class MotionPlan(NamedTuple):
    """What a request says apart from the state at its start, checked."""

    asked: tuple[Any, ...]  # the arguments
    limits: tuple[str, ...]
    clock: Clock
    angles: list[tuple[int, str]]  # the coordinates that are angles, each with its place
    again: list[Again | None]  # how the motion is made from other starts (`remember`)
    has_relays: bool  # whether a side is remembered, which the state does not say


class MotionRequest:
    """The arguments of `simulate` as they are given, and the quantities that follow from them; it
    is not changed once it is made.

    Attributes
    ----------
    given, system
        The system as it was given, and in coordinates of its gaps.
    start
        The state in these, coordinates and then velocities, (d,).
    limits
        The margins that end the motion.
    relays
        The side of each relay at the start, +1 or -1, by its name.
    sensitivities
        Parameters to differentiate to; None without derivatives.
    dense_tangent
        Whether the derivatives along a dense motion are kept too.

    Raises
    ------
    ParameterError
        An argument has no meaning.
    """

    def __init__(
        self,
        *,
        system: System,
        coordinates: Mapping[str, float],
        velocity: Any,
        periods: float | None,
        duration: float | None,
        tol: float,
        time: float,
        side: int | None,
        stop_at: Iterable[str],
        dense: bool,
        times: Any = None,
        sensitivities: tuple[str, ...] | None = None,
        dense_tangent: bool = True,
        relays: Mapping[str, Any] | None = None,
    ) -> None:
        check_system(
            system,
            "simulate",
            several_contacts=True,
            multipliers=True,
            switches=True,
            jumps=True,
            resets=True,
            relays=True,
        )
        # what a system remembers is forgotten where values that its classes read have changed
        key = structure_key(system)
        start = read_start(system, velocity, coordinates, NAMES[sensitivities is not None], time)
        self.given = system
        self.system = system.in_gap_coordinates
        self.plan = _plan(
            system, key, (periods, duration, tol, time, side, stop_at, dense, times is None)
        )
        self.limits, self.clock = self.plan.limits, self.plan.clock
        for i, name in self.plan.angles:
            notice_degrees(name, start.item(i))
        self.time = float(time)
        self.tol = float(tol)
        self.start = start
        if self.system is not system:
            structure_key(self.system)
            self.start = np.concatenate(system.to_gaps(self.time, *np.split(start, 2)))
        self.sample_times = None if times is None else _sample_times(times, self.time)
        self.periods = periods
        self.side = side
        self.relays: dict[str, int] = {}
        if relays is not None or self.plan.has_relays:
            self.relays = relays_at(system, relays, self.time, start)
        self.sensitivities = sensitivities
        self.dense = dense
        self.dense_tangent = dense_tangent
        # the row of a contact or friction, from 1 on, whose events are moved by units in the last
        # place; 0 for none (`moved_events`)
        self.nudge = (0, 0.0)

    def moved_events(self, row: int, units: float) -> MotionRequest:
        """The same request, where events of one contact or friction, numbered from 0 on, happen so
        many units in the last place later: the other order of events at one instant."""
        other = copy(self)
        other.nudge = (1 + row, units)
        return other


def relays_at(
    system: System, given: Mapping[str, Any] | None, time: float, start: np.ndarray
) -> dict[str, int]:
    """The side of each relay of a system at a state, coordinates and then velocities: as its
    functions set it or, between these, as it is given.

    Raises
    ------
    ParameterError
        A relay is not known, its side is none or is not given, or both of its functions are
        positive.
    """
    model: Any = system.model
    if given is not None:
        check_relays(system, given)
    asked = dict(given or {})
    q, v = (half.tolist() if half.size > 1 else half.item() for half in np.split(start, 2))
    state = tuple(tuple(x) if isinstance(x, list) else x for x in (q, v))
    load = DeclaredLoad(system.load, model)
    found = {}
    for relay in model.relays:
        side = asked.get(relay.name)
        if side is not None and not (np.ndim(side) == 0 and side in (True, False, -1)):
            raise ParameterError(
                f"the relay {relay.name!r} must be given as True or False, got {shown(side)}",
                "relays",
            )
        given_side = None if side is None else side in (True, 1)
        found[relay.name] = relay.start_side(model, given_side, time, *state, load)
    return found


def start_with_sides(
    system: System,
    velocity: Any,
    relays: Mapping[str, Any] | None,
    coordinates: Mapping[str, Any],
    arguments: Iterable[str],
) -> np.ndarray:
    """`read_start`, and behind it the sides of the model's relays, `relays_at`."""
    start = read_start(system, velocity, coordinates, arguments)
    if relays is None and not system.model.relays:
        return start
    return np.append(start, [*map(float, relays_at(system, relays, 0.0, start).values())])


def relays_in_turns(system: System, states: np.ndarray) -> np.ndarray:
    """States (n, d) at time 0, and behind them the sides of the model's relays, +1 or -1: as their
    functions set them and, where these do not, by turns.
    """
    relays = system.model.relays
    if not relays:
        return states
    sides = np.empty((len(states), len(relays)))
    for row, state in enumerate(states):
        turn = {relay.name: bool(row >> i & 1) for i, relay in enumerate(relays)}
        sides[row] = list(relays_at(system, turn, 0.0, state).values())
    return np.concatenate([states, sides], axis=1)


def end_of(motion: Motion) -> np.ndarray:
    """The state at the end of a motion, and behind it the sides of its model's relays."""
    relays = motion.system.model.relays
    if not relays:
        return motion.final_state
    sides = motion.sides
    return np.append(motion.final_state, [float(sides[relay.name]) for relay in relays])


def check_relays(system: System, given: Any) -> None:
    """Refuse anything but a dictionary from relays of a system's model."""
    known = [relay.name for relay in system.model.relays]
    if not isinstance(given, Mapping) or not known or not set(given) <= set(known):
        has = ", ".join(known) or "no relays"
        raise ParameterError(
            f"relays must be a dictionary from relays to whether they are on, such as"
            f" {{'{(known or ['heater'])[0]}': True}}, got {shown(given)};"
            f" {type(system.model).__name__} has {has}",
            "relays",
        )


class _CheckedPlan(NamedTuple):
    """A plan, with all of a system that it depends on."""

    key: Any = None  # of the system's structure
    period: float | None = None  # of its load
    plan: MotionPlan | None = None


# the last one: a loop over numbers asks each of its systems for the same motion
_checked = _CheckedPlan()


def _plan(system: System, key: Any, asked: tuple[Any, ...]) -> MotionPlan:
    """The plan of a request to a system with this key of its structure. A system remembers the last
    one: in a loop the arguments are the same objects at every call, and are checked once, also for
    systems that differ in other numbers than the load's period."""
    global _checked
    last: list[MotionPlan] = system._remembered("plan", list)
    for plan in last:
        if all(map(is_, plan.asked, asked)):
            return plan
    checked_before = _checked
    period = system.load.period
    if (
        checked_before.plan is not None
        and checked_before.period == period
        and all(map(is_, checked_before.plan.asked, asked))
        and checked_before.key == key
    ):
        made = checked_before.plan._replace(again=[])
        last[:] = [made]
        return made
    periods, duration, tol, time, side, stop_at, dense, whole = asked
    limits = limits_of(system, stop_at)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_number("time", time)
    if side not in (None, 1, -1):
        raise ParameterError(f"side must be +1 or -1, got {side!r}", "side")
    first, local, last_one, end, length = clock(float(time), period, periods, duration)
    when = Clock(int(first), float(local), int(last_one), float(end), float(length))
    if dense and whole:
        _check_dense(system, when, periods, duration)
    made = MotionPlan(asked, limits, when, _angles(system), [], bool(system.model.relays))
    fixed = isinstance(stop_at, (str, tuple))  # others may change
    last[:] = [made] if fixed else []
    if fixed and period is not None:
        _checked = _CheckedPlan(key, period, made._replace(again=[]))
    return made


# The names of the arguments, without and with derivatives: a misspelt one arrives among the
# coordinates.
NAMES = (*ARGUMENTS, "times"), (*ARGUMENTS, "parameters")


def _angles(system: System) -> list[tuple[int, str]]:
    """The coordinates that are angles, each with its place."""
    return [
        (i, name)
        for i, name in enumerate(system.model.coordinates)
        if system.model.unit_of(name) == "rad"
    ]


def _check_dense(
    system: System, when: Clock, periods: float | None, duration: float | None
) -> None:
    """Refuse a motion that is too long to be kept whole."""
    name, span = ("duration", duration) if periods is None else ("periods", periods)
    length = 1.0 if periods is not None else when.length
    if length == 0.0:
        units = natural_units(system)
        length = 2.0 * math.pi * units.time if units.has_time else math.inf
    count = float(span or 0.0) / length
    if count * LIMITS.dense > LIMITS.any_machine:
        what = f"{count:.3g} periods of a motion kept whole (dense=False or times=... keep less)"
        check_memory(name, count * LIMITS.dense, what)


def _sample_times(given: Any, start: float) -> np.ndarray:
    check_size(given, "times")
    try:
        times = np.atleast_1d(real_array(given))
    except (TypeError, ValueError, OverflowError):
        times = np.array([np.nan])
    if (
        times.ndim != 1
        or not np.isfinite(times).all()
        or (np.diff(times) < 0).any()
        or (times < start).any()
    ):
        raise ParameterError(
            f"times must be numbers that do not decrease, from the start {start:g} on, got"
            f" {given!r}",
            "times",
        )
    return times


WHAT = "following the motion"  # for the progress
GOES_ON = (Status.FULL, Status.PAUSED)  # the motion, with another call of the kernel


@overload
def simulate(
    system: System,
    *,
    periods: float,
    duration: None = ...,
    velocity: Speeds = ...,
    tol: float = ...,
    time: float = ...,
    side: int | None = ...,
    relays: Mapping[str, bool] | None = ...,
    stop_at: Iterable[str] = ...,
    dense: bool = ...,
    times: Numbers | None = ...,
    progress: Progress = ...,
    **coordinates: float,
) -> Motion:
    """The motion over so many forcing periods."""


@overload
def simulate(
    system: System,
    *,
    duration: float,
    periods: None = ...,
    velocity: Speeds = ...,
    tol: float = ...,
    time: float = ...,
    side: int | None = ...,
    relays: Mapping[str, bool] | None = ...,
    stop_at: Iterable[str] = ...,
    dense: bool = ...,
    times: Numbers | None = ...,
    progress: Progress = ...,
    **coordinates: float,
) -> Motion:
    """The motion over so much dimensionless time."""


def simulate(
    system: System,
    *,
    velocity: Speeds = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    side: int | None = None,
    relays: Mapping[str, bool] | None = None,
    stop_at: Iterable[str] = (),
    dense: bool = True,
    times: Numbers | None = None,
    progress: Progress = silent,
    **coordinates: float,
) -> Motion:
    """The exact motion of a system from a state, event by event, by Taylor series.

    Parameters
    ----------
    system
        What moves.
    velocity
        The velocity at the start (a tuple where there are several coordinates, or 0 for all).
    periods, duration
        The length of the motion, either in forcing periods or in dimensionless time.
    tol
        The error that one step may make, relative to the state, in [1e-15, 1e-6].
    time
        The dimensionless time at the start. As any number it is rounded to 1e-16 of its size, and
        the phase of the load with it: far from 0 (6e-11 at 1e6, 1e-4 at 1e12) give the time within
        a forcing period instead.
    side
        The side, +1 or -1, to which the motion goes from rest at the contact if that is not unique.
    relays
        Whether each `Relay` of the model is on at the start, such as {"heater": True}; not needed
        where its functions say it. So have `sides` of a motion the relays at its end.
    stop_at
        Margins of the model that end the motion, such as "kinematic_limit"; the model's own `stops`
        always do.
    dense
        Whether to keep the motion between the events; with False only the events are kept.
    times
        Times at which the states are kept in place of the whole motion, for motions that are too
        long to be kept whole.
    progress
        Called from time to time with the fraction done and what is being done.
    coordinates
        The state at the start by the model's names: theta=0.3, or x=0.0 for a wall oscillator.

    Raises
    ------
    ParameterError
        An argument has no meaning.
    MotionError
        The motion is not unique, an impact has no solution, or the numbers overflow; the message
        says at which time.

    Examples
    --------
    >>> motion = saltus.simulate(system, theta=0.3, periods=20)
    >>> f"{motion.theta:.12f} after {len(motion.impacts)} impacts"
    '-0.235680595299 after 39 impacts'
    """
    asked = periods, duration, tol, time, side, stop_at, dense, times is None
    plain = progress is silent and relays is None
    if plain and (known := _like_the_last(system, asked, coordinates, velocity)):
        return known
    request = MotionRequest(
        system=system,
        coordinates=coordinates,
        velocity=velocity,
        periods=periods,
        duration=duration,
        tol=tol,
        time=time,
        side=side,
        relays=relays,
        stop_at=stop_at,
        dense=dense,
        times=times,
    )
    return in_own_coordinates(system, follow(request, progress).motion)


def _like_the_last(
    system: Any, asked: tuple[Any, ...], coordinates: Mapping[str, Any], velocity: Any
) -> Motion | None:
    """The motion, if this system was followed before with the same arguments but the start, and
    kept a way to do it again.
    """
    memory = getattr(system, "_memory", None)
    for plan in memory.get("plan", ()) if memory else ():
        for again in plan.again if all(map(is_, plan.asked, asked)) else ():
            structure_key(system)  # as for every motion
            return (
                again(system, coordinates, velocity) if again and system._memory is memory else None
            )
    return None


class Followed(NamedTuple):
    """A motion with its tangent at the end."""

    motion: Motion
    now: KernelState  # in which it ended
    recorder: Recorder

    @property
    def columns(self) -> np.ndarray:
        """(2 degrees of freedom, columns): of the coordinates, then of the velocities, at the
        end.
        """
        return self.now.columns

    @property
    def shifts(self) -> np.ndarray:
        """(events, columns): the shift of each event."""
        return self.recorder.event_shifts()

    @property
    def tangent(self) -> DenseOutput | None:
        """The columns' coordinates along the motion."""
        return self.recorder.tangent()


def follow(request: MotionRequest, progress: Progress, run: Program | None = None) -> Followed:
    """Follow the motion of a request, with its tangent if the request asks for one; `run` is its
    program, if that is known.
    """
    made = run or known_program(request.system, request.limits, request.sensitivities)
    now = (ContactState if made.structure.several else KernelState)(request, made)
    recorder = Recorder(request, made, taylor_order(request.tol))
    status, numbers = _advance(request, made, now, recorder, progress)
    if run is None and status == Status.DONE and recorder.is_short:
        remember(request, made)
    motion = collected(request, now, status, numbers, recorder)
    if motion.limit is not None and motion.time == motion.start:
        _refuse_paradox(motion)
    return Followed(motion, now, recorder)


def _refuse_paradox(motion: Motion) -> None:
    """Refuse a start at which a contact with friction has no reaction or several."""
    model: Any = motion.system.model
    pressed = [friction.limit for friction in model.frictions if friction.contact is not None]
    if motion.limit in pressed:
        state = tuple(np.atleast_1d(motion.position)), tuple(np.atleast_1d(motion.velocity))
        if sentence := paradox(motion.system, motion.time, state):
            raise MotionError(sentence)


def _advance(
    request: MotionRequest, run: Program, now: KernelState, recorder: Recorder, progress: Progress
) -> tuple[int, Any]:
    """Call the kernel until the motion ends, emptying its buffers in between; returns why it ended,
    and its numbers then.
    """
    at = request.clock
    system = request.system
    many = MOST.burst if run.structure.several else MOST.rate
    begin = at.first * at.length + at.local
    end = at.last * at.length + at.end
    checked_at = begin
    counted = 0
    progress = shown_if_long(progress)
    progress(0.0, WHAT)
    while True:
        status = now.advance(run, recorder.steps, recorder.events)
        numbers = now.numbers
        recorder.take(numbers)
        time = time_of(numbers)
        if end > begin:
            progress((time - begin) / (end - begin), WHAT)
        if status not in GOES_ON:
            if status != Status.DONE:
                try:
                    refuse(system, status, now)
                except MotionError as error:
                    error.status = status
                    raise
            return status, numbers
        if recorder.total > counted + many:
            if time < checked_at + _time_scale(system, numbers) * many / MOST.rate:
                _refuse_crushed(system, now, recorder.last_hit() if system.model.contacts else [])
                raise MotionError(
                    f"more than {many} {_what_follows(system, recorder)} from time"
                    f" {checked_at:.6g} to {time:.6g}: {_why_so_many(system, recorder)}, or ask for"
                    " a shorter time"
                )
            checked_at = time
            counted = recorder.total
        if recorder.total > MOST.events:
            raise MotionError(
                f"more than {MOST.events} impacts before time {time:.6g}, too many to be kept; ask"
                " for a shorter time, or use simulate_many, which only counts them"
            )
        now.with_empty_buffers()
        recorder.make_buffers()


def _time_scale(system: System, numbers: Any) -> float:
    """The natural time of a system, or without one what its fastest impact takes to fall."""
    units = natural_units(system)
    if units.has_time or not numbers.pull > 0.0:
        return units.time if units.has_time else 0.0
    return float(numbers.fastest / numbers.pull)


def _at_contacts(system: System, recorder: Recorder) -> str:
    """The contacts of the last impacts with their restitution, in words; empty for a model with one
    contact.
    """
    if not system.model.contacts:
        return ""
    matrix = system.impact.restitution_matrix(system.model)
    hit = recorder.last_hit()
    return " at " + " and ".join(
        f"{system.model.contacts[i].name!r} (e = {float(matrix[i][i]):g})" for i in hit
    )


def _what_follows(system: System, recorder: Recorder) -> str:
    """What follows one another so fast, in words: impacts with their contacts, or other events."""
    if not system.model.contacts and system.model.surfaces:
        return "events"
    return f"impacts{_at_contacts(system, recorder)}"


def _why_so_many(system: System, recorder: Recorder) -> str:
    """Why impacts follow one another so fast, and what to change, in words."""
    matrix = system.impact.restitution_matrix(system.model) if system.model.contacts else []
    if any(
        float(matrix[i][i]) == 1.0 for i in (recorder.last_hit() if system.model.contacts else ())
    ):
        return (
            "without a loss impacts on a contact that stays pressed never end, and with several"
            " contacts they are not averaged; give them a loss, an e below 1"
        )
    if not system.model.contacts and system.model.surfaces:
        names = " and ".join(repr(surface.name) for surface in system.model.surfaces)
        return (
            f"the motion goes to and fro between the sides of {names}; set thresholds further apart"
        )
    return "they accumulate too slowly to be followed; raise the loss at impact"


def _refuse_crushed(system: System, now: KernelState, chosen: list[int]) -> None:
    """Refuse a motion in which these contacts close in on a body between them."""
    own = now.numbers.own
    first = now.numbers.dof
    if sentence := crushed(
        system,
        time_of(now.numbers),
        np.concatenate([now.state[:own], now.state[first : first + own]]),
        chosen,
    ):
        raise MotionError(sentence)


def refuse(system: System, status: int, now: KernelState) -> None:
    """Raise an error, with a sentence, for a status that is no regular end of a motion."""
    numbers = now.numbers
    time = time_of(numbers)
    own = numbers.own
    position = now.state[:own]
    velocity = now.state[numbers.dof : numbers.dof + own]
    sentence = refusal(system, status, f"{time:.9g}", f"{velocity[0]:.6g}")
    for relay in system.model.relays if status == Status.NOT_UNIQUE else ():
        if relay.name in now.undecided:
            raise MotionError(
                f"at time {time:.9g} the relay {relay.name!r} is set to both sides: {relay.on}, by"
                f" which it goes on, and {relay.off}, by which it goes off, are both positive, or both"
                " become positive; its thresholds must lie apart, such as on below 19 and off above"
                " 21"
            )
    if status == Status.NOT_UNIQUE and now.undecided:
        names = " and ".join(repr(name) for name in now.undecided)
        raise MotionError(
            f"at time {time:.9g} the motion is at 0 of {names}, and how it goes on is not known: both"
            " sides lead away, so that it is not unique, or it would slide along several functions at"
            " once, or along one whose sign stands in a root, a logarithm, a power or a denominator"
            " of the force; start beside it"
        )
    in_rows = system.model.has_multipliers
    if status in (Status.NOT_UNIQUE, Status.NO_IMPACT) and in_rows:
        _refuse_crushed(system, now, now.touching)
    if status in (Status.NOT_UNIQUE, Status.NO_IMPACT, Status.PASSED) and not in_rows:
        gaps = [
            each.gap(position[system.model.coordinates.index(each.coordinate)])
            for each in system.model.contacts
        ]
        _refuse_crushed(system, now, [i for i, gap in enumerate(gaps) if np.isclose(gap, 0.0)])
        sentence = paradox(system, time, (tuple(position), tuple(velocity))) or sentence
    if sentence is not None:
        raise MotionError(sentence)


def refusal(system: System, status: int, time: str, velocity: str) -> str | None:
    """The sentence for a status that is no regular end of a motion, at a time and with a velocity
    given as text; else None.
    """
    at = f"at time {time}"
    if status in (Status.NOT_UNIQUE, Status.NO_IMPACT) and system.model.has_multipliers:
        if status == Status.NOT_UNIQUE:
            return (
                f"no choice of closed contacts, and of what sticks, is the only consistent one {at}:"
                " the contacts leave no room, a coefficient of friction is too large (Painleve's"
                " paradox), or what slides depends on reactions that rigid bodies do not determine;"
                " give a contact a spring, or a smaller coefficient"
            )
        return (
            f"the impact law has no solution, or several, {at}: a coefficient of friction is too"
            " large for the masses there (Painleve's paradox), or the mass matrix is singular"
        )
    if status in (Status.NOT_UNIQUE, Status.NO_IMPACT) and system.model.holds_coordinates:
        choice = "no choice of closed contacts, and of what sticks, is consistent"
        if status == Status.NOT_UNIQUE and system.model.surfaces:
            names = " or ".join(repr(surface.name) for surface in system.model.surfaces)
            return (
                f"{choice} {at}: both sides of a surface, {names}, push a start on it back to it,"
                " or both lead away from it, so that it is not unique; start beside it"
            )
        what = choice if status == Status.NOT_UNIQUE else "the impact law has no solution"
        return f"{what} {at}: the mass matrix is not positive definite there, or all but singular"
    if status == Status.NOT_UNIQUE:
        return (
            f"the motion from rest at contact {at} is not unique: the accelerations of both sides"
            " point away from it; choose one with side=+1 or side=-1"
        )
    if status == Status.NO_IMPACT:
        return (
            f"{system.impact!r} has no velocity after the impact {at} with velocity {velocity}"
            " before it: no value of the sign that leads on meets the law (errata 26;"
            " VelocityReduction always has one), or the model's reset leads back into the contact"
        )
    if status == Status.NOT_FINITE:
        return (
            f"the motion leaves the range of numbers {at}; its velocity was last {velocity}; a"
            " number of the system may be too large, or a power or root of the model may have no"
            " Taylor series there, such as abs(x)**1.5 at x = 0; a Hertz contact is written as"
            " np.maximum(x, 0)**1.5 in the force of a ContactModel"
        )
    if status == Status.PASSED:
        return (
            f"the motion passed a contact or a surface {at} without an event, which was lost in the"
            " rounding of positions that are far from 0 beside the motion: give positions from an"
            " origin nearer to it"
        )
    if status == Status.OUTSIDE:
        return (
            f"a reset of the state {at} leaves it beyond a contact, where the model has no states:"
            f" {' or '.join(map(repr, system.model.resets))} may not take it there"
        )
    if status == Status.UNORDERED:
        return (
            f"two resets of the state are due at one instant {at}, of"
            f" {' and '.join(map(repr, system.model.resets))}, and the state behind them depends on"
            " which one acts first; start beside it, or give these surfaces one method that knows of"
            " both"
        )
    if status == Status.NO_STATE:
        methods = " or ".join(
            f"{type(system.model).__name__}.{surface.after_event}, after_event of {surface.name!r},"
            for surface in system.model.surfaces
            if surface.after_event is not None
        )
        return (
            f"a reset of the state {at} gives no finite numbers: {methods} has no value at the state"
            " before the event, as a root or a logarithm of a negative number or a division by 0 have"
            " none"
        )
    if status == Status.UNRESOLVED and system.model.resets:
        return (
            f"resets of the state accumulate {at}, at {' or '.join(map(repr, system.model.resets))},"
            " and how the motion goes on behind them is not known; what bounces until it rests is a"
            " Contact"
        )
    if status == Status.STALLED and not system.model.singularity:
        return (
            f"the steps shrink to nothing {at}: the acceleration is singular there, or far too"
            " large"
        )
    return None


def collected(
    request: MotionRequest, now: KernelState, status: int, numbers: Any, recorder: Recorder
) -> Motion:
    """The motion from the kernel's last state and its records."""
    events = recorder.all_events()
    start = request.time
    time = time_of(numbers)
    mode = numbers.mode
    own = numbers.own
    state = now.state.tolist()
    position = state[:own]
    velocity = state[numbers.dof : numbers.dof + own]
    side = now.side(numbers)
    stop = Stop.REST if mode == Mode.REST else Stop.HORIZON
    limit = None
    if status == Status.LIMITED:
        stop = Stop.LIMIT
        limit = request.limits[events.details[-1]]
    if status == Status.STALLED:
        # `refuse` lets no other motion stall
        stop = Stop.SINGULAR
        limit = request.system.model.singularity
    samples = (
        None
        if request.sample_times is None
        else recorder.samples(time, np.array(position), np.array(velocity), side)
    )
    return motion_of(
        system=request.system,
        tol=request.tol,
        start=start,
        time=time,
        position=position[0] if own == 1 else tuple(position),
        velocity=velocity[0] if own == 1 else tuple(velocity),
        side=side,
        stop=stop,
        limit=limit,
        chatter_speed=numbers.chatter_speed if mode == Mode.CHATTER else None,
        periods=numbers.period,
        events=events,
        dense=recorder.dense(),
        kept=samples,
        sampled_validity=None if samples is None else recorder.validity(time - start),
        ties=numbers.ties,
        first_tie=numbers.tied_at if numbers.ties else None,
    )
