"""The result of a simulation: the end state, the events, the dense output, and the validity of the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np

from saltus.checks import check_count, instants
from saltus.errors import ParameterError
from saltus.flow.contacts.modes import modes_of
from saltus.flow.motion.dense_output import DenseOutput
from saltus.flow.motion.stops import Stop
from saltus.flow.motion.validity import Validity, ValidityCheck
from saltus.notebook import html_table
from saltus.public_functions import Numbers
from saltus.result import Result, table_of
from saltus.systems import System

if TYPE_CHECKING:
    import pandas
    import xarray


class EventKind(StrEnum):
    """What happens at an instant of a motion, in the order of the kernel's numbers.

    Examples
    --------
    >>> [str(kind) for kind in saltus.EventKind][:2]
    ['impact', 'grazing']
    """

    IMPACT = "impact"  #: an impact: the gap closes with a speed
    GRAZING = "grazing"  #: the gap touches zero without a speed, to within the working precision
    REST = "rest"  #: the system comes to rest at contact, at once or as the limit of impacts
    RELEASE = "release"  #: the system leaves contact from rest
    CHATTER = "chatter"  #: impacts without loss became too small to follow; the phase is lost from here on
    LIMIT = "limit"  #: a margin reached zero
    HELD = "held"  #: of several contacts, some come to rest as the limit of impacts
    STICK = "stick"  #: a friction changes from sliding to sticking
    SLIP = "slip"  #: a friction changes from sticking to sliding
    REVERSAL = "reversal"  #: a friction slides the other way without having stuck


EVENT_KINDS = tuple(EventKind)  # by the kernel's numbers


@dataclass(frozen=True, slots=True)
class Event:
    """One event: its time, and the velocities before and after it (equal where nothing jumps).

    Attributes
    ----------
    time
        The dimensionless time.
    kind
        What happened.
    side
        The side on which the motion was before it.
    velocity_before
        The velocity just before it.
    velocity_after
        The velocity just after it.

    Examples
    --------
    >>> event = saltus.simulate(system, theta=0.3, periods=1).events[0]
    >>> str(event.kind), event.time > 0
    ('impact', True)
    """

    time: float
    kind: EventKind
    side: int
    velocity_before: float
    velocity_after: float


@dataclass(frozen=True)
class Impacts:
    """The impacts of a motion, as arrays of one length.

    Attributes
    ----------
    time
        The dimensionless times, (n,).
    side
        The sides before the impacts, (n,).
    velocity_before
        The velocities just before the impacts, (n,).
    velocity_after
        The velocities just after the impacts, (n,).

    Examples
    --------
    >>> impacts = saltus.simulate(system, theta=0.3, periods=2).impacts
    >>> bool(np.all(np.diff(impacts.time) > 0)), len(impacts) == len(impacts.velocity_before)
    (True, True)
    """

    time: np.ndarray
    side: np.ndarray
    velocity_before: np.ndarray
    velocity_after: np.ndarray

    def __len__(self) -> int:
        return self.time.size


class MotionEvents(Sequence[Event]):
    """The events of a motion in order of time, made one by one from the kernel's arrays."""

    def __init__(self, times: np.ndarray, labels: np.ndarray, values: np.ndarray) -> None:
        self.times = times  # (n,)
        self._labels, self._values = labels, values

    def __len__(self) -> int:
        return int(self.times.size)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Event]: ...
    def __getitem__(self, index: Any) -> Any:
        return self._only(index) if isinstance(index, slice) else self._event(index)

    def _only(self, chosen: Any) -> Self:
        return type(self)(self.times[chosen], self._labels[chosen], self._values[chosen])

    def _event(self, index: int) -> Any:
        kind, side = self._labels[index, 1:3]
        before, after = self._values[index, 1:].tolist()
        return Event(float(self.times[index]), EVENT_KINDS[kind], int(side), before, after)

    def __repr__(self) -> str:
        counts = {kind.value: int(np.sum(self._labels[:, 1] == i)) for i, kind in enumerate(EVENT_KINDS)}
        return f"MotionEvents({', '.join(f'{n} {kind}' for kind, n in counts.items() if n)})"

    def of(self, kind: EventKind) -> Self:
        """The events of one kind."""
        return self._only(self._labels[:, 1] == EVENT_KINDS.index(kind))

    @property
    def codes(self) -> np.ndarray:
        """(n, 2): the number of each kind in the order of `EventKind`, and the side, or the contacts and frictions as bits."""
        return self._labels[:, 1:3]

    @property
    def details(self) -> np.ndarray:
        """The detail that the kernel recorded with each event, see `kernel/memory_layout.py`; for a limit the number of the
        margin."""
        return self._labels[:, 3]

    def impacts(self) -> Impacts:
        """The impacts, as arrays."""
        impacts = self.of(EventKind.IMPACT)
        labels, values = impacts._labels, impacts._values
        return Impacts(impacts.times, labels[:, 2].astype(np.int8), values[:, 1], values[:, 2])


