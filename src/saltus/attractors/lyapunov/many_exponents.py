"""Lyapunov exponents of many motions at once, in lanes, as for charts of exponents along a
parameter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.lyapunov.growth import (
    LYAPUNOV,
    Estimate,
    check_run,
    first_frame,
    resolution,
    span_count,
)
from saltus.attractors.lyapunov.spectrum import impact_factor
from saltus.checks import Numbers
from saltus.enumerations import flags
from saltus.errors import ParameterError
from saltus.flow import (
    Ending,
    Inputs,
    Stop,
    TangentEnsemble,
    available_cores,
    extrema_names,
    last_states,
    motions_from,
    read_inputs,
    stop_names,
)
from saltus.progress import LOOK_INTERVAL, Progress, part_of, silent
from saltus.result import provenance
from saltus.systems import NaturalUnits, System, check_system, natural_units

if TYPE_CHECKING:
    import xarray


def _units(system: System, parameters: Mapping[str, np.ndarray], row: int) -> NaturalUnits:
    """The natural units of the system of a row, as for a single motion."""
    values = {path: float(numbers[row]) for path, numbers in parameters.items()}
    return natural_units(system.with_(values))


@dataclass(frozen=True)
class Stretched:
    """The run of many motions; growth is NaN once a motion is lost, and -inf once it has come to
    rest with a loss at impacts.
    """

    # (periods, n, 2): ln of the stretch of each direction of the frame in each period
    growth: np.ndarray
    states: np.ndarray  # (n, 2): coordinate and velocity at the end; NaN where the motion was lost


def stretch_many(
    system: System,
    states: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    lengths: np.ndarray,
    periods: int,
    tol: float,
    progress: Progress = silent,
) -> Stretched:
    """Follow motions from states (n, 2) at phase 0 over so many periods of the given lengths, (n,).

    `parameters` replaces numbers of the system by path, (n,) each. Results do not depend on the
    number of cores.
    """
    ensemble = TangentEnsemble(system, parameters, lengths, tol)
    result = Stretched(
        np.full((periods, len(states), 2), np.nan), np.full((len(states), 2), np.nan)
    )
    units = [_units(system, parameters, row) for row in range(len(lengths))]
    counts = np.array(
        [span_count(length, unit.own_time) for length, unit in zip(lengths, units, strict=True)]
    )
    times = np.array([unit.free_time for unit in units])
    groups = [
        group for count in np.unique(counts) for group in _groups(np.flatnonzero(counts == count))
    ]
    done = np.zeros(1)
    stopped: list[bool] = []

    def work(rows: np.ndarray) -> None:
        group = _TangentGroup(ensemble, rows, states[rows], lengths[rows], times[rows])
        for p in range(periods):
            if stopped:
                return
            result.growth[p, rows] = group.period(int(counts[rows[0]]))
            done[0] += len(rows)
        result.states[rows] = group.ends()

    with ThreadPoolExecutor(available_cores()) as pool:
        workers = [pool.submit(work, rows) for rows in groups]
        try:
            while wait(workers, LOOK_INTERVAL).not_done:
                progress(float(done[0]) / (periods * max(1, len(states))), "derivatives")
        except BaseException:
            stopped.append(True)
            raise
        for worker in workers:
            worker.result()
    return result


def _groups(rows: np.ndarray) -> list[np.ndarray]:
    """Rows in groups for the threads, a group or more for each core."""
    least = max(available_cores(), math.ceil(len(rows) / LYAPUNOV.largest_group))
    return [group for group in np.array_split(rows, least) if group.size]


class _TangentGroup:
    """A group of motions with frames; the row of each has the coordinate, its two derivatives, the
    velocity, its two derivatives. The times (n,) are those of their free oscillations, in which
    frames are orthonormal."""

    def __init__(
        self,
        ensemble: TangentEnsemble,
        rows: np.ndarray,
        states: np.ndarray,
        lengths: np.ndarray,
        times: np.ndarray,
    ) -> None:
        self._ensemble = ensemble
        self._rows = rows
        self._lengths = lengths
        self._states = np.zeros((len(states), 6))
        self._states[:, [0, 3]] = states
        self._states[:, [1, 2, 4, 5]] = first_frame(2).ravel()
        self._times = times[:, None]
        self._states[:, [4, 5]] /= self._times
        self._alive = np.isfinite(states).all(axis=1)
        self._rounding = LYAPUNOV.rounding if ensemble.holds_coordinates else 0.0

    def period(self, spans: int) -> np.ndarray:
        """Go on for a period; returns ln of the stretch in it, (n, 2)."""
        growth = np.where(self._alive[:, None], 0.0, np.full((len(self._rows), 2), np.nan))
        for j in range(spans):
            here = np.flatnonzero(self._alive)
            if not here.size:
                break
            span = self._lengths[here] / spans
            ends = self._ensemble.advance(
                self._rows[here], self._states[here], j * span, (j + 1) * span
            )
            ends.states[:, [4, 5]] *= self._times[here]
            self._states[here], stretch = _orthonormal(ends.states, self._rounding)
            self._states[here[:, None], [4, 5]] /= self._times[here]
            self._alive[here[~ends.sound]] = False
            growth[here] += np.where(ends.sound[:, None], stretch, np.nan)
        return growth

    def ends(self) -> np.ndarray:
        """Coordinate and velocity at the end, (n, 2)."""
        return np.where(self._alive[:, None], self._states[:, [0, 3]], np.nan)


def _orthonormal(states: np.ndarray, rounding: float) -> tuple[np.ndarray, np.ndarray]:
    """The states with their derivatives made orthonormal, by Gram and Schmidt, and ln of the
    lengths that they had, (n, 2).

    A second length that is no more than `rounding` of the first one is 0.
    """
    states = states.copy()
    x1 = states[:, 1]
    x2 = states[:, 2]
    y1 = states[:, 4]
    y2 = states[:, 5]
    first = np.hypot(x1, y1)
    area = x1 * y2 - x2 * y1
    area[np.abs(area) <= rounding * first**2] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = np.log(np.stack([first, np.abs(area) / first], axis=1))
        unit_x = np.where(first > 0.0, x1 / first, 1.0)
        unit_y = np.where(first > 0.0, y1 / first, 0.0)
    growth[first == 0.0] = -np.inf
    turn = np.where(area < 0.0, -1.0, 1.0)
    states[:, 1] = unit_x
    states[:, 4] = unit_y
    states[:, 2] = -turn * unit_y
    states[:, 5] = turn * unit_x
    return states, growth


def lyapunov_many(
    system: System,
    parameters: Mapping[str, Any] | None = None,
    *,
    velocity: Numbers = 0.0,
    periods: int = 1000,
    transient: int = 200,
    tol: float = 1e-11,
    progress: Progress = silent,
    **coordinates: Any,
) -> xarray.Dataset:
    """Both exponents of every motion of an ensemble, as `lyapunov_spectrum` computes them for one
    motion.

    Arrays broadcast as those of `simulate_many` do. Motions that settle on an orbit are followed
    along it. For motions that rest at the contact for good the exponents are -inf if impacts lose
    energy, and nan if they do not.

    Parameters
    ----------
    system
        A model with one coordinate, under constant or harmonic loads.
    parameters
        Arrays by dotted path, such as {"load.frequency": np.linspace(1, 2, 201)}.
    velocity, coordinates
        The states at the start, at phase 0.
    periods, transient
        Forcing periods to average over, at least 32, and to let pass first.
    tol
        The error that one step may make.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        A Dataset over the dimensions of the arguments: `exponent` and its `error`, `at_half` and
        `later_half` (from the halves of the run), each with a dimension `index` of 2; `resolution`,
        below which an exponent may be 0; `positive`, whether the largest exponent is above its
        error and the resolution, over the whole run and over both halves; `period`, the forcing
        periods after which the motion repeats itself at the end, 0 if it does not; `ending`, and
        the state at the end.

    Raises
    ------
    ParameterError
        An argument without meaning; several coordinates; a load by records.

    Examples
    --------
    >>> many = saltus.lyapunov_many(system, theta=[0.3, 0.4], periods=200)
    >>> sorted(many.data_vars)
    ['at_half', 'end_theta', 'end_velocity', 'ending', 'error', 'exponent', 'later_half', 'period',
    'positive', 'resolution']
    """
    check_run("lyapunov_many", system, periods, transient, tol)
    check_system(system, "lyapunov_many", several_contacts=True, multipliers=True, switches=True)
    if len(system.in_gap_coordinates.model.coordinates) > 1:
        raise ParameterError(
            "lyapunov_many works on models with one coordinate; lyapunov_spectrum takes any, one "
            "motion at a time",
            "system",
        )
    inputs = read_inputs(system, velocity, 0.0, parameters, coordinates)
    # exponents are the same over a wall that moves
    run = _Many(system.in_gap_coordinates, inputs.in_gaps(system), tol)
    started, captured = run.settle(run.begin(), transient)
    started[captured] = np.nan
    stretched = stretch_many(
        system,
        started,
        run.parameters,
        run.lengths,
        int(periods),
        tol,
        part_of(progress, 0.0, 0.95),
    )
    period, still = run.period(stretched.states)
    measures = _measures(run.system, run, stretched, captured, still) | {"period": period}
    measures["ending"][(measures["ending"] == Ending.UNDECIDED) & (period > 0)] = Ending.PERIODIC
    progress(1.0, "exponents")
    ends = stretched.states
    if run.system is not system:
        twin = inputs.with_numbers(run.system)
        given = twin.model.own_states(0.0, ends[None, :, 0], ends[None, :, 1], twin.load)
        ends = np.asarray(np.concatenate(given)).T
    return _dataset(system, run, measures, ends, {"periods": periods, "transient": transient})


class _Many:
    """The motions in one row: their parameters and the lengths of their periods."""

    def __init__(self, system: System, inputs: Inputs, tol: float) -> None:
        self.system = system
        self.inputs = inputs
        self.tol = tol
        self.parameters = {
            path: np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()
        }
        frequency = self.parameters.get("load.frequency", system.load.frequency)
        length = 1.0 if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
        self.lengths = np.broadcast_to(length, inputs.size)

    def begin(self) -> np.ndarray:
        """Coordinate and velocity at the start, (n, 2)."""
        state = list(self.inputs.values.values())[:2]
        return np.stack(
            [np.broadcast_to(values, self.inputs.size) for values in state], axis=1
        ).astype(float)

    def settle(self, states: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """States after so many periods, or fewer for motions that have settled, and which motions
        are proved to rest for ever.
        """
        if not periods or not len(states):
            return states.copy(), np.zeros(len(states), dtype=bool)
        result = self._follow(states, periods, ("rest", "settled"))
        stop = stop_names(result).values
        going = np.isin(stop, (Stop.HORIZON, Stop.REST, Stop.SETTLED, Stop.CAPTURED))
        return (
            np.where(going[:, None], last_states(self.system, result), np.nan),
            stop == Stop.CAPTURED,
        )

    def period(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forcing periods after which motions from these states repeat themselves, 0 if they do not
        or are lost; and which motions stand still."""
        found = np.zeros(len(states), dtype=int)
        still = np.zeros(len(states), dtype=bool)
        here = np.flatnonzero(np.isfinite(states).all(axis=1))
        if here.size and self.system.load.frequency is not None:
            result = self._follow(states, LYAPUNOV.look_back, ("settled",), here, ("extrema",))
            highest, lowest = (
                result[f"overall_{name}"].values
                for name in extrema_names(self.system.model.coordinates)
            )
            found[here] = result["recurrence_period"].values
            still[here] = highest == lowest
        return found, still

    def _follow(
        self,
        states: np.ndarray,
        periods: int,
        until: tuple[str, ...],
        rows: Any = slice(None),
        sample: tuple[str, ...] = (),
    ) -> Any:
        forced = self.system.load.frequency is not None
        return motions_from(
            self.system,
            states[rows],
            parameters={path: values[rows] for path, values in self.parameters.items()},
            until=until if forced else ("rest",),
            sample=sample,
            tol=self.tol,
            **({"periods": periods} if forced else {"duration": float(periods)}),
        )


