"""Lyapunov exponents of many motions at once, in lanes: charts of them along a parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.lyapunov.area_contraction import impact_factor
from saltus.attractors.lyapunov.averages import average, uncertainty
from saltus.attractors.lyapunov.renormalisation import check_run
from saltus.attractors.lyapunov.spectrum import resolution
from saltus.attractors.lyapunov.tangent_frames import Stretched, stretch_many
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.checks import check_number
from saltus.errors import ParameterError
from saltus.flow import Inputs, read_inputs, simulate_many, stop_names
from saltus.systems import System, check_system

if TYPE_CHECKING:
    import xarray

LOOK_BACK = 160  # forcing periods after the run in which a motion may show that it repeats itself
ONE = 1.0 - 1e-14  # a product of impact factors below it is below 1
ENDINGS = ("moving", "rest", "lost")  # what the flags of `ending` mean


def lyapunov_many(
    system: System,
    parameters: Mapping[str, Any] | None = None,
    *,
    velocity: Any = 0.0,
    periods: int = 1000,
    transient: int = 200,
    tol: float = 1e-11,
    progress: Callable[[float], object] | None = None,
    **coordinates: Any,
) -> xarray.Dataset:
    """Both exponents of every motion of an ensemble, as `lyapunov_spectrum` has them of one.

    Arrays broadcast as those of `simulate_many` do. Motions that settle on an orbit are followed along it; those that rest at the
    contact for good have no exponents if impacts lose nothing, and -inf if they do.

    Args:
        system: a model with one coordinate, under constant or harmonic loads.
        parameters: arrays by dotted path, such as {"load.frequency": np.linspace(1, 2, 201)}.
        velocity, coordinates: the states at the start, at phase 0.
        periods, transient: forcing periods to average over, at least 32, and to let pass first.
        tol: the error that one step may make.
        progress: called with the fraction done.

    Returns:
        A Dataset over the dimensions of the arguments: `exponent` and its `error`, `at_half` and `later_half` (from the halves of
        the run alone), each with a dimension `index` of 2; `resolution`, below which an exponent is not told from 0; `positive`,
        whether the largest is above both, in all and in both halves; `cycle`, the forcing periods after which the motion repeats
        itself at the end, 0 if it does not, `ending`, and the state at the end.

    Raises:
        ParameterError: an argument without meaning; several coordinates; a load by records.
    """
    check_system(system, "lyapunov_many")
    if len(system.model.coordinates) > 1:
        raise ParameterError(
            "lyapunov_many works on models with one coordinate; lyapunov_spectrum takes any, one motion at a time"
        )
    check_periodic(system)
    check_run(periods, transient)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    inputs = read_inputs(system, velocity, 0.0, parameters, coordinates)
    run = _Many(system, inputs, tol)
    started, captured = run.settle(run.begin(), transient)
    started[captured] = np.nan
    scaled = None if progress is None else lambda done: progress(0.95 * done)
    stretched = stretch_many(system, started, run.columns, run.lengths, int(periods), tol, scaled)
    cycle = run.cycle(stretched.states)
    if progress is not None:
        progress(1.0)
    measures = _measures(system, run, stretched, captured) | {"cycle": cycle}
    return _dataset(run, measures, stretched.states, {"periods": periods, "transient": transient, "tol": tol})


class _Many:
    """The motions, flat: their parameters and the lengths of their periods."""

    def __init__(self, system: System, inputs: Inputs, tol: float) -> None:
        self.system, self.inputs, self.tol = system, inputs, tol
        size, places = inputs.size, list(system.parameters)
        self.parameters = {path: np.broadcast_to(a, size) for path, a in inputs.parameters.items()}
        self.columns = {places.index(path): values for path, values in self.parameters.items()}
        frequency = self.parameters.get("load.frequency", system.load.frequency)
        self.lengths = np.broadcast_to(1.0 if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float), size)

    def begin(self) -> np.ndarray:
        """Coordinate and velocity at the start, (n, 2)."""
        state = list(self.inputs.values.values())[:2]
        return np.stack([np.broadcast_to(values, self.inputs.size) for values in state], axis=1).astype(float)

    def settle(self, states: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        """States after so many periods, or fewer where they have settled, and which are proved to rest for ever."""
        states, captured = states.copy(), np.zeros(len(states), dtype=bool)
        if not periods or not len(states):
            return states, captured
        result = self._follow(states, periods, ("rest", "settled"))
        stop = stop_names(result)
        states[:, 0], states[:, 1] = result[self._name].values, result["velocity"].values
        captured = stop == "captured"
        states[~np.isin(stop, ("horizon", "rest", "settled", "captured"))] = np.nan
        return states, captured

    def cycle(self, states: np.ndarray) -> np.ndarray:
        """Forcing periods after which motions from here repeat themselves; 0 where they do not, or are lost."""
        found = np.zeros(len(states), dtype=int)
        here = np.flatnonzero(np.isfinite(states).all(axis=1))
        if here.size and self.system.load.frequency is not None:
            found[here] = self._follow(states, LOOK_BACK, ("settled",), here)["recurrence_period"].values
        return found

    @property
    def _name(self) -> str:
        return self.system.model.coordinates[0]

    def _follow(self, states: np.ndarray, periods: int, until: tuple[str, ...], rows: Any = slice(None)) -> Any:
        length = {"duration": float(periods)} if self.system.load.frequency is None else {"periods": periods}
        begin: dict[str, Any] = {self._name: states[rows, 0]}
        given = {path: values[rows] for path, values in self.parameters.items()}
        until = until if self.system.load.frequency is not None else ("rest",)
        return simulate_many(
            self.system, **begin, velocity=states[rows, 1], parameters=given, until=until, sample=(), tol=self.tol, **length
        )


def _measures(system: System, run: _Many, stretched: Stretched, captured: np.ndarray) -> dict[str, np.ndarray]:
    """Exponents, errors and what follows from them, a row for each motion."""
    growth, half = stretched.growth, len(stretched.growth) // 2
    if captured.any():
        lossy = impact_factor(system, run.parameters) < ONE
        growth = np.where((captured & lossy)[None, :, None], -np.inf, growth)
    rates = growth / run.lengths[None, :, None]
    parts = {"exponent": rates, "at_half": rates[:half], "later_half": rates[-half:]}
    means = {name: average(part) for name, part in parts.items()}
    errors = {name: uncertainty(part) for name, part in parts.items()}
    limits = {name: np.array([resolution(len(part) * t) for t in run.lengths]) for name, part in parts.items()}
    rested = captured | np.isneginf(means["exponent"][:, 1])
    moving = np.isfinite(stretched.states).all(axis=1)
    return means | {
        "error": errors["exponent"],
        "resolution": limits["exponent"],
        "positive": np.logical_and.reduce([means[n][:, 0] - errors[n][:, 0] > limits[n] for n in parts]),
        "ending": np.where(rested, 1, np.where(moving, 0, 2)).astype(np.int8),
    }


TEXTS = {
    "exponent": "Lyapunov exponents, per unit of dimensionless time",
    "at_half": "the exponents from the first half of the run alone",
    "later_half": "the exponents from the second half of the run alone",
    "error": "half width of the 95 % interval of the exponent",
    "resolution": "2 ln(t) / t, what growth by the square of the time would give",
    "positive": "whether the largest exponent is above its error and the resolution, in all and in both halves",
    "ending": "what the motion does at the end",
    "cycle": "forcing periods after which the motion repeats itself at the end, 0 if it does not",
}


def _dataset(run: _Many, measures: dict[str, np.ndarray], states: np.ndarray, attributes: dict[str, Any]) -> xarray.Dataset:
    import xarray

    from saltus import __version__

    inputs, values = run.inputs, {}

    def add(name: str, array: np.ndarray, text: str, **more: Any) -> None:
        dims = (*inputs.dims, *(("index",) if array.ndim > 1 else ()))
        whole = array.reshape((*inputs.shape, *array.shape[1:]))
        values[name] = (dims, whole, {"units": "1", "long_name": text} | more)

    for name, array in measures.items():
        add(name, array, TEXTS[name])
    values["ending"][2].update(flag_values=np.arange(3, dtype=np.int8), flag_meanings=" ".join(ENDINGS))
    for i, label in enumerate((run.system.model.coordinates[0], "velocity")):
        add(f"end_{label}", states[:, i], f"{label} at the end, at phase 0 of the load")
    for path, given in run.parameters.items():
        if path not in inputs.coords:
            add(path, np.asarray(given), f"parameter {path}")
    about = {"title": "Lyapunov exponents computed by saltus", "saltus_version": __version__, "system": run.system.to_json()}
    return xarray.Dataset(values, coords=inputs.coords, attrs=about | attributes)
