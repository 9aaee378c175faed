"""Simulation: from a system and a state to a motion."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import check_number
from saltus.errors import MotionError, ParameterError, near
from saltus.flow.compiled import Structure, load_kernel, load_structure
from saltus.flow.forcing_time import clock
from saltus.flow.kernel_layout import STRUCTURE_SIZES, Mode, Setting, Status, Where
from saltus.flow.memory_layout import State
from saltus.flow.motion import Motion
from saltus.flow.recorder import Recorder
from saltus.flow.stops import Stop
from saltus.progress import Progress, silent
from saltus.systems import Model, Record, System, check_system, children, is_number, numbers
from saltus.taylor import Trace, record_table, trace

WHAT = "following the motion"  # for the progress
MOST_EVENTS = 20_000_000  # that are kept
MOST_IMPACTS = 1_000_000  # of a unit of time: beyond them an accumulation of impacts is not being resolved but endured


@dataclass(frozen=True)
class Program:
    """A system ready to run: its compiled kernel and its numbers."""

    trace: Trace
    structure: Structure
    env: tuple[Any, ...]  # parameters, constants, record breakpoints, record table
    model: tuple[Any, ...]  # the structure's functions and the geometry of its contact
    limits: tuple[str, ...]


def program(system: System, limits: tuple[str, ...] = (), sensitivities: tuple[str, ...] | None = None) -> Program:
    """A system ready to run, with a tangent if asked. Its structure is traced and compiled, or found; numbers are only read."""
    key = (structure_key(system), limits, sensitivities)
    if key not in _structures:
        traced = trace(system, limits, sensitivities)
        _structures[key] = traced, load_structure(traced)
    traced, structure = _structures[key]
    parameters = np.array([value for _, value in numbers(system)])
    return Program(traced, structure, *structure.prepare(parameters, record_table(system, traced.records)), tuple(traced.margins))


_structures: dict[Any, tuple[Trace, Structure]] = {}


def structure_key(node: Any) -> Any:
    """What a system's structure depends on: the types of its parts and whatever in them is not a number."""
    if isinstance(node, Record):  # its samples are numbers, and its scale; where they came from does not matter
        return Record, node.quantity
    parts = children(node)
    if parts:
        return type(node), tuple((name, structure_key(part)) for name, part in parts.items())
    if is_number(node):
        return float
    if isinstance(node, np.ndarray):
        return node.shape, node.dtype.str, node.tobytes()
    if type(node).__hash__ is None:
        raise ParameterError(f"a model cannot keep a {type(node).__name__}, got {node!r}; give it numbers, an array or a tuple")
    return node


def simulate(
    system: System,
    *,
    velocity: Any = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    side: int | None = None,
    stop_at: Iterable[str] = (),
    dense: bool = True,
    samples: Any = None,
    progress: Progress = silent,
    **coordinates: float,
) -> Motion:
    """The exact motion of a system from a state, event by event, by Taylor series.

    Args:
        system: what moves.
        velocity: the velocity at the start (a tuple where there are several coordinates, or 0 for all).
        periods, duration: how long, in forcing periods or in dimensionless time; one of them.
        tol: the error that one step may make, relative to the state, in [1e-15, 1e-6].
        time: the dimensionless time at the start.
        side: +1 or -1, the side to leave by where the motion from rest at contact is not unique.
        stop_at: margins of the model that end the motion, such as "kinematic_limit"; its own `stops` always do.
        dense: keep the motion between the events; False keeps the events alone.
        samples: times at which to keep the states instead, for a motion too long to be kept whole.
        progress: called with the fraction done and what is being done, now and then.
        coordinates: the state at the start by the model's names: theta=0.3, or x=0.0 for a wall oscillator.

    Raises:
        ParameterError: an argument without meaning.
        MotionError: the motion is not unique, an impact has no solution, or the numbers overflow; with the instant.
    """
    followed = follow(
        system,
        None,
        velocity=velocity,
        periods=periods,
        duration=duration,
        tol=tol,
        time=time,
        side=side,
        stop_at=stop_at,
        dense=dense,
        samples=samples,
        progress=progress,
        coordinates=coordinates,
    )
    return followed.motion