def _measures(
    system: System, run: _Many, stretched: Stretched, captured: np.ndarray, still: np.ndarray
) -> dict[str, np.ndarray]:
    """Exponents, errors and what follows from them, a row for each motion."""
    growth = stretched.growth
    if captured.any():
        lossy = impact_factor(system, run.parameters) < LYAPUNOV.lossless
        growth = np.where((captured & lossy)[None, :, None], -np.inf, growth)
    found = Estimate.of(growth / run.lengths[None, :, None])
    duration = len(growth) * run.lengths
    unit = run.lengths / (2.0 * math.pi)  # 1 / Omega of each motion
    # Contacts and frictions that hold a coordinate for a while make an exponent -inf also where the
    # motion goes on.
    rested = captured | (
        still if system.model.holds_coordinates else np.isneginf(found.value[:, 1])
    )
    moving = np.isfinite(stretched.states).all(axis=1)
    return {
        "exponent": found.value,
        "at_half": found.halves[0],
        "later_half": found.halves[1],
        "error": found.error,
        "resolution": resolution(duration, unit),
        "positive": found.positive(duration[:, None], unit[:, None])[:, 0],
        "ending": (
            np.where(rested, Ending.REST, np.where(moving, Ending.UNDECIDED, Ending.ENDED)).astype(
                np.int8
            )
        ),
    }


