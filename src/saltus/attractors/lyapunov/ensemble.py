"""Lyapunov exponents of many motions at once, in lanes, as for charts of exponents along a parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.lyapunov.area_contraction import impact_factor
from saltus.attractors.lyapunov.averages import Estimate, resolution
from saltus.attractors.lyapunov.renormalisation import check_run
from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.attractors.lyapunov.tangent_frames import Stretched, stretch_many
from saltus.errors import ParameterError
from saltus.flow import Inputs, Stop, extrema_names, last_states, motions_from, read_inputs, stop_names
from saltus.progress import Progress, part_of, silent
from saltus.provenance import provenance
from saltus.public_functions import Numbers
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

ENDINGS = ("moving", "rest", "lost")  # the meanings of the flags of `ending`


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
    """Both exponents of every motion of an ensemble, as `lyapunov_spectrum` computes them for one motion.

    Arrays broadcast as those of `simulate_many` do. Motions that settle on an orbit are followed along it. For motions that rest
    at the contact for good the exponents are -inf if impacts lose energy, and nan if they do not.

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
        A Dataset over the dimensions of the arguments: `exponent` and its `error`, `at_half` and `later_half` (from the halves of
        the run), each with a dimension `index` of 2; `resolution`, below which an exponent may be 0; `positive`, whether the
        largest exponent is above its error and the resolution, over the whole run and over both halves; `period`, the forcing
        periods after which the motion repeats itself at the end, 0 if it does not; `ending`, and the state at the end.

    Raises
    ------
    ParameterError
        An argument without meaning; several coordinates; a load by records.

    Examples
    --------
    >>> many = saltus.lyapunov_many(system, theta=[0.3, 0.4], periods=200)
    >>> sorted(many.data_vars)
    ['at_half', 'end_theta', 'end_velocity', 'ending', 'error', 'exponent', 'later_half', 'period', 'positive', 'resolution']
    """
    check_run("lyapunov_many", system, periods, transient, tol)
    if len(system.model.coordinates) > 1:
        raise ParameterError(
            "lyapunov_many works on models with one coordinate; lyapunov_spectrum takes any, one motion at a time", "system"
        )
    run = _Many(system, read_inputs(system, velocity, 0.0, parameters, coordinates), tol)
    started, captured = run.settle(run.begin(), transient)
    started[captured] = np.nan
    stretched = stretch_many(system, started, run.parameters, run.lengths, int(periods), tol, part_of(progress, 0.0, 0.95))
    period, still = run.period(stretched.states)
    measures = _measures(system, run, stretched, captured, still) | {"period": period}
    progress(1.0, "exponents")
    return _dataset(run, measures, stretched.states, {"periods": periods, "transient": transient})


class _Many:
    """The motions in one row: their parameters and the lengths of their periods."""

    def __init__(self, system: System, inputs: Inputs, tol: float) -> None:
        self.system, self.inputs, self.tol = system, inputs, tol
        self.parameters = {path: np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()}
        frequency = self.parameters.get("load.frequency", system.load.frequency)
        length = 1.0 if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
        self.lengths = np.broadcast_to(length, inputs.size)

    def begin(self) -> np.ndarray:
        """Coordinate and velocity at the start, (n, 2)."""
        state = list(self.inputs.values.values())[:2]
        return np.stack([np.broadcast_to(values, self.inputs.size) for values in state], axis=1).astype(float)

    def settle(self, states: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """States after so many periods, or fewer for motions that have settled, and which motions are proved to rest for ever."""
        if not periods or not len(states):
            return states.copy(), np.zeros(len(states), dtype=bool)
        result = self._follow(states, periods, ("rest", "settled"))
        stop = stop_names(result)
        going = np.isin(stop, (Stop.HORIZON, Stop.REST, Stop.SETTLED, Stop.CAPTURED))
        return np.where(going[:, None], last_states(self.system, result), np.nan), stop == Stop.CAPTURED

    def period(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forcing periods after which motions from these states repeat themselves, 0 if they do not or are lost; and which
        motions stand still."""
        found, still = np.zeros(len(states), dtype=int), np.zeros(len(states), dtype=bool)
        here = np.flatnonzero(np.isfinite(states).all(axis=1))
        if here.size and self.system.load.frequency is not None:
            result = self._follow(states, LYAPUNOV.look_back, ("settled",), here, ("extrema",))
            highest, lowest = (result[f"overall_{name}"].values for name in extrema_names(self.system.model.coordinates))
            found[here], still[here] = result["recurrence_period"].values, highest == lowest
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


def _measures(system: System, run: _Many, stretched: Stretched, captured: np.ndarray, still: np.ndarray) -> dict[str, np.ndarray]:
    """Exponents, errors and what follows from them, a row for each motion."""
    growth = stretched.growth
    if captured.any():
        lossy = impact_factor(system, run.parameters) < LYAPUNOV.lossless
        growth = np.where((captured & lossy)[None, :, None], -np.inf, growth)
    found, duration = Estimate.of(growth / run.lengths[None, :, None]), len(growth) * run.lengths
    # Contacts and frictions that hold a coordinate for a while make an exponent -inf also where the motion goes on.
    rested = captured | (still if system.model.held else np.isneginf(found.value[:, 1]))
    moving = np.isfinite(stretched.states).all(axis=1)
    return {
        "exponent": found.value,
        "at_half": found.halves[0],
        "later_half": found.halves[1],
        "error": found.error,
        "resolution": resolution(duration),
        "positive": found.positive(duration[:, None])[:, 0],
        "ending": np.where(rested, 1, np.where(moving, 0, 2)).astype(np.int8),
    }


MEANINGS = {
    "exponent": "Lyapunov exponents, per unit of dimensionless time",
    "at_half": "the exponents from the first half of the run",
    "later_half": "the exponents from the second half of the run",
    "error": "half width of the 95 % interval of the exponent",
    "resolution": "2 ln(t) / t, what growth by the square of the time would give",
    "positive": "whether the largest exponent is above its error and the resolution, in all and in both halves",
    "ending": "what the motion does at the end",
    "period": "forcing periods after which the motion repeats itself at the end, 0 if it does not",
}


def _dataset(run: _Many, measures: dict[str, np.ndarray], states: np.ndarray, numbers: dict[str, Any]) -> xarray.Dataset:
    import xarray

    inputs, name = run.inputs, run.system.model.coordinates[0]
    unit = run.system.model.unit_of(name)
    columns = {name: (array, "1", MEANINGS[name]) for name, array in measures.items()}
    for i, label in enumerate((name, "velocity")):
        columns[f"end_{label}"] = states[:, i], unit, f"{label} at the end, at phase 0 of the load"
    for path, given in run.parameters.items():
        if path not in inputs.coords:
            columns[path] = np.asarray(given), "1", f"parameter {path}"
    variables: dict[str, Any] = {}
    for key, (array, units, text) in columns.items():
        dims = (*inputs.dims, *(("index",) if array.ndim > 1 else ()))
        variables[key] = dims, array.reshape((*inputs.shape, *array.shape[1:])), {"units": units, "long_name": text}
    variables["ending"][2].update(flag_values=np.arange(len(ENDINGS), dtype=np.int8), flag_meanings=" ".join(ENDINGS))
    attributes = {"title": "Lyapunov exponents computed by saltus", "kind": "lyapunov_many"} | provenance(
        run.system, tol=run.tol, **numbers
    )
    return xarray.Dataset(variables, coords=inputs.coords, attrs=attributes)
