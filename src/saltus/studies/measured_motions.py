"""Measured motions, and how far the motions of a system are from them, with exact derivatives
through every impact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.checks import as_numbers, check_number, with_answers
from saltus.errors import MotionError, ParameterError, near, shown
from saltus.flow import MotionRequest, Sensitivities, derivatives_of, state_names
from saltus.systems import System

START = "start."  # of the names of unknowns of the start
IMPACTS = "impacts"  # the quantity of measured impact times
Function = Callable[[Any, Any, Any], Any]
Unknowns = Mapping[str, float]


@with_answers
@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """One record of a motion: what was measured, how exactly, and how the motion began.

    Parameters
    ----------
    start
        The state at the start by the names of the model, {"theta": 0.3, "velocity": 0.0}, and its
        `time` (0); velocities that are not given are 0.
    time
        The dimensionless times of the samples, (n,), increasing.
    values
        The measured values at these times by quantity: a state variable ("theta", "velocity"), an
        acceleration ("acceleration", or "x_acceleration" with several coordinates), or a name in
        `functions` of `fit`. nan stands for what is missing.
    sigma
        The standard deviation of the noise, a number or one for each quantity; None where it is not
        known, and estimated.
    impacts
        The times of the first impacts, (m,), increasing.
    impact_sigma
        The standard deviation of the noise of these times.
    changes
        What is different from the system in this record, by dotted path: {"load.frequency": 1.2}.

    Examples
    --------
    >>> times = np.linspace(0.0, 1.0, 5)
    >>> record = saltus.Measurement(start={"theta": 0.3}, time=times, values={"theta": 0.3 - 0.1 * times**2}, sigma=1e-3)
    >>> record.quantities
    ('theta',)
    """

    start: Mapping[str, float]
    time: Any = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    sigma: Any = None
    impacts: Any = ()
    impact_sigma: float | None = None
    changes: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("time", "impacts"):
            given = getattr(self, name)
            is_array = isinstance(given, np.ndarray)
            empty = (
                given.shape == (0,) if is_array else isinstance(given, (list, tuple)) and not given
            )
            times = np.empty(0) if empty else np.ravel(as_numbers(given, name))
            if not empty and not times.size:
                raise ParameterError(f"{name} must be increasing numbers, got {shown(given)}", name)
            if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
                raise ParameterError(
                    f"{name} must be increasing numbers, got {shown(getattr(self, name))}", name
                )
            object.__setattr__(self, name, times)
        for name in ("start", "values", "changes"):
            given = getattr(self, name)
            if not isinstance(given, Mapping):
                raise ParameterError(f"{name} must be a dict by name, got {shown(given)}", name)
        for sigma in self.sigma.values() if isinstance(self.sigma, Mapping) else (self.sigma,):
            if sigma is not None:
                check_number("sigma", sigma, above=0.0)
        values = {name: as_numbers(column, "values") for name, column in self.values.items()}
        for name, column in values.items():
            if column.shape != self.time.shape:
                raise ParameterError(
                    f"values[{name!r}] must be one number for each of {self.time.size} times",
                    "values",
                )
        object.__setattr__(self, "values", values)
        if not self.quantities:
            raise ParameterError(
                "a Measurement needs values at times, or the times of impacts", "values"
            )
        for name, sigma in (
            ("impact_sigma", self.impact_sigma),
            *(("sigma", self.sigma_of(q)) for q in values),
        ):
            if sigma is not None:
                check_number(name, sigma, above=0.0)

    @property
    def quantities(self) -> tuple[str, ...]:
        """What was measured, with "impacts" for the times of impacts."""
        return (*self.values, *([IMPACTS] if self.impacts.size else []))

    @property
    def begin(self) -> float:
        """The time at the start."""
        return float(self.start.get("time", 0.0))

    @property
    def end(self) -> float:
        """The last time at which something was measured."""
        return float(max(self.time.max(initial=self.begin), self.impacts.max(initial=self.begin)))

    def sigma_of(self, quantity: str) -> float | None:
        """The standard deviation of a quantity, or None.

        Parameters
        ----------
        quantity
            One of `quantities`.
        """
        if quantity == IMPACTS:
            return self.impact_sigma
        sigma = self.sigma.get(quantity) if isinstance(self.sigma, Mapping) else self.sigma
        return None if sigma is None else float(sigma)


@dataclass(frozen=True)
class Compared:
    """A motion beside a measurement, one entry for each number that was measured: (n,), the
    derivatives (n, unknowns).
    """

    quantity: list[str]
    time: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    sigma: np.ndarray
    slopes: np.ndarray

    @property
    def residuals(self) -> np.ndarray:
        """What the motion misses, in standard deviations."""
        return np.asarray((self.model - self.measured) / self.sigma)

    @property
    def jacobian(self) -> np.ndarray:
        """The derivatives of the residuals, 0 where the motion has none."""
        return np.asarray(
            np.where(np.isfinite(self.slopes), self.slopes, 0.0) / self.sigma[:, None]
        )


@dataclass(frozen=True)
class MeasuredMotions:
    """Measurements of a system with unknown numbers: its own by dotted path, and of the starts by
    "start.theta".
    """

    system: System
    measurements: tuple[Measurement, ...]
    unknowns: tuple[str, ...]
    functions: Mapping[str, Function]
    tol: float

    def beside(self, i: int, values: Unknowns, until: float = np.inf) -> Compared:
        """The motion of the system with these unknowns beside measurement `i`, up to a time."""
        result, place = self.motion(i, values, until)
        columns = np.array([place.get(name, -1) for name in self.unknowns])
        parts = list(self._parts(self.measurements[i], result, until))
        slopes = np.concatenate([part[-1] for part in parts])
        time, measured, model, sigma = (
            np.concatenate([part[k] for part in parts]) for k in range(1, 5)
        )
        quantity = [name for name, times, *_ in parts for _ in range(times.size)]
        return Compared(
            quantity, time, measured, model, sigma, np.where(columns < 0, 0.0, slopes[:, columns])
        )

    def motion(
        self, i: int, values: Unknowns, until: float = np.inf
    ) -> tuple[Sensitivities, dict[str, int]]:
        """The motion of measurement `i` with its derivatives, and the column of each unknown on
        which it depends.
        """
        record = self.measurements[i]
        names = state_names(self.system.model.coordinates)
        paths = tuple(name for name in self.unknowns if not name.startswith(START))
        system = self.system.with_({**record.changes, **{path: values[path] for path in paths}})
        start = {name: float(record.start.get(name, 0.0)) for name in names}
        place = {path: len(names) + j for j, path in enumerate(paths)}
        for name, own in self._starts(i):
            start[own], place[name] = values[name], names.index(own)
        result = _followed(system, start, paths, record, min(until, record.end), self.tol)
        columns = np.hstack([result.state, result.parameters])[:, list(place.values())]
        if result.undefined is not None and not np.isfinite(columns).all():
            raise MotionError(f"the motion has no derivatives to fit it by: {result.undefined}")
        return result, place

    def _starts(self, i: int) -> Iterator[tuple[str, str]]:
        """The unknowns of the start of measurement `i`, with the state variable that each is."""
        for name in self.unknowns:
            if name.startswith(START):
                own, _, which = name.removeprefix(START).partition("[")
                if not which or int(which[:-1]) == i:
                    yield name, own

    def _parts(
        self, record: Measurement, result: Sensitivities, until: float
    ) -> Iterator[tuple[Any, ...]]:
        """For each quantity its name, times, measured values, values of the motion, standard
        deviations and derivatives.
        """
        for name, column in record.values.items():
            chosen = np.isfinite(column) & (record.time <= until)
            times = record.time[chosen]
            model, slopes = self._quantity(name, result, np.minimum(times, result.motion.time))
            yield (
                name,
                times,
                column[chosen],
                model,
                np.full(times.size, record.sigma_of(name) or 1.0),
                slopes,
            )
        if record.impacts.size:
            times = record.impacts[record.impacts <= until]
            own = result.motion.impacts.time
            count = min(times.size, own.size)
            # at least as late as that
            model = np.append(own[:count], np.full(times.size - count, result.motion.time))
            kinds = np.array([event.kind == "impact" for event in result.motion.events], dtype=bool)
            slopes = np.zeros((times.size, result.event_times.shape[1]))
            slopes[:count] = result.event_times[kinds][:count]
            yield (
                IMPACTS,
                times,
                times,
                model,
                np.full(times.size, record.impact_sigma or 1.0),
                slopes,
            )

    def _quantity(
        self, name: str, result: Sensitivities, times: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The values (n,) and derivatives (n, columns) of a quantity at times."""
        coordinates = self.system.model.coordinates
        motion = result.motion
        names = state_names(coordinates)
        along = result.at(times)
        q, v = (np.reshape(x, (len(coordinates), times.size)) for x in motion.at(times))
        state = np.concatenate([q, v])
        if name in names:
            return state[names.index(name)], along[:, names.index(name)]
        if name in self.functions:
            return self._function(self.functions[name], times, state, along)
        i = accelerations(coordinates).index(name)
        assert motion.dense is not None
        rates = motion.dense.accelerations(times)[i]
        if result.tangent is None:
            return rates, np.zeros((times.size, along.shape[2]))
        slopes = result.tangent.accelerations(times).reshape(-1, len(coordinates), times.size)
        return rates, slopes[:, i].T

    def _function(
        self, function: Function, times: np.ndarray, state: np.ndarray, along: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A function of the user, which is differentiated to the state by central differences,
        exact where it is quadratic.
        """
        half = len(state) // 2

        def asked(x: np.ndarray) -> np.ndarray:
            given = (x[0], x[1]) if half == 1 else (x[:half], x[half:])
            return np.broadcast_to(np.asarray(function(times, *given), dtype=float), times.shape)

        slopes = np.zeros((times.size, along.shape[2]))
        for row, one in enumerate(np.eye(len(state))):
            step = (
                np.finfo(float).eps ** (1 / 3)
                * (1.0 + np.abs(state).max(initial=0.0))
                * one[:, None]
            )
            slopes += ((asked(state + step) - asked(state - step)) / (2 * step[row]))[
                :, None
            ] * along[:, row]
        return asked(state), slopes


def accelerations(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """The names of the accelerations."""
    return (
        ("acceleration",)
        if len(coordinates) == 1
        else tuple(f"{name}_acceleration" for name in coordinates)
    )


def _followed(
    system: System,
    start: Mapping[str, float],
    paths: tuple[str, ...],
    record: Measurement,
    end: float,
    tol: float,
) -> Sensitivities:
    """The motion up to a time with its derivatives; where impacts were measured it goes on until it
    has as many, up to half as long again."""
    coordinates = system.model.coordinates
    speeds = tuple(start[name] for name in state_names(coordinates)[len(coordinates) :])
    wanted = int(np.sum(record.impacts <= end))
    for share in (1.0, 1.5) if wanted else (1.0,):
        request = MotionRequest(
            system=system,
            coordinates={name: start[name] for name in coordinates},
            velocity=speeds[0] if len(coordinates) == 1 else speeds,
            periods=None,
            duration=share * max(end - record.begin, 0.0),
            tol=tol,
            time=record.begin,
            side=None,
            stop_at=(),
            dense=True,
            sensitivities=paths,
        )
        result = derivatives_of(request, None)
        if len(result.motion.impacts) >= wanted:
            break
    if not np.isfinite(result.motion.final_state).all():
        raise MotionError("the motion leaves the range of numbers")
    return result


def check_measurements(
    system: System,
    measurements: tuple[Measurement, ...],
    unknowns: tuple[str, ...],
    functions: Mapping[str, Function],
) -> None:
    """Refuse quantities that nothing gives, starts of other coordinates, and numbers that are both
    unknown and given.
    """
    names = state_names(system.model.coordinates)
    known = (*names, *accelerations(system.model.coordinates), *functions)
    for record in measurements:
        if not isinstance(record, Measurement):
            raise ParameterError(
                f"data must be a Measurement or a list of them, got {shown(record)}", "data"
            )
        for name in record.values:
            if name not in known:
                raise ParameterError(
                    f"no quantity {name!r}: {near(name, known)}; others are given by functions=...",
                    "data",
                )
        for name in record.start:
            if name not in (*names, "time"):
                raise ParameterError(f"start has {name!r}; {near(name, (*names, 'time'))}", "data")
        if both := set(record.changes) & set(unknowns):
            raise ParameterError(
                f"{min(both)} is an unknown of the fit, and a measurement sets it in its changes",
                "parameters",
            )
        system.with_(dict(record.changes))
    given = [
        sigma is None
        for record in measurements
        for sigma in map(record.sigma_of, record.quantities)
    ]
    if any(given) and not all(given):
        raise ParameterError("sigma must be given for all measured quantities, or for none", "data")
