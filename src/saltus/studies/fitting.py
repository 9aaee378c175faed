"""Numbers of a system from measured motions: least squares with exact derivatives through every
impact.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count, check_number, checked_by, with_answers
from saltus.errors import MotionError, ParameterError, SaltusError, near, shown
from saltus.flow import state_names
from saltus.progress import Progress, html_table, silent
from saltus.result import Result, result_dataset
from saltus.studies.measured_motions import (
    IMPACTS,
    START,
    Compared,
    Function,
    MeasuredMotions,
    Measurement,
    Unknowns,
    check_measurements,
)
from saltus.systems import System, check_path, check_system

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class FitSettings:
    """How the fit is looked for."""

    # The starts that fit the first impacts best, which are followed over all of the data until one
    # fits.
    candidates: int = 3
    good: float = 2.0  # chi^2 per degree of freedom below which no further start is tried.
    # The share of an unknown in a direction from which on a sentence about the direction names it.
    named: float = 0.1
    # The share of a quantity's variation that a motion may leave before a sentence says so.
    left: float = 0.9
    # so many standard deviations of the noise may be left in any case
    noisy: float = 3.0


FIT = FitSettings()


@with_answers
@dataclass(frozen=True, eq=False, repr=False)
class Fit(Result):
    """Numbers found from measured motions, with their errors.

    Attributes
    ----------
    system
        The system with the numbers that were found.
    values
        The numbers by their paths; those of the start by "start.theta", of record i among several
        by "start.theta[i]".
    errors
        Their standard errors; inf where the data say nothing.
    covariance
        Their covariance, (p, p), in the order of `values`; inf and nan where the data say nothing.
    chi2
        The sum of the squared residuals in standard deviations.
    degrees
        The number of data less that of the unknowns.
    remarks
        Sentences: what cannot be told from the data, what ended on its bound, where the motion has
        no derivative.
    comparison
        For each measurement the data beside the motion.
    problem
        The measurements, from which `log_likelihood` is computed.
    noise
        The factor of the given standard deviations: 1, or where none were given the estimated
        deviation itself.
    bounds
        The bounds (lowest, highest) of each number.

    Examples
    --------
    >>> times = np.linspace(0.0, 10.0, 200)
    >>> theta = saltus.simulate(system, theta=0.3, duration=10.0).at(times)[0]
    >>> record = saltus.Measurement(start={"theta": 0.3}, time=times, values={"theta": theta}, sigma=1e-3)
    >>> guess = system.with_({"model.damping": 0.2, "impact.e": 0.8})
    >>> found = saltus.fit(guess, record, {"model.damping": (0.0, 1.0), "impact.e": (0.5, 1.0)})
    >>> round(found.values["model.damping"], 6)
    0.1
    """

    system: System
    values: dict[str, float]
    errors: dict[str, float]
    covariance: np.ndarray
    chi2: float
    degrees: int
    remarks: tuple[str, ...]
    comparison: tuple[Compared, ...]
    problem: MeasuredMotions
    noise: float
    bounds: dict[str, tuple[float, float]]

    @property
    def correlation(self) -> np.ndarray:
        """The correlations of the numbers, (p, p); nan where the data say nothing."""
        deviation = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            return np.asarray(self.covariance / np.outer(deviation, deviation))

    def log_likelihood(self, values: Unknowns | Sequence[float]) -> tuple[float, np.ndarray]:
        """The logarithm of the likelihood of the data under Gaussian noise, and its exact gradient,
        for samplers such as emcee (which takes the first alone), PyMC and blackjax:

            log L = -sum over data of [r^2 / 2 + log(sigma sqrt(2 pi))],    grad log L = -J' r.

        Outside of the bounds, and where the system has no such motion, it is -inf with the gradient
        0.

        Parameters
        ----------
        values
            The numbers by their paths, or a list of them in the order of `fit.values`.
        """
        try:
            x = np.array(
                [values[name] for name in self.values] if isinstance(values, Mapping) else values,
                dtype=float,
            )
        except (LookupError, TypeError, ValueError):
            x = np.zeros(0)  # which is refused
        if x.shape != (len(self.values),):
            raise ParameterError(
                f"values must have a number for each of {', '.join(self.values)}, got"
                f" {shown(values)}",
                "values",
            )
        low, high = np.array(list(self.bounds.values())).T
        none = -math.inf, np.zeros(x.size)
        if not ((x >= low) & (x <= high)).all():
            return none
        try:
            parts = [
                self.problem.beside(i, dict(zip(self.values, x.tolist(), strict=True)))
                for i in range(len(self.comparison))
            ]
        except SaltusError:
            return none
        r, jacobian, sigma = _stacked(parts)
        size = -0.5 * float(r @ r) / self.noise**2 - float(
            np.sum(np.log(sigma * self.noise * math.sqrt(2 * math.pi)))
        )
        return size, -(jacobian.T @ r) / self.noise**2

    def to_xarray(self) -> xarray.Dataset:
        """Over `parameter`: value, error, bounds and correlations; over `datum`: what was measured,
        and the motion beside it.
        """
        names = list(self.values)
        joined = self.comparison
        rows: dict[str, tuple[Any, ...]] = {
            "value": ("parameter", list(self.values.values()), "1", "what was found"),
            "error": ("parameter", list(self.errors.values()), "1", "standard error"),
            "low": ("parameter", [low for low, _ in self.bounds.values()], "1", "lower bound"),
            "high": ("parameter", [high for _, high in self.bounds.values()], "1", "upper bound"),
            "correlation": (
                ("parameter", "other"),
                self.correlation,
                "1",
                "correlation of the errors",
            ),
            "record": (
                "datum",
                [i for i, part in enumerate(joined) for _ in part.quantity],
                "1",
                "number of the measurement",
            ),
            "quantity": (
                "datum",
                [name for part in joined for name in part.quantity],
                "1",
                "what was measured",
            ),
        }
        for name in ("time", "measured", "model", "sigma"):
            rows[name] = (
                "datum",
                np.concatenate([getattr(part, name) for part in joined]),
                "1",
                f"{name} of the datum",
            )
        rows["sigma"] = (
            *rows["sigma"][:1],
            self.noise * rows["sigma"][1],
            "1",
            "standard deviation of the noise",
        )
        facts = {"chi2": self.chi2, "degrees": self.degrees, "remarks": list(self.remarks)}
        return result_dataset(
            "fit", rows, {"parameter": names, "other": names}, self.system, **facts
        )

    def __repr__(self) -> str:
        return (
            "\n  ".join(
                [
                    f"Fit({self._quality}",
                    *(f"{k} = {v}" for k, v in self._numbers().items()),
                    *self.remarks,
                ]
            )
            + ")"
        )

    def _repr_html_(self) -> str:
        return html_table(
            "Fit",
            {
                **self._numbers(),
                "quality": self._quality,
                "remarks": "; ".join(self.remarks) or "none",
            },
        )

    @property
    def _quality(self) -> str:
        return f"chi^2 = {self.chi2:.6g} for {self.degrees} degrees of freedom"

    def _numbers(self) -> dict[str, str]:
        return {
            name: f"{value:.9g} +- {self.errors[name]:.2g}" for name, value in self.values.items()
        }


class _FoundError(Exception):
    """Ends SciPy's search where chi^2 cannot fall by more than its rounding, which SciPy tries for
    half of all its steps.
    """

    def __init__(self, chi2: float, x: np.ndarray) -> None:
        super().__init__()
        self.chi2 = chi2
        self.x = x


@dataclass(frozen=True)
class _Search:
    """The unknowns of a fit: names, first values, bounds, and the measurements."""

    problem: MeasuredMotions
    names: tuple[str, ...]
    first: np.ndarray
    low: np.ndarray
    high: np.ndarray
    last: dict[Any, list[Compared]] = field(default_factory=dict)

    def compared(self, x: np.ndarray, until: Sequence[float]) -> list[Compared]:
        """The motions with these values beside all measurements, each up to a time; the last answer
        is remembered.
        """
        asked = (x.tobytes(), tuple(until))
        if asked not in self.last:
            values = dict(zip(self.names, x.tolist(), strict=True))
            found = [self.problem.beside(i, values, end) for i, end in enumerate(until)]
            self.last.clear()
            self.last[asked] = found
        return self.last[asked]

    def solved(self, x: np.ndarray, until: Sequence[float]) -> tuple[float, np.ndarray]:
        """The least squares from a start: chi^2 and the values; inf where the motion from the start
        cannot be followed.
        """
        from scipy.optimize import least_squares

        def beside(x: np.ndarray) -> list[Compared] | None:
            try:
                return self.compared(x, until)
            except SaltusError:  # no such system, or no such motion: the step becomes shorter
                return None

        begun = beside(x)
        if begun is None:
            return math.inf, x
        size = sum(part.measured.size for part in begun)

        def residuals(x: np.ndarray) -> np.ndarray:
            parts = beside(x)
            return np.full(size, np.inf) if parts is None else _stacked(parts)[0]

        def jacobian(x: np.ndarray) -> np.ndarray:
            parts = beside(x)
            assert parts is not None
            r, slopes, _ = _stacked(parts)
            if self._gain(x, r, slopes) < tight * float(r @ r):
                raise _FoundError(float(r @ r), x)
            return slopes

        tight = 4 * np.finfo(float).eps
        x = np.clip(x, np.nextafter(self.low, np.inf), np.nextafter(self.high, -np.inf))
        try:
            found = least_squares(
                residuals,
                x,
                jacobian,
                bounds=(self.low, self.high),
                x_scale="jac",
                xtol=1e-12,
                ftol=tight,
                gtol=tight,
            )
        except _FoundError as end:
            return end.chi2, end.x
        return 2.0 * float(found.cost), np.asarray(found.x)

    def _gain(self, x: np.ndarray, r: np.ndarray, jacobian: np.ndarray) -> float:
        """By how much chi^2 falls in a full step of Gauss and Newton; numbers on their bounds stay
        there.
        """
        gradient = r @ jacobian
        near = 1e-6 * (self.high - self.low)
        with np.errstate(invalid="ignore"):  # without bounds
            held = ((x - self.low < near) & (gradient > 0)) | (
                (self.high - x < near) & (gradient < 0)
            )
        sizes = np.where(held, 0.0, np.linalg.norm(jacobian, axis=0))
        slopes = jacobian[:, sizes > 0] / sizes[sizes > 0]
        scaled = gradient[sizes > 0] / sizes[sizes > 0]
        return float(scaled @ np.linalg.lstsq(slopes.T @ slopes, scaled, rcond=None)[0])


def _check(
    system: System,
    data: Measurement | Sequence[Measurement],
    parameters: Mapping[str, Any] | Iterable[str],
    functions: Mapping[str, Function] | None,
    starts: int,
    tol: float,
    seed: int,
    progress: object,
) -> None:
    check_count("starts", starts, 1)
    check_count("seed", seed, 0)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_system(system, "fit", several_contacts=True, multipliers=True, switches=True)
    _search(system, data, parameters, functions, tol)


@checked_by(_check)
def fit(
    system: System,
    data: Measurement | Sequence[Measurement],
    parameters: Mapping[str, tuple[float, float] | None] | Iterable[str],
    *,
    functions: Mapping[str, Function] | None = None,
    starts: int = 8,
    tol: float = 1e-11,
    seed: int = 0,
    progress: Progress = silent,
) -> Fit:
    """The numbers of a system, and of its start, with which its motion is nearest to what was
    measured: least squares

        sum over data of [(model - measured) / sigma]^2 -> min,

    with the exact derivatives of the motion and of the times of its impacts.

    The data are taken in a growing window: first up to the second impact of the motion, then up to
    the fourth, the eighth, .... So a motion with another number of impacts is led there step by
    step. In the first window the search begins at the system's own numbers and, where all have
    bounds, at further points between these; those that fit it best are followed.

    The errors are those of the linearised motion. Where no `sigma` was given, the noise is
    estimated from the residuals.

    Parameters
    ----------
    system
        The system, with a guess of the numbers.
    data
        One measurement, or several of the same system, each with its own start, load or whatever
        its `changes` say.
    parameters
        The dotted paths of the numbers to find, with bounds (lowest, highest) or None; also
        "start.theta", "start.velocity" of the start, which are of each measurement's own.
    functions
        Further quantities that were measured, f(time, coordinate, velocity) of arrays, by name.
    starts
        From how many points the search begins.
    tol
        The error of one step of the motion.
    seed
        Of the points from which it begins.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        An argument without meaning.
    MotionError
        The motion cannot be followed, from whichever start.

    Examples
    --------
    >>> free, push = saltus.WallOscillator(stiffness=0.0, wall=0.0), saltus.Load(force=1.0)
    >>> ball = saltus.System(model=free, load=push, impact=saltus.VelocityReduction(0.7))
    >>> fall = saltus.Measurement(start={"x": -2.0}, impacts=[2.0, 5.2, 7.76], impact_sigma=0.01)  # with e = 0.8
    >>> saltus.fit(ball, fall, {"impact.e": (0.1, 1.0)})
    Fit(chi^2 = 0 for 2 degrees of freedom
      impact.e = 0.8 +- 0.0009)
    """
    search = _search(system, data, parameters, functions, tol)
    windows = _windows(search)
    begun = []
    for i, x in enumerate(_first_points(search, starts, seed)):
        progress(0.5 * i / starts, "fitting the first impacts")
        begun.append(search.solved(x, windows[0]))
    begun.sort(key=lambda pair: pair[0])
    ends: list[tuple[float, np.ndarray]] = []
    for i, (size, x) in enumerate(begun[: FIT.candidates]):
        progress(0.5 + 0.5 * i / FIT.candidates, "fitting all of the data")
        for until in windows[1:]:
            size, x = search.solved(x, until) if math.isfinite(size) else (size, x)
        ends.append((size, x))
        if size < FIT.good * max(_degrees(search), 1) and _noise_known(search):
            break
    size, x = min(ends, key=lambda pair: pair[0])
    if not math.isfinite(size):
        search.compared(search.first, windows[-1])  # raises what is wrong
        raise MotionError(
            "the motion cannot be followed to the end of the data from any start; give other "
            "first numbers or bounds"
        )
    progress(1.0, "done")
    return _result(search, x, size)


def _search(system: System, data: Any, parameters: Any, functions: Any, tol: float) -> _Search:
    """The checked arguments of a fit."""
    records = (data,) if isinstance(data, Measurement) else tuple(data)
    if not all(isinstance(record, Measurement) for record in records):
        raise ParameterError(f"data must be Measurements, got {shown(data)}", "data")
    if functions is not None and not isinstance(functions, Mapping):
        raise ParameterError(
            f"functions must be a dict of functions by name, got {shown(functions)}", "functions"
        )
    given = dict(parameters) if isinstance(parameters, Mapping) else dict.fromkeys(parameters)
    if not records or not given:
        raise ParameterError(
            "data and parameters must not be empty", "parameters" if records else "data"
        )
    names = []
    first = []
    bounds = []
    for path, pair in given.items():
        for name, value in _unknowns_of(system, records, path):
            low, high = (-math.inf, math.inf) if pair is None else (float(x) for x in pair)
            if not low < high:  # nan too
                raise ParameterError(
                    f"the bounds of {path} must be (lowest, highest), got {shown(pair)}",
                    "parameters",
                )
            names.append(name)
            first.append(min(max(value, low), high))
            bounds.append((low, high))
    check_measurements(system, records, tuple(names), functions or {})
    low, high = np.array(bounds).T
    return _Search(
        MeasuredMotions(system, records, tuple(names), functions or {}, tol),
        tuple(names),
        np.array(first),
        low,
        high,
    )


def _unknowns_of(
    system: System, records: tuple[Measurement, ...], path: str
) -> list[tuple[str, float]]:
    """The unknowns that a path names, with their first values: one number of the system, or that of
    each start.
    """
    if not isinstance(path, str) or not path.startswith(START):
        check_path(system, path, "parameters")
        return [(path, float(system.get(path)))]
    own = path.removeprefix(START)
    names = state_names(system.model.coordinates)
    if own not in names:
        raise ParameterError(f"there is no {path}; {near(own, names)}", "parameters")
    several = len(records) > 1
    return [
        (f"{path}[{i}]" if several else path, float(r.start.get(own, 0.0)))
        for i, r in enumerate(records)
    ]


def _windows(search: _Search) -> list[list[float]]:
    """For each stage the time up to which each measurement is taken; inf in the last one."""
    columns = []
    for i, record in enumerate(search.problem.measurements):
        times = record.impacts
        if not times.size:
            first = dict(zip(search.names, search.first.tolist(), strict=True))
            times = search.problem.motion(i, first)[0].motion.impacts.time
        ends = [float(times[k - 1 : k + 1].mean()) for k in 2 ** np.arange(1, 40) if k < times.size]
        columns.append([end for end in ends if end < record.end])
    stages = max(map(len, columns))
    return [
        [column[s] if s < len(column) else math.inf for column in columns] for s in range(stages)
    ] + [[math.inf] * len(columns)]


def _first_points(search: _Search, starts: int, seed: int) -> list[np.ndarray]:
    """The system's own numbers and, where all have bounds, points spread evenly between these."""
    if starts == 1 or not np.isfinite(search.high - search.low).all():
        return [search.first]
    from scipy.stats import qmc

    spread = qmc.LatinHypercube(search.first.size, seed=seed).random(starts - 1)
    return [search.first, *(search.low + spread * (search.high - search.low))]


