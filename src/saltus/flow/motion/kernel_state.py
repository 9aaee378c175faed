"""Python and the scalar kernels share the kernel's state of one motion, from the start to the end.

They also share the records that the kernel fills: all steps of the motion, the states at given
times, or its events alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import LIMITS, free_memory
from saltus.errors import MotionError, ParameterError
from saltus.flow.kernel.contact_layout import (
    FrictionImpact,
    NoPress,
    PartColumn,
    PartKind,
    Reached,
    Side,
    Touch,
)
from saltus.flow.kernel.layout import EventCode, Mode, Status, side_of_state
from saltus.flow.kernel.memory import (
    AT_START,
    MOTION,
    WHOLE_RECORD,
    EventBuffers,
    MotionNumbers,
    StepBuffers,
    motion_record,
)
from saltus.flow.motion.events import ContactEvents, MotionEvents, Stop
from saltus.flow.motion.motion import Motion, Samples, motion_of
from saltus.flow.motion.validity import DenseOutput, Validity, ValidityCheck
from saltus.flow.programs.compiled import (
    Program,
    contact_rows_at,
    load_contacts_kernel,
    load_kernel,
    piece_at,
    taylor_order,
)
from saltus.systems import (
    CLOSED_BELOW,
    OWN_TIME,
    inert_frictions,
    slowest_own_time,
    time_without_period,
    units_of_gaps,
)

if TYPE_CHECKING:
    from saltus.flow.motion.simulate import MotionRequest
    from saltus.systems import System


# For tests alone: 1 plus the row of a contact or friction, and by how many units in the last place
# of the time its events are moved, as by rounding. None moves none.
NUDGE: tuple[int, float] | None = None
# A load whose period is more times the time in which a system moves by itself acts as if it stood
# still: the derivatives of the motion, in the load's time, would be scales without meaning, of
# which rounding is a part (beyond some 1e10 times, reactions were lost in it).
SLOW_LOAD = 1e4
# A load is not slow whose period times the highest rate is at most this number, a small share of
# what `SLOW_LOAD` asks. It spares most systems their own time, which takes ten times as long to
# find as a short motion.
NEVER_SLOW = 1e3
# The time of a system is not looked for again in a copy with other numbers if the system's own one
# is longer than the load's by this factor and by this power of the largest ratio between numbers.
FAR_FROM_SLOW = 10.0
POWER_OF_RATIO = 3
NO_COORDINATE = -1  # of a contact whose gap is a row
NO_ROWS = np.zeros((0, len(PartColumn)), dtype=np.int64)


def natural_time(system: System, length: float, run: Program) -> float:
    """The natural time of a motion under a load with a period, 0 if it has none.

    A frequency that acts on nothing is none, and one that is much slower than what moves by itself
    gives no scale.
    """

    def found() -> float:
        of_load = length / (2.0 * math.pi) if length > 0.0 else math.inf
        time = min(of_load, longest_time(system, length, run))
        return time if time < math.inf else 0.0

    time: float = system._remembered((natural_time, length), found)
    return time


def longest_time(system: System, length: float = math.inf, run: Program | None = None) -> float:
    """The natural time under a load whose period is as long as one likes; 0 for what has no time of
    its own, inf where the load's is always taken.

    It is found faster for periods up to a `length`, with the numbers of a program.
    """
    if run is not None and 0.0 < length * _highest_rate(run) <= NEVER_SLOW:
        return _without_period(system)
    if run is None or not 0.0 < length < math.inf:
        return _remembered_time(system)
    numbers = run.env[0][: len(run.trace.parameters)].copy()
    # made here, or handed over by a system of which this is a copy with other numbers
    time, of_numbers = system._remembered(OWN_TIME, lambda: (_remembered_time(system), numbers))
    ratio = _largest_ratio(of_numbers, numbers)
    if ratio == 1.0:
        return float(time)
    if time > FAR_FROM_SLOW * ratio**POWER_OF_RATIO * length / (2.0 * math.pi):
        return _without_period(system)
    return _remembered_time(system)


def _remembered_time(system: System) -> float:
    found: float = system._remembered(longest_time, lambda: _own_time(system))
    return found


def _largest_ratio(some: np.ndarray, others: np.ndarray) -> float:
    """The largest ratio between numbers and others, 1 for the same ones alone; inf where signs
    differ.
    """
    if np.array_equal(some, others):
        return 1.0
    if not np.array_equal(np.sign(some), np.sign(others)):
        return math.inf
    held = some != 0.0
    apart = np.abs(np.log(np.abs(some[held])) - np.log(np.abs(others[held])))
    return max(math.exp(min(float(apart.max()), 100.0)), math.nextafter(1.0, 2.0))


def natural_times(system: System) -> dict[str, float | None]:
    """What `natural_time` does, as numbers, so that a page does it for other periods of the
    load.
    """
    without = _without_period(system)
    return {
        "without_period": without if math.isfinite(without) else None,
        "slow_time": _slow_time(system) if _bounces(system) else None,
    }


def _own_time(system: System) -> float:
    """The natural time without the load's period; inf for what has no contact, which has no use
    for it."""
    if not _bounces(system):
        return math.inf
    slow = _slow_time(system) if system.load.period is not None else math.inf
    return min(_without_period(system), slow)


def _without_period(system: System) -> float:
    """The natural time of what has contacts and no load with a period; inf for all else."""
    return time_without_period(system) if _bounces(system) else math.inf


def _slow_time(system: System) -> float:
    """The natural time under a load that is slow without end."""
    return SLOW_LOAD * slowest_own_time(system)


def _highest_rate(run: Program) -> float:
    """More than the rates of nearly all systems with these numbers, as sqrt(stiffness / mass)."""
    sizes = [abs(value) for value in run.env[0].tolist() if value]
    largest = max(sizes, default=1.0)
    if len(run.data):
        largest = max(largest, float(np.abs(run.data).max()))
    return math.sqrt(largest) / math.sqrt(min(sizes, default=1.0))


def _bounces(system: System) -> bool:
    return system.model.has_one_contact or system.model.holds_coordinates


class KernelState:
    """What the kernel changes: the numbers of a motion, and its state."""

    def __init__(self, request: MotionRequest, run: Program) -> None:
        """The state in which a motion starts.

        Raises
        ------
        ParameterError
            The state lies beyond the contact, or the model's gap or reset is impossible.
        """
        at = request.clock
        self.rows = NO_ROWS  # of several contacts
        self._count = 0  # of these, of contacts
        self._functions: dict[int, str] = {}  # by the numbers of their rows
        # coordinates, velocities, each with its tangent's columns, and shifts
        self.state = _first_state(run, request.start)
        # one record MOTION
        self.array, self._memory = motion_record(taylor_order(request.tol), run.structure.sizes)
        mode, side, leave_by = self._at_contact(request, run)
        piece = piece_at(run, request.time, at.local, at.length)
        dense = int(
            request.dense or request.sample_times is not None or _is_nonlinear(request.system)
        )
        where = (at.local, at.first, mode, side, piece, leave_by, dense)
        span = at.length, natural_time(request.system, at.length, run)
        AT_START.pack_into(self._memory, 0, *where, at.last, at.end, *span, request.tol)
        nudge = NUDGE or request.nudge
        if nudge[0]:  # NumPy takes long for a field
            self.array["nudged"], self.array["nudge"] = nudge

    @property
    def numbers(self) -> Any:
        """The numbers of the motion as they are now, by the names of MOTION."""
        return MotionNumbers._make(WHOLE_RECORD.unpack(self._memory))

    def advance(self, run: Program, steps: StepBuffers, events: EventBuffers) -> int:
        """Call the kernel; returns the `Status` with which it stops."""
        return self._kernel()(
            self.array, self.state, run.env, run.model, self.rows, (steps, events)
        )

    def with_empty_buffers(self) -> None:
        """Let the kernel record from the beginning of its buffers on."""
        self.array["recorded_steps"] = self.array["recorded_events"] = 0

    def _at_contact(self, request: MotionRequest, run: Program) -> tuple[int, int, int]:
        """The mode and the side at the start, and by which side a motion leaves that is not
        unique.
        """
        position, speed = request.start.tolist()[:: request.start.size // 2]
        mode, side = side_of_state(
            run.structure.sizes.sides, position, speed, run.model.geometry.tolist()
        )
        if mode == Mode.BEYOND:
            model = request.system.model
            name = request.system.model.coordinates[0]
            raise ParameterError(
                f"{name} = {position:g} lies beyond the contact at {name} ="
                f" {float(model.contact):g}",
                name,
            )
        return mode, side, request.side or 0

    @property
    def touching(self) -> list[int]:
        """The contacts that are closed, or have just been, of several."""
        return []

    @property
    def undecided(self) -> list[str]:
        """The names of functions whose sides the kernel was choosing."""
        return []

    def _kernel(self) -> Callable[..., int]:
        return load_kernel()

    def side(self, numbers: Any) -> int:
        """+1 or -1, and 0 at rest."""
        return 0 if numbers.mode in (Mode.REST, Mode.CHATTER) else numbers.side

    @property
    def columns(self) -> np.ndarray:
        """The tangent's columns, (2 own coordinates, columns): the rows of the coordinates, then
        those of the velocities.
        """
        now = self.numbers
        both = self.state[: 2 * now.dof].reshape(2, 1 + now.columns, now.own)
        columns: np.ndarray = both[:, 1:].transpose(0, 2, 1).reshape(2 * now.own, -1)
        return columns


def time_of(numbers: Any) -> float:
    """The dimensionless time of a motion with these numbers."""
    time: float = numbers.period * numbers.period_length + numbers.time
    return time


# of system, coordinates and velocity, as `simulate` takes them
Again = Callable[[Any, Mapping[str, Any], Any], Motion | None]


def remember(request: MotionRequest, run: Program) -> None:
    """Let the plan of a request keep a way to make its motion from other starts, once it has been
    asked for twice: in loops of users all but the start is the same, and the rest of Python takes
    four times as long as the kernel for a forcing period.

    Only the events of these motions are kept, and their systems have one coordinate and at most one
    contact. Where one call of the kernel is not enough there is no motion: `follow` makes it then,
    or refuses it.
    """
    kept = request.plan.again
    system = request.system
    structure = run.structure
    breaks = run.env[2]
    if not kept:
        kept.append(None)
        return
    sizes = structure.sizes
    own = request.given is system and breaks.size == 0 and not structure.several
    if kept[0] is not None or not own or (sizes.own, sizes.columns, sizes.first_order) != (1, 0, 0):
        return
    name = system.model.coordinates[0]
    kernel = load_kernel()
    env = run.env
    model = run.model
    blank = bytes(KernelState(request, run)._memory)
    buffers = Recorder(request, run, taylor_order(request.tol))
    local, first, _, _, *rest = AT_START.unpack_from(blank)
    size = len(buffers.events.event_labels)
    steps = buffers.steps
    geometry = model.geometry.tolist()
    most = 2.0 * math.pi if request.plan.angles else np.inf  # beyond it `simulate` warns
    same = {"tol": request.tol, "start": request.time, "ties": 0} | dict.fromkeys(
        ("limit", "dense", "kept", "sampled_validity", "first_tie")
    )

    def motion(system: System, coordinates: Mapping[str, Any], velocity: Any) -> Motion | None:
        value = coordinates.get(name)
        if type(value) is not float or type(velocity) is not float or len(coordinates) > 1:
            return None
        mode, side = side_of_state(sizes.sides, value, velocity, geometry)
        if mode == Mode.BEYOND or not (
            abs(value) <= min(most, LIMITS.value) and abs(velocity) <= LIMITS.value
        ):
            return None
        memory = bytearray(blank)
        state = np.array((value, velocity))
        AT_START.pack_into(memory, 0, local, first, mode, side, *rest)
        labels, values = events = EventBuffers(
            np.empty((size, 4), dtype=np.int64), np.empty((size, 3))
        )
        if (
            kernel(np.ndarray((1,), MOTION, memory), state, env, model, NO_ROWS, (steps, events))
            != Status.DONE
        ):
            return None
        now: Any = MotionNumbers._make(WHOLE_RECORD.unpack(memory))
        position, speed = state.tolist()
        count = now.recorded_events
        mode = now.mode
        return motion_of(
            **same,
            system=system,
            time=time_of(now),
            position=position,
            velocity=speed,
            side=0 if mode in (Mode.REST, Mode.CHATTER) else now.side,
            stop=Stop.REST if mode == Mode.REST else Stop.HORIZON,
            chatter_speed=now.chatter_speed if mode == Mode.CHATTER else None,
            periods=now.period,
            events=MotionEvents(now.period_length, labels[:count], values[:count]),
        )

    kept[:] = [motion]


def _first_state(run: Program, start: np.ndarray) -> np.ndarray:
    """Coordinates and velocities, each followed by the tangent's columns, and the shifts."""
    columns = run.structure.sizes.columns
    own = start.size // 2
    if not columns:
        return start.copy()
    unit = np.eye(columns, start.size)  # row j is the initial value of column j
    return np.concatenate(
        [start[:own], unit[:, :own].ravel(), start[own:], unit[:, own:].ravel(), np.zeros(columns)]
    )