@dataclass(frozen=True, eq=False)
class Samples:
    """States at given times: `time` (n,), `position` and `velocity` (degrees of freedom, n), `side` (n,), 0 at rest."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    side: np.ndarray


@dataclass(frozen=True, eq=False)
class Motion(Result):
    """An exact motion of a system.

    The coordinate at the end has the model's own name: `motion.theta`, or `motion.x` for a wall oscillator. `motion.position` has
    all coordinates. With several degrees of freedom positions and velocities are tuples.

    Attributes
    ----------
    system
        What moved.
    tol
        The error that one step might make.
    start
        The dimensionless time at which it began.
    time
        The dimensionless time at its end.
    position
        The coordinate at the end; a tuple where there are several.
    velocity
        The velocity at the end; a tuple where there are several coordinates.
    side
        The side at the end: +1 or -1, and 0 at rest; for a model with contacts or frictions a number that encodes `closed` and
        `sliding`.
    stop
        Why it ended.
    limit
        The margin that stopped it.
    chatter_speed
        If the motion ends in chatter, the rate of the gap just after impacts on `side`; the state is then given as at rest.
    periods
        The whole forcing periods since time 0.
    events
        All events, in the order of time.
    impacts
        The impacts among them, as arrays.
    dense
        The Taylor series of all its steps; None where they were not kept.
    kept
        The states at the times that `simulate(times=...)` was given.
    sampled_validity
        The validity of a motion with `kept` samples.

    Examples
    --------
    >>> motion = saltus.simulate(system, theta=0.3, periods=5)
    >>> len(motion.impacts), motion.at([0.0])[0]
    (9, array([0.3]))
    """

    system: System
    tol: float
    start: float
    time: float
    position: Any
    velocity: Any
    side: int
    stop: Stop
    limit: str | None
    chatter_speed: float | None
    periods: int
    events: MotionEvents
    impacts: Impacts
    dense: DenseOutput | None
    kept: Samples | None
    sampled_validity: Validity | None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "system" or name not in self.system.model.coordinates:
            raise AttributeError(f"a Motion has no {name!r}")
        position = np.atleast_1d(self.position)
        return float(position[self.system.model.coordinates.index(name)])

    def __repr__(self) -> str:
        names = self.system.model.coordinates
        state = ", ".join(f"{n}={x:.12g}" for n, x in zip(names, np.atleast_1d(self.position), strict=True))
        where = f"{self.stop.value} ({self.limit})" if self.limit else self.stop.value
        return f"Motion(time={self.time:.12g}, {state}, velocity={self.velocity}, impacts={len(self.impacts)}, stop={where})"

    @property
    def final_state(self) -> np.ndarray:
        """The state at the end, coordinates and then velocities, (d,)."""
        return np.append(self.position, self.velocity)

    @property
    def closed(self) -> tuple[str, ...]:
        """The contacts that are closed at the end, of a model with several."""
        return tuple(contact.name for i, contact in enumerate(self.system.model.contacts) if (self.side - 1) >> i & 1)

    @property
    def sliding(self) -> dict[str, int]:
        """The direction in which each friction slides at the end, 0 where it sticks, of a model with frictions."""
        model = self.system.model
        _, slides = modes_of(model, np.array(self.side))
        return {friction.name: int(s) for friction, s in zip(model.frictions, slides, strict=True)}

    def closed_at(self, time: float) -> int:
        """The contacts that are closed just after a time, of a model with several: the sum of 2^i over them.

        Parameters
        ----------
        time
            The dimensionless time.
        """
        if not self.start <= time <= self.time:
            raise ParameterError(f"time must lie in [{self.start:g}, {self.time:g}], the span of the motion", "time")
        return int(modes_of(self.system.model, self._states(np.array([time]))[2])[0][0])

    @property
    def rest_time(self) -> float | None:
        """The time from which the system rests until the end, or None."""
        if self.stop is not Stop.REST:
            return None
        return self.events.of(EventKind.REST)[-1].time

    @property
    def phase_known(self) -> bool:
        """Whether the phase is exact: False once impacts without loss were averaged (see `EventKind.CHATTER`)."""
        return len(self.events.of(EventKind.CHATTER)) == 0

    def at(self, times: Numbers) -> tuple[Any, Any]:
        """Coordinate and velocity at any times of the motion, at the method's accuracy; at an impact, the values after it.

        Parameters
        ----------
        times
            A number or an array (n,) of dimensionless times.

        Returns
        -------
        tuple[Any, Any]
            Two floats for one time, two arrays (n,) for n times; (degrees of freedom, n) where there are several.

        Raises
        ------
        ParameterError
            A time lies outside the motion, or the motion was computed with dense=False.
        """
        position, velocity, _ = self._states(instants(times))
        if len(self.system.model.coordinates) == 1:
            position, velocity = position[0], velocity[0]
        if np.ndim(times) == 0:
            return (float(position[0]), float(velocity[0])) if position.ndim == 1 else (position[:, 0], velocity[:, 0])
        return position, velocity

    def _states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if self.dense is None and self.time > self.start:
            raise ParameterError(
                "this motion was not kept densely: only its end, its events and what it `kept` are known", "times"
            )
        slack = 1e-12 * max(1.0, abs(self.time))
        if times.size and not (times.min() >= self.start - slack and times.max() <= self.time + slack):
            raise ParameterError(f"times must lie in [{self.start:g}, {self.time:g}], the span of the motion", "times")
        if self.dense is None:
            position, velocity = np.atleast_1d(self.position), np.atleast_1d(self.velocity)
            tile = np.ones(times.size)
            return position[:, None] * tile, velocity[:, None] * tile, self.side * tile
        position, velocity, side = self.dense.states(times)
        end = times >= self.time  # the end itself is known exactly, and after an impact there
        position[:, end], velocity[:, end] = np.reshape(self.position, (-1, 1)), np.reshape(self.velocity, (-1, 1))
        side[end] = self.side
        return position, velocity, side

    @cached_property
    def validity(self) -> Validity:
        """The margins of the model that the motion passes, and for what share of the time (errata 20, 21).

        Raises
        ------
        ParameterError
            The motion was computed with dense=False and without samples.
        """
        found = self.sampled_validity
        if found is None:
            if self.dense is None and self.time > self.start:
                raise ParameterError("a motion computed with dense=False has no validity; leave dense out, or give times=...")
            check = ValidityCheck(self.system)
            if self.dense is not None:
                check.add(self.dense)
            found = check.result(self.time - self.start)
        if self.limit is None or found.first.get(self.limit, self.time) is not None:
            return found
        return replace(found, first=found.first | {self.limit: self.time})  # it ended at the very instant

    def samples(self, count: int) -> Samples:
        """States at evenly spaced times over the motion, its start and its end included.

        Parameters
        ----------
        count
            The number of states, at least 2.

        Raises
        ------
        ParameterError
            `count` is less than 2, or the motion was computed with dense=False.
        """
        check_count("count", count, 2)
        times = np.linspace(self.start, self.time, int(count))
        return Samples(times, *self._states(times))

    def to_pandas(self, times: Numbers | None = None) -> pandas.DataFrame:
        """Coordinates, velocities and the side over the index `time`, at the times of `to_xarray`.

        Parameters
        ----------
        times
            Dimensionless times, (n,).
        """
        return table_of(self.to_xarray(times))

    def _repr_html_(self) -> str:
        names = self.system.model.coordinates
        state = dict(zip(names, np.atleast_1d(self.position).tolist(), strict=True))
        facts = {"time": self.time, **state, "velocity": self.velocity, "impacts": len(self.impacts), "stop": self.stop.meaning}
        return html_table(f"Motion of {type(self.system.model).__name__}", facts | ({"margin": self.limit} if self.limit else {}))

    def to_xarray(self, times: Numbers | None = None) -> xarray.Dataset:
        """The motion as a dataset with units and provenance; by default at the times of its samples, else at 200 times in a
        forcing period, or 2000 in all without a forcing.

        Parameters
        ----------
        times
            Dimensionless times, (n,).
        """
        from saltus.flow.motion.dataset import to_dataset

        return to_dataset(self, times)