def _noise_known(search: _Search) -> bool:
    record = search.problem.measurements[0]
    return record.sigma_of(record.quantities[0]) is not None


def _degrees(search: _Search) -> int:
    count = sum(
        sum(int(np.isfinite(column).sum()) for column in record.values.values())
        + record.impacts.size
        for record in search.problem.measurements
    )
    return int(count) - len(search.names)


def _stacked(parts: Iterable[Compared]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals, their derivatives, and the standard deviations of all data."""
    parts = list(parts)
    return (
        np.concatenate([part.residuals for part in parts]),
        np.concatenate([part.jacobian for part in parts]),
        np.concatenate([part.sigma for part in parts]),
    )


def _result(search: _Search, x: np.ndarray, size: float) -> Fit:
    """The fit with its errors, and the sentences about what it does not know."""
    problem = search.problem
    names = search.names
    comparison = search.compared(x, [math.inf] * len(problem.measurements))
    _, jacobian, _ = _stacked(comparison)
    degrees = _degrees(search)
    noise = 1.0 if _noise_known(search) else math.sqrt(size / max(degrees, 1))
    width = search.high - search.low
    scale = np.where(np.isfinite(width), width, np.maximum(np.abs(x), 1.0))
    _, singular, rows = np.linalg.svd(np.linalg.qr(jacobian * scale, mode="r"))
    singular = np.append(singular, np.zeros(len(rows) - singular.size))
    with np.errstate(divide="ignore"):
        errors = noise / singular  # along each direction, as a share of the bounds
    known = errors < 1.0
    blind = (np.abs(rows[~known]) > FIT.named).any(axis=0)
    spread = (scale[:, None] * rows[known].T) * errors[known]
    covariance = spread @ spread.T
    covariance[blind] = np.nan
    covariance[:, blind] = np.nan
    covariance[blind, blind] = np.inf
    remarks = _missed(comparison, _noise_known(search))
    # where the motion misses the data, what it misses counts as their noise
    if not remarks or _noise_known(search):
        remarks += [_blind_sentence(names, row * scale, row) for row in rows[~known]]
    on_bound = np.minimum(x - search.low, search.high - x) <= 1e-9 * scale
    remarks += [
        f"{name} ended on its bound: the data ask for more than it allows"
        for name in np.array(names)[on_bound]
    ]
    if not all(np.isfinite(part.slopes).all() for part in comparison):
        remarks.append(
            "the motion has no derivative at some of the data, which were taken as fixed there"
        )
    own = {name: float(v) for name, v in zip(names, x, strict=True) if not name.startswith(START)}
    return Fit(
        system=problem.system.with_(own),
        values=dict(zip(names, x.tolist(), strict=True)),
        errors=dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
        covariance=covariance,
        chi2=size / noise**2,
        degrees=degrees,
        remarks=tuple(remarks),
        comparison=tuple(comparison),
        problem=problem,
        noise=noise,
        bounds={
            name: (float(a), float(b))
            for name, a, b in zip(names, search.low, search.high, strict=True)
        },
    )


def _missed(comparison: Iterable[Compared], noise_known: bool) -> list[str]:
    """A sentence for each quantity of which the best motion explains next to nothing."""
    missed = dict[str, float]()
    for part in comparison:
        names = np.array(part.quantity)
        for name in sorted(set(part.quantity) - {IMPACTS}):
            chosen = names == name
            measured = part.measured[chosen]
            variation = float(np.mean((measured - measured.mean()) ** 2))
            square = float(np.mean((measured - part.model[chosen]) ** 2))
            noise = float(np.mean(part.sigma[chosen] ** 2)) if noise_known else 0.0
            if square > max(FIT.left**2 * variation, FIT.noisy**2 * noise):
                share = math.sqrt(square / variation) if variation > 0.0 else math.inf
                missed[name] = max(share, missed.get(name, 0.0))
    return [
        f"the best motion explains next to nothing of {name}, of whose variation it misses"
        f" {share:.0%}: check the units of the data, the starts and the model"
        for name, share in missed.items()
    ]


def _blind_sentence(names: tuple[str, ...], direction: np.ndarray, shares: np.ndarray) -> str:
    """What the data do not tell, for a direction of the unknowns that changes nothing beyond the
    noise.
    """
    moved = [i for i in np.argsort(-np.abs(shares), kind="stable") if abs(shares[i]) > FIT.named]
    if len(moved) == 1:
        return (
            f"the data say nothing of {names[moved[0]]} beyond its bounds: the motion hardly "
            "changes with it"
        )
    largest = direction[moved[0]]
    steps = ", ".join(f"{names[i]} by {direction[i] / largest:+.3g}" for i in moved)
    together = " and ".join(names[i] for i in moved)
    return (
        f"the data do not tell {together} apart: changed together, {steps}, they leave the "
        "motion as it is"
    )