def _parts(system: System) -> tuple[Any, Any, Any]:
    """The contacts, frictions and surfaces of a system's model, which may make them anew whenever
    they are asked for.
    """
    model = system.model
    found = system._remembered
    parts: tuple[Any, Any, Any] = found(
        "parts", lambda: (model.contacts, model.frictions, model.surfaces)
    )
    return parts


class ContactState(KernelState):
    """What the kernel changes; the `rows` are the table of parts, in the columns of
    `PartColumn`.
    """

    def _at_contact(self, request: MotionRequest, run: Program) -> tuple[int, int, int]:
        """Fill the rows; the kernel first decides which contacts at rest at their positions stay
        closed.

        Raises
        ------
        ParameterError
            The state lies beyond a contact, or moves into a contact that it is at.
        """
        names = request.system.model.coordinates
        numbers = request.start.tolist()
        position = numbers[: len(names)]
        speeds = numbers[len(names) :]
        own_contacts, own_frictions, surfaces = _parts(request.system)
        held = run.trace.contact_coordinates
        self._count = len(held)
        sided = run.trace.sided
        self.rows = contacts = np.zeros((len(held) + len(sided), NO_ROWS.shape[1]), dtype=np.int64)
        contacts[: len(held), PartColumn.COORDINATE] = held
        for row, part in zip(contacts[len(held) :], sided, strict=True):
            row[PartColumn.KIND] = PartKind[part.kind.upper()]
            row[PartColumn.COORDINATE] = 0 if part.is_function else part.coordinate
            row[PartColumn.PRESSED] = 1 + part.contact
            for column, number in part.marks:
                row[PartColumn[column]] = number
        rates = None
        if run.structure.sizes.multipliers:
            contacts[: len(held), PartColumn.COORDINATE] = NO_COORDINATE
            rates = self._close_rows(request, run, own_contacts)
        for row, contact in zip(contacts[: len(held)], own_contacts, strict=True):
            if rates is not None:
                break
            place = names.index(contact.coordinate)
            gap = contact.gap(position[place])
            rate = contact.sign * speeds[place]
            if gap < 0.0 or (gap == 0.0 and rate < 0.0):
                where = f"{contact.coordinate} = {position[place]:g}"
                what = (
                    f"lies beyond the contact {contact.name!r}"
                    if gap < 0.0
                    else f"moves into the contact {contact.name!r}"
                )
                raise ParameterError(
                    f"{where} {what} at {contact.coordinate} = {float(contact.position):g}",
                    contact.coordinate,
                )
            row[PartColumn.STATE] = int(gap == 0.0 and rate == 0.0)
            row[PartColumn.SKIP] = int(gap == 0.0)
            if gap == 0.0:
                self.state[place] = float(contact.position)
        for k, (row, friction) in enumerate(
            zip(contacts[len(held) :], own_frictions, strict=False)
        ):
            rate = (
                speeds[names.index(friction.coordinate)] - float(friction.ground_speed)
                if rates is None
                else rates[len(held) + k]
            )
            row[PartColumn.STATE] = int(np.sign(rate))
        for k in inert_frictions(request.system, dict.fromkeys(request.sensitivities or (), ())):
            contacts[len(held) + k, PartColumn.PRESSED] = NoPress.INERT
            contacts[len(held) + k, PartColumn.STATE] = Side.OFF
        first = len(held) + len(own_frictions)
        for row, surface in zip(contacts[first : first + len(surfaces)], surfaces, strict=True):
            if surface.function is not None:
                continue
            place = names.index(surface.coordinate)
            row[PartColumn.STATE] = int(
                np.sign(position[place] - float(surface.position)) or np.sign(speeds[place]) or 1
            )
        named = [part.name for part in (*own_frictions, *surfaces)] + [*run.trace.switches]
        self._functions = {len(held) + k: named[k] for k in run.trace.functions}
        for number in self._functions:
            row = contacts[number]
            row[PartColumn.STATE] = Side.ABOVE
            row[PartColumn.STRUCK] = FrictionImpact.JUMPED  # the kernel reads its side
            if sided[number - len(held)].remembered:
                row[PartColumn.STATE] = request.relays[self._functions[number]]
        return Mode.CONTACT, 0, 1  # no release is recorded at the start

    def _close_rows(self, request: MotionRequest, run: Program, contacts: Any) -> np.ndarray:
        """Fill the rows of contacts whose gaps are functions, and return the rates of these gaps,
        then of the frictions' sliding speeds. Gaps and rates count as 0 up to the rounding of their
        terms, or of natural units.

        Raises
        ------
        ParameterError
            The state lies beyond a contact, or moves into a contact that it is at.
        """
        entries, drifts, gaps = contact_rows_at(run, request.time, request.clock.length, self.state)
        position, velocity = np.split(request.start, 2)
        rates: np.ndarray = entries @ velocity + drifts
        length, speed = units_of_gaps(request.system)
        speeds = np.abs(entries) @ np.abs(velocity) + np.abs(drifts) + speed
        rates[np.abs(rates) <= CLOSED_BELOW * speeds] = 0.0
        sizes = np.abs(entries[: len(contacts)]) @ np.abs(position) + length
        for i, (contact, gap) in enumerate(zip(contacts, gaps, strict=True)):
            touches = abs(gap) <= CLOSED_BELOW * sizes[i]
            if (gap < 0.0 and not touches) or (touches and rates[i] < 0.0):
                what = "moves into" if touches else "lies beyond"
                raise ParameterError(
                    f"the state at the start {what} the contact {contact.name!r}, whose gap is"
                    f" {gap:.6g} there and has the rate {rates[i]:.6g}",
                    contact.name,
                )
            self.rows[i, PartColumn.STATE] = int(touches and rates[i] == 0.0)
            self.rows[i, PartColumn.SKIP] = int(touches)
        return rates

    @property
    def touching(self) -> list[int]:
        """The contacts that are closed, or have just been."""
        rows = self.rows[: self._count]
        touches = (rows[:, PartColumn.STATE] == Touch.CLOSED) | (rows[:, PartColumn.SKIP] > 0)
        found: list[int] = np.flatnonzero(touches).tolist()
        return found

    @property
    def undecided(self) -> list[str]:
        """The names of functions whose sides the kernel was choosing."""
        rows = self.rows
        return [
            name
            for row, name in self._functions.items()
            if rows[row, PartColumn.REACHED] == Reached.GUARD
            or (
                rows[row, PartColumn.STRUCK] == FrictionImpact.JUMPED
                and rows[row, PartColumn.SKIP] > 0
            )
        ]

    def _kernel(self) -> Callable[..., int]:
        return load_contacts_kernel()

    def side(self, numbers: Any) -> int:
        """1 plus the bits that `modes_of` reads: the closed contacts, and the directions in which
        frictions slide.
        """
        side: int = numbers.side
        return side


