"""The result of a simulation: the end state, the events, the dense output, and the validity of the
motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Numbers, check_count, instants, with_answers
from saltus.errors import ParameterError, near, shown
from saltus.flow.motion.events import (
    EventKind,
    Impacts,
    MotionEvents,
    Stop,
    masks_of,
    modes_of,
    type_of_bits,
)
from saltus.flow.motion.validity import DenseOutput, Validity, ValidityCheck
from saltus.progress import html_table
from saltus.result import Result, function_for, provenance, table_of
from saltus.systems import System

if TYPE_CHECKING:
    import pandas
    import xarray

MOST_SHOWN = 8  # coordinates in the printed form of a motion
PERIOD_SAMPLES = 200  # samples in a forcing period if no times are given


# Of a step, where velocities are looked at, up to the impact that may end it.
SHARES = np.append(np.arange(8) / 8, 1.0 - 2.0**-30)


@dataclass(frozen=True, eq=False)
class Samples:
    """States at given times: `time` (n,), `position` and `velocity` (degrees of freedom, n), `side`
    (n,), 0 at rest.
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    side: np.ndarray


HAS = "it has time, final_state, at(t), samples(n), events and impacts, too"


@with_answers
@dataclass(frozen=True, eq=False)
class Motion(Result):
    """An exact motion of a system.

    The coordinate at the end has the model's own name: `motion.theta`, or `motion.x` for a wall
    oscillator. `motion.position` has all coordinates. With several degrees of freedom positions and
    velocities are tuples.

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
        The side at the end: +1 or -1, and 0 at rest; for a model with contacts or frictions a
        number that encodes `closed` and `sliding`.
    stop
        Why it ended.
    limit
        The margin that stopped it.
    chatter_speed
        If the motion ends in chatter, the rate of the gap just after impacts on `side`; the state
        is then given as at rest.
    periods
        The whole forcing periods since time 0.
    events
        All events, in the order of time.
    dense
        The Taylor series of all its steps, in `system.in_gap_coordinates`; None where they were not
        kept.
    kept
        The states at the times that `simulate(times=...)` was given.
    sampled_validity
        The validity of a motion with `kept` samples.
    ties
        How often several answers of Coulomb's law changed equally little, see `validity`.
    first_tie
        The first time at which they did.

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
    dense: DenseOutput | None
    kept: Samples | None
    sampled_validity: Validity | None
    ties: int = 0
    first_tie: float | None = None

    def __getattr__(self, name: str) -> Any:
        known = () if name.startswith("_") or name == "system" else self.system.model.coordinates
        if name not in known:
            hint = function_for(name, "motion") or (
                f"; {near(name, known)}; {HAS}" if known else ""
            )
            raise AttributeError(f"a Motion has no {name!r}{hint}")
        return self.position[known.index(name)] if len(known) > 1 else self.position

    def __repr__(self) -> str:
        names = self.system.model.coordinates
        numbers = zip(names, np.atleast_1d(self.position), strict=True)
        shown = [f"{name}={x:.12g}" for name, x in islice(numbers, MOST_SHOWN)]
        velocity = self.velocity
        if len(names) > MOST_SHOWN:
            shown.append(f"... {len(names) - MOST_SHOWN} more")
            first = ", ".join(repr(v) for v in velocity[:MOST_SHOWN])
            velocity = f"({first}, ...)"
        where = f"{self.stop.value} ({self.limit})" if self.limit else self.stop.value
        return (
            f"Motion(time={self.time:.12g}, {', '.join(shown)}, velocity={velocity}, "
            f"impacts={len(self.impacts)}, stop={where})"
        )

    @cached_property
    def impacts(self) -> Impacts:
        """The impacts among the events, as arrays."""
        return self.events.impacts()

    @property
    def final_state(self) -> np.ndarray:
        """The state at the end, coordinates and then velocities, (d,)."""
        return np.append(self.position, self.velocity)

    @property
    def closed(self) -> tuple[str, ...]:
        """The contacts that are closed at the end, of a model with several."""
        return tuple(
            contact.name
            for i, contact in enumerate(self.system.model.contacts)
            if (self.side - 1) >> i & 1
        )

    @property
    def sliding(self) -> dict[str, int]:
        """The direction in which each friction slides at the end, 0 where it sticks, of a model
        with frictions.
        """
        model = self.system.model
        _, slides, _ = modes_of(model, np.array(self.side))
        return {friction.name: int(s) for friction, s in zip(model.frictions, slides, strict=True)}

    @property
    def sides(self) -> dict[str, int]:
        """The side of each surface at the end, +1 or -1, of a model with surfaces."""
        model = self.system.model
        return {
            each.name: int(s)
            for each, s in zip(model.surfaces, modes_of(model, np.array(self.side))[2], strict=True)
        }

    def closed_at(self, time: float) -> int:
        """The contacts that are closed just after a time, of a model with several: the sum of 2^i
        over them.

        Parameters
        ----------
        time
            The dimensionless time.
        """
        if not self.start <= time <= self.time:
            raise ParameterError(
                f"time must lie in [{self.start:g}, {self.time:g}], the span of the motion", "time"
            )
        return int(modes_of(self.system.model, self._states(np.array([time]))[2])[0][0])

    @property
    def rest_time(self) -> float | None:
        """The time from which the system rests until the end, or None."""
        if self.stop is not Stop.REST:
            return None
        return self.events.of(EventKind.REST)[-1].time

    @property
    def phase_known(self) -> bool:
        """Whether the phase is exact: False once impacts without loss were averaged (see
        `EventKind.CHATTER`).
        """
        return len(self.events.of(EventKind.CHATTER)) == 0

    def at(self, times: Numbers) -> tuple[Any, Any]:
        """Coordinate and velocity at any times of the motion, at the method's accuracy; at an
        impact, the values after it.

        Parameters
        ----------
        times
            A number or an array (n,) of dimensionless times.

        Returns
        -------
        tuple[Any, Any]
            Two floats for one time, two arrays (n,) for n times; (degrees of freedom, n) where
            there are several.

        Raises
        ------
        ParameterError
            A time lies outside the motion, or the motion was computed with dense=False.
        """
        position, velocity, _ = self._states(instants(times))
        if len(self.system.model.coordinates) == 1:
            position, velocity = position[0], velocity[0]
        if np.ndim(times) == 0:
            return (
                (float(position[0]), float(velocity[0]))
                if position.ndim == 1
                else (position[:, 0], velocity[:, 0])
            )
        return position, velocity

    def _check_times(self, times: np.ndarray) -> None:
        """Refuse times of which the motion has no states."""
        if self.dense is None and self.time > self.start:
            raise ParameterError(
                (
                    "this motion has no dense output: it stores its end, its events and the "
                    "states in `kept` alone"
                ),
                "times",
            )
        slack = 1e-12 * max(1.0, abs(self.time))
        if times.size and not (
            times.min() >= self.start - slack and times.max() <= self.time + slack
        ):
            raise ParameterError(
                f"times must lie in [{self.start:g}, {self.time:g}], the span of the motion",
                "times",
            )

    def _states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self._check_times(times)
        if self.dense is None:
            position = np.atleast_1d(self.position)
            velocity = np.atleast_1d(self.velocity)
            tile = np.ones(times.size)
            return position[:, None] * tile, velocity[:, None] * tile, self.side * tile
        position, velocity, side = self.dense.states(times)
        position, velocity = self.system.from_gaps(times, position, velocity)
        end = times >= self.time  # the end itself is known exactly, and after an impact there
        position[:, end] = np.reshape(self.position, (-1, 1))
        velocity[:, end] = np.reshape(self.velocity, (-1, 1))
        side[end] = self.side
        return position, velocity, side

    @cached_property
    def extrema(self) -> np.ndarray:
        """The least and the largest value of each coordinate, (degrees of freedom, 2).

        Raises
        ------
        ParameterError
            The motion was computed with dense=False.
        """
        found: np.ndarray = self.extrema_between(np.array([self.start, self.time]))[0]
        return found

    def extrema_between(self, times: Numbers) -> np.ndarray:
        """The least and the largest value of each coordinate between every two neighbours of times
        in ascending order.

        Parameters
        ----------
        times
            Dimensionless times of the motion, (n,).

        Returns
        -------
        np.ndarray
            Of shape (n - 1, degrees of freedom, 2).

        Raises
        ------
        ParameterError
            A time lies outside the motion, the times do not ascend, or the motion was computed with
            dense=False.
        """
        bounds = instants(times)
        if len(bounds) < 2 or (np.diff(bounds) < 0.0).any():
            raise ParameterError(
                f"times must be at least two in ascending order, got {shown(times)}", "times"
            )
        return self._extrema_between(bounds, self._states)

    def range_of(self, displacement: str) -> tuple[float, float]:
        """The least and the largest value of a coordinate, or of a named point of a `Structure`.

        Parameters
        ----------
        displacement
            The name of the coordinate or the point.

        Raises
        ------
        ParameterError
            Nothing is called so, or the motion was computed with dense=False.
        """
        model = self.system.model
        if displacement in model.coordinates:
            low, high = self.extrema[model.coordinates.index(displacement)].tolist()
            return low, high
        weights = model.weights_of(displacement)
        if weights is None:
            known = (*model.coordinates, *model.point_names)
            raise ParameterError(
                f"there is no displacement {shown(displacement)}; {near(str(displacement), known)}",
                "displacement",
            )

        def moved(times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            position, velocity, side = self._states(times)
            return (weights @ position)[None], (weights @ velocity)[None], side

        ends = np.array([self.start, self.time])
        low, high = self._extrema_between(ends, moved)[0, 0].tolist()
        return low, high

    def _extrema_between(
        self,
        bounds: np.ndarray,
        states: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]],
    ) -> np.ndarray:
        """`extrema_between` of displacements, of which `states` gives positions, velocities and
        sides at times."""
        self._check_times(bounds)
        steps = (
            [] if self.dense is None else [self.dense.start, self.dense.start + self.dense.length]
        )
        edges = np.unique(np.clip(np.concatenate([bounds, *steps]), bounds[0], bounds[-1]))
        seen = edges[:-1, None] + SHARES * np.diff(edges)[:, None]
        position, velocity, _ = states(np.append(seen.ravel(), bounds))
        at_bounds = position[:, seen.size :].T
        rate = velocity[:, : seen.size].reshape(len(velocity), *seen.shape)
        within = np.searchsorted(bounds, edges[:-1], side="right") - 1
        inner = position[:, : seen.size].reshape(rate.shape).transpose(1, 2, 0)
        found = [
            np.minimum(at_bounds[:-1], at_bounds[1:]),
            np.maximum(at_bounds[:-1], at_bounds[1:]),
        ]
        for extremum, values in zip((np.minimum, np.maximum), found, strict=True):
            extremum.at(values, within, extremum.reduce(inner, axis=1))
        place, step, sample = np.nonzero(rate[:, :, :-1] * rate[:, :, 1:] < 0.0)
        low = seen[step, sample]
        high = seen[step, sample + 1]
        row = within[step]
        near = inner[step, sample, place]
        fastest = np.abs(rate[place, step, sample]) + np.abs(rate[place, step, sample + 1])
        # at least twice as far as it goes from the first of both times
        reach = (high - low) * fastest
        # the others are not the outermost
        last = (near - reach < found[0][row, place]) | (near + reach > found[1][row, place])
        turned = _turned(states, place[last], low[last], high[last])
        for extremum, values in zip((np.minimum, np.maximum), found, strict=True):
            extremum.at(values, (row[last], place[last]), turned)
        return np.stack(found, axis=-1)

    @cached_property
    def validity(self) -> Validity:
        """The margins of the model that the motion passes, and for what share of the time (errata
        20, 21).

        Raises
        ------
        ParameterError
            The motion was computed with dense=False and without samples.
        """
        found = self.sampled_validity
        if found is None:
            if self.dense is None and self.time > self.start:
                raise ParameterError(
                    "a motion computed with dense=False has no validity; leave dense out, or "
                    "give times=..."
                )
            check = ValidityCheck(self.system.in_gap_coordinates)
            if self.dense is not None:
                check.add(self.dense)
            found = check.result(self.time - self.start)
        together = self.events.closed_together()
        if self.ties or together:
            found = replace(
                found,
                ties=self.ties,
                first_tie=self.first_tie,
                together=len(together),
                first_together=together[0] if together else None,
            )
        if self.limit is None or found.first.get(self.limit, self.time) is not None:
            return found
        # it ended at the very instant
        return replace(found, first=found.first | {self.limit: self.time})

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
        facts = {
            "time": self.time,
            **state,
            "velocity": self.velocity,
            "impacts": len(self.impacts),
            "stop": self.stop.meaning,
        }
        return html_table(
            f"Motion of {type(self.system.model).__name__}",
            facts | ({"margin": self.limit} if self.limit else {}),
        )

    def to_xarray(self, times: Numbers | None = None) -> xarray.Dataset:
        """The motion as a dataset with units and provenance; by default at the times of its
        samples, else at 200 times in a forcing period, or 2000 in all without a forcing.

        Parameters
        ----------
        times
            Dimensionless times, (n,).
        """
        return to_dataset(self, times)


def motion_of(**fields: Any) -> Motion:
    """A motion of all its fields.

    What a frozen dataclass does to set them one by one takes longer than a short motion.
    """
    motion = object.__new__(Motion)
    vars(motion).update(fields)
    return motion


def in_own_coordinates(system: System, motion: Motion) -> Motion:
    """The motion of a system, from that of `system.in_gap_coordinates`; the same object where that
    is the system itself.
    """
    if motion.system is system:
        return motion
    position, velocity = system.from_gaps(motion.time, motion.position, motion.velocity)
    one = len(position) == 1
    kept = motion.kept
    return replace(
        motion,
        system=system,
        position=float(position[0]) if one else tuple(position.tolist()),
        velocity=float(velocity[0]) if one else tuple(velocity.tolist()),
        events=motion.events.in_own_coordinates(system),
        kept=kept
        and Samples(
            kept.time, *system.from_gaps(kept.time, kept.position, kept.velocity), kept.side
        ),
    )


# --- as a dataset ------------------------------------------------------------


def to_dataset(motion: Motion, times: Any = None) -> xarray.Dataset:
    """The sampled states over `time` and the impacts over `impact`; the attributes hold all that is
    needed to repeat the motion."""
    import xarray

    period = motion.system.load.period
    if times is None and motion.kept is not None:
        times, position, velocity, side = (
            getattr(motion.kept, n) for n in ("time", "position", "velocity", "side")
        )
    else:
        times = _default_times(motion, period) if times is None else instants(times)
        position, velocity, side = motion._states(times)
    names = motion.system.model.coordinates
    dataset = xarray.Dataset(
        coords={"time": ("time", times, {"units": "1", "long_name": "dimensionless time tau"})}
    )
    for i, name in enumerate(names):
        unit = motion.system.model.unit_of(name)
        dataset[name] = ("time", position[i], {"units": unit})
        dataset[rate_name(name, names)] = (
            "time",
            velocity[i],
            {"units": unit, "long_name": f"d {name} / d tau"},
        )
    if motion.system.model.holds_coordinates:
        _add_contacts(motion, dataset, side)
    else:
        dataset["side"] = (
            "time",
            side.astype(np.int8),
            {"units": "1", "long_name": "side, 0 at rest"},
        )
        for name in ("time", "velocity_before", "velocity_after"):
            unit = "1" if name == "time" else motion.system.model.unit_of(names[0])
            dataset[f"impact_{name}"] = ("impact", getattr(motion.impacts, name), {"units": unit})
    dataset.attrs = {"title": "motion computed by saltus", "kind": "motion"} | provenance(
        motion.system, tol=motion.tol
    )
    dataset.attrs |= {
        "stop": motion.stop.value + (f" ({motion.limit})" if motion.limit else ""),
        "end_time": motion.time,
        "phase_known": str(motion.phase_known),
        "validity": str(motion.validity) if motion.dense or motion.sampled_validity else "not kept",
        "Conventions": "CF-1.8",
    }
    if motion.rest_time is not None:
        dataset.attrs["rest_time"] = motion.rest_time
    return dataset


def _add_contacts(motion: Motion, dataset: xarray.Dataset, side: np.ndarray) -> None:
    """Add the closed contacts, the directions of frictions, and the impacts: times, contacts,
    positions and velocities.
    """
    model = motion.system.model
    impacts = motion.impacts
    names = model.coordinates
    contacts = [contact.name for contact in model.contacts]
    flags = {"units": "1"} | masks_of(contacts)
    closed, slides, sides = modes_of(model, side)
    for friction, direction in zip(model.frictions, slides, strict=True):
        text = f"direction in which {friction.name} slides, 0 where it sticks"
        opens = "its contact is open or " * (friction.contact is not None)
        text += f", 2 where {opens}its coefficients are 0"
        dataset[f"sliding_{friction.name}"] = (
            "time",
            direction.astype(np.int8),
            {"units": "1", "long_name": text},
        )
    for surface, beside in zip(model.surfaces, sides, strict=True):
        text = f"side of the surface {surface.name}"
        dataset[f"side_{surface.name}"] = (
            "time",
            beside.astype(np.int8),
            {"units": "1", "long_name": text},
        )
    if not contacts:
        return
    dataset["closed_contacts"] = (
        "time",
        closed.astype(type_of_bits(len(contacts))),
        flags | {"long_name": "contacts that are closed"},
    )
    dataset["impact_time"] = ("impact", impacts.time, {"units": "1"})
    dataset["impact_contacts"] = (
        "impact",
        impacts.side,
        flags | {"long_name": "contacts that were hit"},
    )
    position = np.full((len(names), len(impacts)), np.nan)
    if motion.dense is not None and len(impacts):
        position = motion._states(impacts.time)[0]
    for i, name in enumerate(names):
        unit = {"units": model.unit_of(name)}
        dataset[f"impact_{name}"] = ("impact", position[i], unit)
        for when, velocity in (
            ("before", impacts.velocity_before),
            ("after", impacts.velocity_after),
        ):
            jumping = name if name in model.first_order else rate_name(name, names)
            dataset[f"impact_{jumping}_{when}"] = ("impact", velocity[:, i], unit)


def rate_name(name: str, names: tuple[str, ...]) -> str:
    """The name of the velocity of a coordinate."""
    return "velocity" if len(names) == 1 else f"{name}_velocity"


def _default_times(motion: Motion, period: float | None) -> np.ndarray:
    count = (
        10 * PERIOD_SAMPLES
        if period is None
        else int(np.ceil(PERIOD_SAMPLES * (motion.time - motion.start) / period))
    )
    return np.linspace(motion.start, motion.time, max(2, count + 1))


def state_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names of the state variables, coordinates and then velocities, of a model with these
    coordinates.
    """
    return *names, *(rate_name(name, names) for name in names)


def _turned(
    states: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]],
    place: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    """Coordinates, by their places, where their velocities are 0 between two times at which
    these have different signs, (n,) each: by regula falsi, in which the value at an end that
    stays is halved. A coordinate's error is the square of that of the time."""
    each = np.arange(len(place))
    a, b = (states(times)[1][place, each] for times in (low, high))
    for _ in SHARES:
        middle = low - a * (high - low) / np.where(a == b, 1.0, b - a)
        now = states(middle)[1][place, each]
        same = now * b > 0.0  # the root lies before
        a, b = np.where(same, 0.5 * a, now), np.where(same, now, 0.5 * b)
        low, high = np.where(same, low, middle), np.where(same, middle, high)
    return states(middle)[0][place, each] if low.size else low
