"""The trajectories of an ensemble whose contacts multipliers hold (`flow/contacts/rows.py`), or whose
surfaces remember their sides or reset the state: each is followed by itself, as lanes have none of
these. What is kept of each is what lanes keep, and the sides of its relays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.lane_steps.memory import END, LONGEST_RECURRENCE
from saltus.flow.lane_steps.sampling import recurrence_period
from saltus.flow.lanes.inputs import Inputs
from saltus.flow.lanes.options import EnsembleOptions, Sample, Until
from saltus.flow.motion.events import EventKind, Stop, modes_of
from saltus.flow.motion.motion import Motion
from saltus.flow.motion.row_values import closing_rates
from saltus.flow.motion.simulate import relays_at, simulate
from saltus.flow.programs.lane_threads import Ends, Jobs
from saltus.progress import Progress
from saltus.systems import Model, System, arguments_of, natural_units

# A motion that may settle is followed over this number of forcing periods, then twice as many, up
# to the most. One that may not, with relays or resets, is followed at once if it is no longer than
# the most.
FIRST_SPAN = 4
LONGEST_SPAN = 64
# A motion that ends nearer than this share of a forcing period to the period's end ends with it.
SLIVER = 1e-9


@dataclass
class _Record:
    """What is kept of one trajectory."""

    state: np.ndarray
    time: float
    samples: np.ndarray  # (kept, columns)
    stroboscopic: np.ndarray  # (2 * longest recurrence, d)
    agreements: np.ndarray
    done: int = 0
    sides: tuple[int, ...] = ()  # of its relays
    status: int = Status.DONE
    detail: int = 0
    mode: int = Mode.CONTACT
    side: int = 1
    impacts: int = 0
    grazings: int = 0
    highest: float = -math.inf
    lowest: float = math.inf
    least_speed: float = math.inf


def goes_alone(model: Model) -> bool:
    """Whether motions of a model are followed one by one."""
    return model.has_multipliers or bool(model.relays or model.resets)


def followed_one_by_one(
    system: System,
    inputs: Inputs,
    options: EnsembleOptions,
    jobs: Jobs,
    kept: int,
    side: int,
    progress: Progress,
    duration: float | None = None,
) -> Ends:
    """The ends of all trajectories, which last `duration` or the periods that are asked for.

    Raises
    ------
    ParameterError
        Derivatives are asked for, or a start does not say on which side a relay is.
    """
    if options.paths is not None:
        what = "motions whose contacts are distances"
        if not system.model.has_multipliers:
            what = "motions with relays and surfaces that reset the state"
        raise ParameterError(
            f"ensembles have no derivatives of {what} so far: take saltus.sensitivities, one motion"
            " at a time",
            "sensitivities",
        )
    own = len(system.model.coordinates)
    remembered = len(system.model.relays)
    columns = [column for kind in Sample if kind in options.sample for column in kind.columns(own)]
    if Sample.STATE in options.sample:
        columns += range(2 * own + 4, 2 * own + 4 + remembered)
    size = len(jobs)
    ends = Ends(
        np.empty((size, 2 * own)),
        np.zeros(size, dtype=END),
        np.zeros((size, own)),
        np.full((size, kept if columns else 1, len(columns)), np.nan),
        np.zeros((size, remembered), dtype=np.int8),
    )
    times = np.broadcast_to(inputs.values["time"], size)
    systems = _systems(system, inputs)
    begun = _first_sides(systems, inputs, jobs.states, times)
    for row, one in enumerate(systems):
        progress(row / size, "following motions one by one")
        job = jobs.rows[row]
        record = _Record(
            jobs.states[row].copy(),
            float(times[row]),
            np.full((ends.samples.shape[1], 2 * own + 4 + remembered), np.nan),
            np.zeros((2 * LONGEST_RECURRENCE, 2 * (own + remembered))),
            np.zeros(LONGEST_RECURRENCE + 1, dtype=np.int64),
            sides=begun[row],
        )
        _follow(one, record, job, options, side, duration)
        _write(record, job, ends, row, columns)
    return ends


def _systems(system: System, inputs: Inputs) -> list[System]:
    """The system of each trajectory."""
    numbers = {path: np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()}
    if not numbers:
        return [system] * inputs.size
    return [
        system.with_({path: float(a[row]) for path, a in numbers.items()})
        for row in range(inputs.size)
    ]


def _first_sides(
    systems: list[System], inputs: Inputs, states: np.ndarray, times: np.ndarray
) -> list[tuple[int, ...]]:
    """The side of each relay at the start of each trajectory."""
    if not systems or not systems[0].model.relays:
        return [()] * len(systems)
    given = {name: np.broadcast_to(a, len(systems)) for name, a in inputs.relays.items()}
    found = []
    for row, one in enumerate(systems):
        asked = {name: bool(sides[row] > 0) for name, sides in given.items()}
        start = states[row, : 2 * len(one.model.coordinates)]
        found.append(tuple(relays_at(one, asked, float(times[row]), start).values()))
    return found


def _follow(
    system: System,
    record: _Record,
    job: Any,
    options: EnsembleOptions,
    side: int,
    duration: float | None,
) -> None:
    """Follow one trajectory, chunk after chunk."""
    length = float(job["period_length"])
    total = (job["last_period"] - job["first_period"]) * length
    total += job["end_time"] - job["start_time"]
    whole = math.floor(total / length * (1.0 + 1e-12)) if length > 0.0 else 0
    settles = Until.SETTLED in options.until
    span = FIRST_SPAN if settles else LONGEST_SPAN
    if whole <= LONGEST_SPAN and not settles and not system.model.has_multipliers:
        # as `simulate` follows it, to the last bit
        _advance(system, record, options, side, length, options.periods, duration)
        return
    begin = record.time
    while record.status == Status.DONE and record.done < whole:
        count = min(span, whole - record.done)
        _advance(system, record, options, side, periods=count, length=length)
        span = min(2 * span, LONGEST_SPAN)
    rest = begin + total - record.time
    if record.status == Status.DONE and (rest > 1e-12 * total or record.done == 0):
        _advance(system, record, options, side, duration=max(rest, 0.0), length=length)


def _advance(
    system: System,
    record: _Record,
    options: EnsembleOptions,
    side: int,
    length: float,
    periods: float | None = None,
    duration: float | None = None,
) -> None:
    """Follow a trajectory over some forcing periods, or for a time, and keep what is asked for."""
    own_limits = (*system.model.stops, *system.model.friction_limits)
    lasting: Any = {"duration": duration} if periods is None else {"periods": periods}
    if record.sides:
        names = [relay.name for relay in system.model.relays]
        lasting["relays"] = dict(zip(names, record.sides, strict=True))
    try:
        motion = simulate(
            system,
            **arguments_of(system, record.state),
            **lasting,
            time=record.time,
            tol=options.tol,
            side=side or None,
            stop_at=[name for name in options.limits if name not in own_limits],
        )
    except (MotionError, ParameterError) as error:
        record.status = getattr(error, "status", None) or Status.UNRESOLVED
        if isinstance(error, ParameterError) and not record.done:
            record.status = Status.OUTSIDE  # a start beyond a contact
        if not record.done:
            _keep(record, np.array([[*record.state, *4 * [math.nan], *record.sides]]))
        return
    times = _period_ends(motion, length)
    settled = _keep_periods(system, record, motion, times, Until.SETTLED in options.until)
    until = times[-1] if settled is None else times[settled]
    record.time = float(until)
    inside = motion.events.times <= until
    record.grazings += sum(
        event.kind is EventKind.GRAZING
        for event, kept in zip(motion.events, inside.tolist(), strict=True)
        if kept
    )
    record.mode = Mode.REST if motion.stop is Stop.REST else Mode.CONTACT
    record.side = 1 + int(modes_of(system.model, np.array(motion.side))[0])
    if motion.stop is Stop.LIMIT:
        record.status = Status.LIMITED
        record.detail = options.limits.index(str(motion.limit))


def _keep_periods(
    system: System, record: _Record, motion: Motion, times: np.ndarray, settles: bool
) -> int | None:
    """Keep what happens between times; the number of the one at which the motion has settled."""
    states = np.concatenate([np.atleast_2d(part) for part in motion.at(times)])
    own = len(states) // 2
    states = states.reshape(2 * own, len(times)).T
    states[-1] = motion.final_state
    sides = _sides_of_relays(motion, times)
    extrema = motion.extrema_between(times)
    impacts = motion.impacts
    speeds = _closing_speeds(motion)
    for number in range(1, len(times)):
        within = (times[number - 1] < impacts.time) & (impacts.time <= times[number])
        row = np.array(
            [
                *states[number],
                extrema[number - 1, :, 1].max(),
                extrema[number - 1, :, 0].min(),
                speeds[within].min(initial=math.inf),
                np.count_nonzero(within),
                *sides[number],
            ]
        )
        _keep(record, row[None])
        record.state = states[number].copy()
        record.sides = tuple(sides[number].tolist())
        if settles and _recurs(system, record):
            return number
    return None


def _keep(record: _Record, rows: np.ndarray) -> None:
    """Keep the samples of forcing periods that are over."""
    for row in rows:
        record.samples[record.done % len(record.samples)] = row
        record.done += 1
        first = len(record.state)
        high, low, speed, count = row[first : first + 4]
        record.highest = max(record.highest, high)
        record.lowest = min(record.lowest, low)
        record.least_speed = min(record.least_speed, speed)
        record.impacts += 0 if math.isnan(count) else int(count)


def _recurs(system: System, record: _Record) -> bool:
    """Whether a trajectory repeats itself, as lanes tell it, with its relays on the same sides."""
    own = len(record.state) // 2
    length = natural_units(system).length
    speed = length * float(system.load.frequency or 1.0)
    # each relay is a coordinate of the size of the others, which stands
    sides = length * np.array(record.sides)
    record.stroboscopic[record.done % (2 * LONGEST_RECURRENCE)] = np.concatenate(
        [record.state[:own], sides, record.state[own:], 0.0 * sides]
    )
    period, _ = recurrence_period(
        record.stroboscopic, record.agreements, record.done, own + len(sides), length, speed
    )
    if period:
        record.status = Status.SETTLED
        record.detail = period
    return bool(period)


def _closing_speeds(motion: Motion) -> np.ndarray:
    """The least speed at which each impact closes one of its contacts, (n,)."""
    impacts = motion.impacts
    model = motion.system.model
    if model.has_multipliers:
        rates = np.abs(closing_rates(motion))
    else:
        before = np.reshape(impacts.velocity_before, (len(impacts), len(model.coordinates))).T
        places = [model.coordinates.index(str(each.coordinate)) for each in model.contacts]
        rates = np.abs(before[places])
    for i in range(len(rates)):
        rates[i] = np.where(impacts.side >> i & 1 == 1, rates[i], math.inf)
    return np.asarray(rates.min(axis=0, initial=math.inf))


def _period_ends(motion: Motion, length: float) -> np.ndarray:
    """The start of a motion, the ends of its forcing periods, counted from there, and its end."""
    whole = 0
    if length > 0.0:
        whole = math.floor((motion.time - motion.start) / length + SLIVER)
    times = np.minimum(motion.start + length * np.arange(whole + 1), motion.time)
    if whole == 0 or motion.time - times[-1] > SLIVER * length:  # apart from rounding
        times = np.append(times, motion.time)
    return np.asarray(times)


def _sides_of_relays(motion: Motion, times: np.ndarray) -> np.ndarray:
    """The sides of a motion's relays at times, of which the last one is its end, (n, relays)."""
    model = motion.system.model
    names = [relay.name for relay in model.relays]
    if not names:
        return np.zeros((len(times), 0), dtype=int)
    if motion.dense is None:  # it has no duration
        return np.array([[motion.sides[name] for name in names]] * len(times), dtype=int)
    sides = modes_of(model, motion.dense.states(times)[2])[2]
    of_surfaces = dict(zip([part.name for part in model.surfaces], sides, strict=True))
    found = np.stack([of_surfaces[name] for name in names], axis=1).astype(int)
    found[-1] = [motion.sides[name] for name in names]
    return np.asarray(found)


def _write(record: _Record, job: Any, ends: Ends, row: int, columns: list[int]) -> None:
    """Write the end of a trajectory into the results."""
    ends.states[row] = record.state
    ends.sides[row] = record.sides
    ends.samples[row] = record.samples[:, columns]
    end = ends.rows[row]
    length = float(job["period_length"])
    if record.status == Status.DONE:
        end["period"] = job["last_period"]
        end["time"] = job["end_time"]
    elif length > 0.0:
        end["period"] = math.floor((record.time - job["start_time"]) / length + 1e-12)
        end["time"] = record.time - end["period"] * length
    else:
        end["time"] = record.time
    for name in ("status", "detail", "mode", "side", "impacts", "grazings"):
        end[name] = getattr(record, name)
    for name in ("highest", "lowest", "least_speed"):
        end[name] = getattr(record, name)
    end["periods_done"] = record.done