@dataclass(frozen=True)
class RecorderSettings:
    """How much of a motion is kept."""

    # The largest number of steps of a motion that is kept whole; they take about 2 GB.
    steps: int = 10_000_000
    # After so many steps a motion is refused that would need so many times more than are kept.
    seen: int = 500_000
    far: float = 10.0
    events: int = 20_000_000  # The largest number of events that are kept.
    # The most impacts in a unit of time: more are an accumulation that is not resolved.
    rate: int = 1_000_000
    # With several contacts, impacts between two checks of their rate: each takes a pass of the
    # kernel.
    burst: int = 20_000
    buffer: int = 4096  # The steps, and events, that one call of the kernel may record.


MOST = RecorderSettings()


def _is_nonlinear(system: System) -> bool:
    """Whether velocities of the system that was given depend on positions, which events do not
    have, but steps do.
    """
    return getattr(system.model, "is_nonlinear", False)


FIELDS = ("start", "length", "side", "series")


def joined(chunks: list[np.ndarray]) -> np.ndarray:
    """Arrays one after the other; the same array where there is one."""
    return chunks[0] if len(chunks) == 1 else np.concatenate(chunks)


@cache
def no_steps(rows: int, count: int) -> StepBuffers:
    """Buffers into which the kernel writes nothing, for motions of which only the events are
    kept.
    """
    return StepBuffers(
        np.empty((8, 2), dtype=np.int64), np.empty((8, 2)), np.empty((8, rows, count))
    )