MEANINGS = {
    "exponent": "Lyapunov exponents, per unit of dimensionless time",
    "at_half": "the exponents from the first half of the run",
    "later_half": "the exponents from the second half of the run",
    "error": "half width of the 95 % interval of the exponent",
    "resolution": "2 ln(t) / t, what growth by the square of the time would give",
    "positive": (
        "whether the largest exponent is above its error and the resolution, in all and "
        "in both halves"
    ),
    "ending": "what the motion does at the end",
    "period": "forcing periods after which the motion repeats itself at the end, 0 if it does not",
}


def _dataset(
    system: System,
    run: _Many,
    measures: dict[str, np.ndarray],
    states: np.ndarray,
    numbers: dict[str, Any],
) -> xarray.Dataset:
    import xarray

    inputs = run.inputs
    name = system.model.coordinates[0]
    unit = system.model.unit_of(name)
    columns = {name: (array, "1", MEANINGS[name]) for name, array in measures.items()}
    for i, label in enumerate((name, "velocity")):
        columns[f"end_{label}"] = states[:, i], unit, f"{label} at the end, at phase 0 of the load"
    for path, given in run.parameters.items():
        if path not in inputs.coords:
            columns[path] = np.asarray(given), "1", f"parameter {path}"
    variables: dict[str, Any] = {}
    for key, (array, units, text) in columns.items():
        dims = (*inputs.dims, *(("index",) if array.ndim > 1 else ()))
        variables[key] = (
            dims,
            array.reshape((*inputs.shape, *array.shape[1:])),
            {"units": units, "long_name": text},
        )
    variables["ending"][2].update(flags(Ending))
    attributes = {
        "title": "Lyapunov exponents computed by saltus",
        "kind": "lyapunov_many",
    } | provenance(system, tol=run.tol, **numbers)
    return xarray.Dataset(variables, coords=inputs.coords, attrs=attributes)