@dataclass(frozen=True)
class Followed:
    """A motion, and what the kernel has left of its tangent."""

    motion: Motion
    columns: np.ndarray  # (2 degrees of freedom, columns): of the coordinates, then of the velocities, at the end
    shifts: np.ndarray  # (events, columns): how the time of each event moves


def follow(
    system: System,
    sensitivities: tuple[str, ...] | None,
    *,
    velocity: Any,
    periods: float | None,
    duration: float | None,
    tol: float,
    time: float,
    side: int | None,
    stop_at: Iterable[str],
    dense: bool,
    samples: Any,
    progress: Progress,
    coordinates: dict[str, float],
) -> Followed:
    """`simulate`, and its tangent if `sensitivities` is not None."""
    check_system(system, "simulate")
    position, speeds = _start_state(system, velocity, coordinates)
    limits = limits_of(system, stop_at)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_number("time", time)
    if side not in (None, 1, -1):
        raise ParameterError(f"side must be +1 or -1, got {side!r}", "side")
    run = program(system, limits, sensitivities)
    where, state, settings = _prepare(system, run, position, speeds, periods, duration, float(time), tol)
    sample_times = None if samples is None else _sample_times(samples, float(time))
    recorder = Recorder(
        system, int(where[Where.ORDER]), float(settings[Setting.LENGTH]), dense, sample_times, int(where[Where.COLUMNS])
    )
    where[Where.LEAVE_BY], where[Where.DENSE] = side or 0, int(dense or samples is not None)
    status = _advance(system, run, where, state, settings, recorder, progress)
    motion = _collect(system, run, where, state, settings, float(time), status, recorder)
    return Followed(motion, _columns(where, state), recorder.event_shifts())


def _columns(where: np.ndarray, state: np.ndarray) -> np.ndarray:
    own, shape = where[Where.OWN], (2, 1 + where[Where.COLUMNS], where[Where.OWN])
    both = state[State.COORDINATES : State.COORDINATES + 2 * where[Where.DOF]].reshape(shape)
    columns: np.ndarray = both[:, 1:].transpose(0, 2, 1).reshape(2 * own, -1)
    return columns


def limits_of(system: System, stop_at: Iterable[str]) -> tuple[str, ...]:
    """The margins that end a motion: the model's own stops and those asked for."""
    try:
        return tuple(dict.fromkeys((*system.model.stops, *([stop_at] if isinstance(stop_at, str) else stop_at))))
    except TypeError:
        raise ParameterError(
            f"stop_at must be the names of margins, such as ['kinematic_limit'], got {stop_at!r}", "stop_at"
        ) from None


def _sample_times(samples: Any, start: float) -> np.ndarray:
    try:
        times = np.atleast_1d(np.asarray(samples, dtype=float))
    except (TypeError, ValueError):
        times = np.array([np.nan])
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) < 0).any() or (times < start).any():
        raise ParameterError(
            f"samples must be times that do not decrease, from the start {start:g} on, got {samples!r}", "samples"
        )
    return times