class Recorder:
    """Takes the contents of the kernel's buffers whenever these are full.

    With `sample_times` the dense output of each buffer is sampled, checked for validity and
    dropped, so that memory holds only the samples and the events.
    """

    def __init__(self, request: MotionRequest, run: Program, order: int) -> None:
        self._system = request.system
        self._times = request.sample_times
        self._columns = run.structure.sizes.columns
        self._own = run.structure.sizes.own
        self._several = run.structure.several
        self._switches = run.trace.switches
        # what one pass of the kernel may record (`spare_events`)
        parts = run.trace.contact_coordinates, run.trace.sided
        self._spare = 2 * sum(map(len, parts)) if self._several else 0
        self._begin = request.start[: self._own]
        self._drops = not request.dense and request.sample_times is None
        self._bends = _is_nonlinear(request.system)
        self._wide = request.dense and request.sample_times is None and request.dense_tangent
        self._rows = self._own * (1 + self._columns if self._wide else 1), order + 2
        self._keeps_steps = self._bends or not self._drops
        # The numbers of an event before its shifts:
        self._width = 1 + 2 * self._own + len(run.structure.signs) if self._several else 3
        self.total = 0  # events so far
        self._kept = 0  # steps so far
        at = request.clock
        self._length = at.length
        self._start = at.first * at.length + at.local
        self._end = at.last * at.length + at.end
        self._pieces: list[DenseOutput] = []
        self._events: list[tuple[np.ndarray, ...]] = []
        # of the events, if the equations are in coordinates that bend
        self._places: list[np.ndarray] = []
        self._last: DenseOutput | None = None
        self._samples: list[tuple[np.ndarray, ...]] = []
        self._next = 0  # index of the first sample time that is still to come
        periods = (
            request.clock.last - request.clock.first
            if request.clock.length
            else request.clock.end - request.clock.local
        )
        self.make_buffers(min(MOST.buffer, 24 * (2 + int(periods))))

    def make_buffers(self, size: int = MOST.buffer) -> None:
        """Make empty buffers for as many steps, and events."""
        width = self._width + self._columns
        events = size + self._spare
        self.events = EventBuffers(np.empty((events, 4), dtype=np.int64), np.empty((events, width)))
        if self._keeps_steps:
            self.steps = StepBuffers(
                np.empty((size, 2), dtype=np.int64),
                np.empty((size, 2)),
                np.empty((size, *self._rows)),
            )
        else:
            self.steps = no_steps(*self._rows)

    @cached_property
    def _check(self) -> ValidityCheck:
        return ValidityCheck(self._system)

    def take(self, numbers: Any) -> None:
        """Take what the buffers hold."""
        steps = numbers.recorded_steps
        events = numbers.recorded_events
        labels = self.events.event_labels[:events]
        values = self.events.event_values[:events]
        if steps:
            kinds, spans, series = [a[:steps] for a in self.steps]
            series = series.copy() if 2 * steps < len(self.steps.step_series) else series
            self._last = DenseOutput(
                kinds[:, 0] * self._length + spans[:, 0], spans[:, 1], kinds[:, 1], series
            )
            if not self._drops:
                self._add(self._last)
        if self._bends:
            self._places.append(self._positions(labels[:, 0] * self._length + values[:, 0]))
        self._events.append((labels, values))
        self.total += events

    def _positions(self, times: np.ndarray) -> np.ndarray:
        """The own coordinates at events of the last steps, (events, coordinates)."""
        if self._last is None:
            return np.tile(self._begin, (times.size, 1))
        return self._last.states(times)[0][: self._own].T

    def _add(self, piece: DenseOutput) -> None:
        if self._times is None:
            self._pieces.append(piece)
            self._kept += piece.start.size
            self._refuse_too_many(piece)
            if self._kept > MOST.steps:
                raise MotionError(
                    f"more than {MOST.steps} steps before time {piece.end:.6g}, too many to be"
                    " kept; give times=... to keep the states at those times instead, or"
                    " dense=False to keep the events alone"
                )
            self._check_memory(piece)
            return
        self._sample(piece, int(np.searchsorted(self._times, piece.end, side="left")))
        self._check.add(piece)
        self._pieces = [piece]

    def _refuse_too_many(self, piece: DenseOutput) -> None:
        """Refuse a motion that will need far more steps than can be kept, once that is seen."""
        done = piece.end - self._start
        if self._kept > MOST.seen and done > 0.0:
            expected = self._kept * (self._end - self._start) / done
            if expected > MOST.far * MOST.steps:
                raise MotionError(
                    f"the motion would take some {expected:.0e} steps, of which {self._kept} lead"
                    f" to time {piece.end:.6g}, and {MOST.steps} can be kept; ask for a shorter"
                    " time, or give times=... to keep the states at those times instead"
                )

    def _check_memory(self, piece: DenseOutput) -> None:
        """Refuse to keep more steps than there is room for; at the end all of them are copied once.
        Steps of stiff motions are so short that the number of forcing periods says nothing about
        it."""
        size = self._kept / piece.start.size * (piece.series.nbytes + 24 * piece.start.size)
        free = free_memory() if size > LIMITS.any_machine else np.inf
        if size > LIMITS.memory * free:
            raise MotionError(
                f"the steps before time {piece.end:.6g} take {size / 1e9:.3g} GB of memory, and"
                f" {free / 1e9:.3g} GB are left; give times=... to keep the states at those times"
                " instead, or dense=False to keep the events alone"
            )

    def _sample(self, piece: DenseOutput, stop: int) -> None:
        assert self._times is not None
        times = self._times[self._next : stop]
        self._samples.append((times, *piece.states(times)))
        self._next = max(stop, self._next)

    @property
    def is_short(self) -> bool:
        """Whether the events of the motion alone are kept, and were in the buffers of one call of
        the kernel.
        """
        return self._drops and len(self._events) == 1

    def last_hit(self) -> list[int]:
        """The contacts, by number, that the impacts in the last buffer closed."""
        labels = self._events[-1][0]
        bits = np.bitwise_or.reduce(labels[labels[:, 1] == EventCode.IMPACT, 2], initial=0)
        return [i for i in range(len(_parts(self._system)[0])) if bits >> i & 1]

    def all_events(self) -> MotionEvents:
        """All events of the motion."""
        labels, values = (
            self._events[0]
            if len(self._events) == 1
            else [joined([e[i] for e in self._events]) for i in (0, 1)]
        )
        values = values[:, : self._width] if self._columns else values
        if self._several:
            contacts, *others = _parts(self._system)
            names = (
                [part.name for part in contacts],
                [*(part.name for parts in others for part in parts), *self._switches],
            )
            places = joined(self._places) if self._bends else np.empty(0)
            return ContactEvents(self._length, labels, values, names, places)
        return MotionEvents(self._length, labels, values)

    def event_shifts(self) -> np.ndarray:
        """The shift of each event along each column of the tangent, (events, columns); nan where it
        is not known.
        """
        return joined([values[:, self._width :] for _, values in self._events])

    def dense(self) -> DenseOutput | None:
        """The dense output of the motion; None if it was not kept."""
        return self._output(0, self._own)

    def tangent(self) -> DenseOutput | None:
        """That of its columns, the coordinates of one after those of the other; None without any,
        or where they were not kept.
        """
        return (
            self._output(self._own, self._own * (1 + self._columns))
            if self._columns and self._wide
            else None
        )

    def _output(self, first: int, last: int) -> DenseOutput | None:
        if self._times is not None or not self._pieces:
            return None
        if len(self._pieces) > 1:
            self._pieces = [
                DenseOutput(
                    *(
                        np.concatenate([getattr(each, name) for each in self._pieces])
                        for name in FIELDS
                    )
                )
            ]
        (whole,) = self._pieces
        if last - first == whole.series.shape[1]:
            return whole
        return DenseOutput(whole.start, whole.length, whole.side, whole.series[:, first:last])

    def samples(
        self, end: float, position: np.ndarray, velocity: np.ndarray, side: int
    ) -> Samples | None:
        """The states at the sample times up to the end, for which the given state is used; None if
        no samples were asked for.
        """
        if self._times is None:
            return None
        stop = int(np.searchsorted(self._times, end + 1e-15 * abs(end), side="right"))
        if not self._pieces:  # it has no length
            one = np.ones(stop)
            return Samples(
                self._times[:stop], np.outer(position, one), np.outer(velocity, one), side * one
            )
        self._sample(self._pieces[-1], stop)
        samples = Samples(
            *(np.concatenate([chunk[i] for chunk in self._samples], axis=-1) for i in range(4))
        )
        last = samples.time >= end  # known exactly, and after an impact there
        samples.position[:, last] = position[:, None]
        samples.velocity[:, last] = velocity[:, None]
        samples.side[last] = side
        return samples

    def validity(self, duration: float) -> Validity:
        """The validity of the motion, from the steps that were sampled and dropped."""
        return self._check.result(duration)