def _start_state(system: System, velocity: Any, coordinates: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    names = system.model.coordinates
    for name in coordinates:
        if name not in names:
            raise ParameterError(f"{type(system.model).__name__} has no coordinate {name!r}; {near(name, names)}", name)
    missing = [name for name in names if name not in coordinates]
    if missing:
        raise ParameterError(f"the state at the start needs {missing[0]}=...", missing[0])
    for name in names:
        check_number(name, coordinates[name])
    try:
        speeds = np.atleast_1d(velocity)
        if np.ndim(velocity) == 0 and velocity == 0.0:
            speeds = np.zeros(len(names))
    except ValueError:
        raise ParameterError(f"velocity must have {len(names)} value(s), got {velocity!r}", "velocity") from None
    if speeds.shape != (len(names),):
        raise ParameterError(f"velocity must have {len(names)} value(s), got {velocity!r}", "velocity")
    for value in speeds:
        check_number("velocity", value)
    return np.array([coordinates[name] for name in names], dtype=float), speeds.astype(float)


def _prepare(
    system: System,
    run: Program,
    position: np.ndarray,
    speeds: np.ndarray,
    periods: float | None,
    duration: float | None,
    time: float,
    tol: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The kernel's state at the start: counters, numbers and settings (see `kernel.py`)."""
    where, state = np.zeros(len(Where), dtype=np.int64), _first_state(run, position, speeds)
    at = clock(time, system.load.period, periods, duration)
    state[State.TIME] = at.local
    where[Where.PERIOD], where[Where.LAST_PERIOD], where[Where.ORDER] = int(at.first), int(at.last), taylor_order(tol)
    where[Where.PIECE] = np.searchsorted(run.env[2], time, side="right")
    where[STRUCTURE_SIZES] = run.structure.sizes
    _choose_side(system, where, position, speeds)
    return where, state, np.array([at.length, at.end, tol])


def _first_state(run: Program, position: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Local time, chatter speed, coordinates and velocities, each followed by the tangent's columns, and the shifts."""
    columns = run.structure.sizes[-1]
    start = np.eye(columns, 2 * position.size)  # in row j what column j begins with
    u, z = start[:, : position.size].ravel(), start[:, position.size :].ravel()
    return np.concatenate([[0.0, 0.0], position, u, speeds, z, np.zeros(columns)])


def taylor_order(tol: float) -> int:
    """The order that pays at a tolerance: 10 at 1e-6, 15 at 1e-10, 20 at 1e-14."""
    return round(10 + 1.25 * (-math.log10(tol) - 6))


def check_gap(model: Model) -> None:
    """Refuse a gap that is not linear in the coordinate, or not zero at `contact`: a model has one contact point."""
    point, name = float(model.contact), type(model).__name__
    for side in model.sides:
        at, below, above = (float(model.gap(point + x, side)) for x in (0.0, -1.0, 1.0))
        rounding = 1e-9 * (abs(below) + abs(above))
        if abs(at) > rounding:
            raise ParameterError(f"{name}.gap must be 0 at {name}.contact = {point:g}, got {at:g} on side {side}; give both")
        if abs(below + above) > rounding:
            raise ParameterError(f"{name}.gap must be linear in the coordinate: a model has one contact point, not two stops")


def _choose_side(system: System, where: np.ndarray, position: np.ndarray, speeds: np.ndarray) -> None:
    """The mode and the side of a state: by the gap, at contact by the velocity, and at rest there by the accelerations."""
    model = system.model
    where[Where.MODE], where[Where.SIDE] = Mode.ARC, 1
    if not model.sides:
        return
    check_gap(model)
    gaps = {s: float(model.gap(position[0], s)) for s in model.sides}
    inside = [s for s, gap in gaps.items() if gap > 0]
    if inside:
        where[Where.SIDE] = inside[0]
    elif min(gaps.values()) < 0:
        name = model.coordinates[0]
        raise ParameterError(f"{name} = {position[0]:g} lies beyond the contact at {name} = {float(model.contact):g}", name)
    elif speeds[0] == 0.0:
        where[Where.MODE] = Mode.CONTACT
    else:
        into = [s for s in model.sides if model.gap(position[0] + np.sign(speeds[0]), s) > 0]
        where[Where.SIDE] = (into or list(model.sides))[0]
        where[Where.MODE] = Mode.CONTACT if into else Mode.ARC  # an arc that starts outward at contact begins with its impact


def _advance(
    system: System,
    run: Program,
    where: np.ndarray,
    state: np.ndarray,
    settings: np.ndarray,
    recorder: Recorder,
    progress: Progress,
) -> int:
    """Call the kernel until the motion ends, emptying its buffers in between; returns why it ended."""
    advance, begin = load_kernel(), _global_time(where, state, settings)
    end = where[Where.LAST_PERIOD] * settings[Setting.LENGTH] + settings[Setting.END]
    looked_at, counted, unit = begin, 0, min(settings[Setting.LENGTH] or 1.0, 1.0)
    progress(0.0, WHAT)
    while True:
        status = advance(where, state, settings, run.env, run.model, recorder.steps, recorder.events)
        recorder.take(where)
        time = _global_time(where, state, settings)
        if end > begin:
            progress((time - begin) / (end - begin), WHAT)
        if status not in (Status.FULL, Status.PAUSED):
            _refuse(system, status, where, state, settings)
            return status
        if recorder.total > counted + MOST_IMPACTS:
            if time < looked_at + unit:
                raise MotionError(
                    f"more than {MOST_IMPACTS} impacts from time {looked_at:.6g} to {time:.6g}: they accumulate too slowly to be "
                    "followed; raise the loss at impact, or ask for a shorter time"
                )
            looked_at, counted = time, recorder.total
        if recorder.total > MOST_EVENTS:
            raise MotionError(
                f"more than {MOST_EVENTS} impacts before time {time:.6g}, too many to be kept; ask for a shorter time, or use "
                "simulate_many, which only counts them"
            )


def _global_time(where: np.ndarray, state: np.ndarray, settings: np.ndarray) -> float:
    return float(where[Where.PERIOD] * settings[Setting.LENGTH] + state[State.TIME])


def _refuse(system: System, status: int, where: np.ndarray, state: np.ndarray, settings: np.ndarray) -> None:
    """Turn a status that is not an end into a sentence."""
    at = f"at time {_global_time(where, state, settings):.9g}"
    velocity = state[State.COORDINATES + where[Where.DOF]]
    if status == Status.NOT_UNIQUE:
        raise MotionError(
            f"the motion from rest at contact {at} is not unique: the accelerations of both sides point away from it; "
            "choose one with side=+1 or side=-1"
        )
    if status == Status.NO_IMPACT:
        raise MotionError(
            f"{system.impact!r} has no velocity after the impact {at} with velocity {velocity:.6g} before it: no value of the "
            "sign that leads on meets the law (errata 26; VelocityReduction always has one), or the model's reset leads "
            "back into the contact"
        )
    if status == Status.NOT_FINITE:
        raise MotionError(
            f"the motion leaves the range of numbers {at}; its velocity was last "
            f"{velocity:.6g}; a power or root of the model may have no Taylor series there, such as abs(x)**1.5 at x = 0"
        )
    if status == Status.STALLED:
        raise MotionError(f"the steps shrink to nothing {at}: the acceleration is singular there")


def _collect(
    system: System,
    run: Program,
    where: np.ndarray,
    state: np.ndarray,
    settings: np.ndarray,
    start: float,
    status: int,
    recorder: Recorder,
) -> Motion:
    """The motion from the kernel's last state and its records."""
    events, time = recorder.all_events(), _global_time(where, state, settings)
    held = where[Where.MODE] in (Mode.REST, Mode.CHATTER)
    stop, limit = (Stop.REST if where[Where.MODE] == Mode.REST else Stop.HORIZON), None
    if status == Status.LIMITED:
        stop, limit = Stop.LIMIT, run.limits[events.details[-1]]
    dof = len(system.model.coordinates)
    position, velocity = (state[start : start + dof] for start in (State.COORDINATES, State.COORDINATES + where[Where.DOF]))
    side = 0 if held else int(where[Where.SIDE])
    samples = recorder.samples(time, position, velocity, side)
    return Motion(
        system=system,
        tol=float(settings[Setting.TOLERANCE]),
        start=start,
        time=time,
        position=float(position[0]) if dof == 1 else tuple(position.tolist()),
        velocity=float(velocity[0]) if dof == 1 else tuple(velocity.tolist()),
        side=side,
        stop=stop,
        limit=limit,
        chatter_speed=float(state[State.CHATTER_SPEED]) if where[Where.MODE] == Mode.CHATTER else None,
        periods=int(where[Where.PERIOD]),
        events=events,
        impacts=events.impacts(),
        dense=recorder.dense(),
        samples=samples,
        sampled_validity=None if samples is None else recorder.validity(time - start),
    )
