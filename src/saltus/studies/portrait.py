"""Phase portraits under a constant load: motions, the equilibria and the separatrices between
them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import Equilibrium, Separatrix, equilibria, plane_window, separatrices
from saltus.checks import check_count, check_number, check_states, checked_by
from saltus.errors import ParameterError
from saltus.flow import simulate
from saltus.progress import Progress, silent
from saltus.result import provenance
from saltus.systems import Box, System, VelocityReduction, Window, even_steps, unit_of_time

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class StartSettings:
    """Where motions begin unless their states are given."""

    spread: int = 24  # Number of states, spread evenly over the window.
    # Places tried for each state that is wanted, as a wall may take up a part of the window.
    tried: int = 100
    # Beside each stable equilibrium, at these shares of the way to the next one.
    beside: tuple[float, ...] = (0.35, 0.75)
    duration: float = 30.0  # of the motions, in the time of the slowest equilibrium


PORTRAIT_STARTS = StartSettings()


def _check(
    system: System,
    window: Box | None,
    starts: Any,
    duration: float | None,
    samples: int,
    seed: int,
    progress: object = None,
) -> None:
    if duration is not None:
        check_number("duration", duration, above=0.0)
    check_count("samples", samples, 2)
    check_count("seed", seed, 0)
    points = equilibria(system, window)  # refuses a system without a phase plane
    area = plane_window(window, system)
    _ = _spread(system, area, points, seed) if starts is None else _states(system, starts)


@checked_by(_check)
def phase_portrait(
    system: System,
    *,
    window: Box | None = None,
    starts: Iterable[tuple[float, float]] | None = None,
    duration: float | None = None,
    samples: int = 1500,
    seed: int = 0,
    progress: Progress = silent,
) -> xarray.Dataset:
    """The phase plane of a system with one coordinate under a constant load (the paper's Figs. 4
    and 5).

    Parameters
    ----------
    system
        What moves.
    window
        ((least, largest coordinate), (least, largest velocity)); by default 3 natural units to both
        sides of the contact, or of 0 without one.
    starts
        States (coordinate, velocity) from which motions are followed; by default two beside each
        stable equilibrium, and 24 spread over the window.
    duration
        How long; by default 30 times of the slowest equilibrium, or 30 of a model without units of
        time.
    samples
        Number of instants at which each motion is given, besides its impacts.
    seed
        The seed of the spread states.
    progress
        Called with the fraction done and what is being done, first when all arguments have been
        checked.

    Returns
    -------
    xarray.Dataset
        A Dataset. Over (motion, sample): `time`, the coordinate and `velocity`, with the velocities
        before and after each impact, and nan between them where they differ. Over `equilibrium`,
        the coordinates of all equilibria in the window: `stable`. Over (equilibrium, root): the
        parts `eigenvalue_real` and `eigenvalue_imaginary`, nan at the contact. Over (separatrix,
        point): `separatrix_<coordinate>` and `separatrix_velocity` of the stable manifolds of the
        saddles; there are none where the impact law has no inverse, and the attribute
        `no_separatrices` then says why.

    Raises
    ------
    ParameterError
        A load that varies, several coordinates, numbers, a window or starts without meaning.
    MotionError
        A motion that cannot be continued.

    Examples
    --------
    >>> portrait = saltus.phase_portrait(tristable, duration=5.0)
    >>> portrait.attrs["saltus_version"] == saltus.__version__
    True
    """
    area = plane_window(window, system)
    points = equilibria(system, area)
    duration = (
        PORTRAIT_STARTS.duration * _own_time(system, points) if duration is None else duration
    )
    states = _spread(system, area, points, seed) if starts is None else _states(system, starts)
    rows = []
    for i, state in enumerate(states):
        progress(0.8 * i / len(states), "following motions")
        rows.append(_sampled(system, state, duration, samples))
    progress(0.8, "separatrices")
    why = _no_inverse(system)
    curves = () if why else separatrices(system, area)
    progress(1.0, "done")
    facts = {"window": np.ravel(area).astype(float).tolist(), "duration": float(duration)}
    begun = "spread" if starts is None else "given"
    return _dataset(
        system,
        rows,
        points,
        curves,
        starts=begun,
        **facts,
        **({"no_separatrices": why} if why else {}),
    )


def _own_time(system: System, points: tuple[Equilibrium, ...]) -> float:
    """The longest time in which motions move beside an equilibrium; 1 of a model without units of
    time, and the natural time where there is none."""
    if system.model.dimensionless:
        return 1.0
    products = [
        abs(point.eigenvalues[0] * point.eigenvalues[1]) for point in points if point.eigenvalues
    ]
    slowest = min((product for product in products if product > 0.0), default=0.0)
    return 1.0 / math.sqrt(slowest) if slowest else unit_of_time(system)


def _spread(system: System, area: Window, points: tuple[Equilibrium, ...], seed: int) -> np.ndarray:
    """States (n, 2) beside the stable equilibria, and spread evenly over the part of the window in
    which the system can be.
    """
    tried = PORTRAIT_STARTS.tried * PORTRAIT_STARTS.spread
    shifts = np.arange(1, tried + 1)[:, None] * even_steps(2)
    states = area.centre + area.half * (
        2.0 * ((np.random.default_rng(int(seed)).random(2) + shifts) % 1.0) - 1.0
    )
    states = states[system.model.reaches(system.model.coordinates[0], states[:, 0])][
        : PORTRAIT_STARTS.spread
    ]
    if not len(states):
        raise ParameterError(
            f"window must reach to where the system can be, got {tuple(area)!r}: all of it is beyond "
            "the contact",
            "window",
        )
    ends = [*(point.place for point in points), *area[0]]
    near = [
        (_beside(point.place, ends, share), 0.0)
        for point in points
        if point.stable
        for share in PORTRAIT_STARTS.beside
    ]
    return np.concatenate([np.array(near).reshape(-1, 2), states])


def _beside(place: float, ends: list[float], share: float) -> float:
    """A coordinate at a share of the way from an equilibrium to the nearest other one, or the end
    of the window.
    """
    nearest = min((end for end in ends if end != place), key=lambda end: abs(end - place))
    return place + share * (nearest - place)


def _states(system: System, starts: Any) -> np.ndarray:
    """The given states (n, 2), checked."""
    states = check_states("starts", starts)
    if not len(states):
        raise ParameterError(
            "starts must be states (coordinate, velocity), such as [[0.3, 0.0]], and there is none",
            "starts",
        )
    beyond = states[~system.model.reaches(system.model.coordinates[0], states[:, 0])]
    if len(beyond):
        raise ParameterError(
            f"starts must lie where the system can be, and {beyond[0].tolist()} is beyond the "
            "contact",
            "starts",
        )
    return states


def _no_inverse(system: System) -> str:
    """Why motions cannot be followed backward through impacts; an empty text if they can."""
    if isinstance(system.impact, VelocityReduction) and system.impact.e > 0.0:
        return ""
    return f"{type(system.impact).__name__} cannot be followed backward"


def _sampled(system: System, state: np.ndarray, duration: float, samples: int) -> np.ndarray:
    """(3, n): times, coordinate and velocity of a motion, with both sides of its impacts."""
    begin: dict[str, Any] = {system.model.coordinates[0]: float(state[0])}
    motion = simulate(system, **begin, velocity=float(state[1]), duration=duration)
    times = np.linspace(0.0, motion.time, samples)
    position, velocity = (
        np.asarray(x, dtype=float).reshape(samples, -1)[:, 0] for x in motion.at(times)
    )
    impacts = motion.impacts
    before = impacts.velocity_before
    after = impacts.velocity_after
    at = np.full(len(impacts), float(system.model.contact))
    gap = np.full(len(impacts), np.nan)
    parts = [(times, position, velocity), (impacts.time, at, before)]
    parts += (
        [(impacts.time, gap, gap), (impacts.time, at, after)] if (before != after).any() else []
    )
    row = np.concatenate([np.stack(part) for part in parts], axis=1)
    return np.asarray(row[:, np.argsort(row[0], kind="stable")])


def _dataset(
    system: System,
    rows: list[np.ndarray],
    points: tuple[Equilibrium, ...],
    curves: tuple[Separatrix, ...],
    **facts: Any,
) -> xarray.Dataset:
    """The motions, equilibria and separatrices as a Dataset; `facts` are further attributes."""
    import xarray

    name = system.model.coordinates[0]
    unit = system.model.unit_of(name)
    motions = _padded(rows)
    lines = (
        _padded([np.stack([curve.theta, curve.velocity]) for curve in curves])
        if curves
        else np.empty((0, 2, 0))
    )
    roots = np.array(
        [point.eigenvalues or (complex(np.nan, np.nan),) * 2 for point in points], dtype=complex
    ).reshape(-1, 2)
    stable = np.array([point.stable for point in points], dtype=bool)
    places = np.array([point.place for point in points])
    over = ("motion", "sample")
    curve = ("separatrix", "point")
    each = ("equilibrium", "root")
    columns = {
        "time": (over, motions[:, 0], "1", "dimensionless time"),
        name: (over, motions[:, 1], unit, name),
        "velocity": (over, motions[:, 2], unit, f"d {name} / d tau"),
        "stable": (("equilibrium",), stable, "1", "no disturbance grows"),
        "eigenvalue_real": (
            each,
            roots.real,
            "1",
            "real part of the eigenvalues, nan at the contact",
        ),
        "eigenvalue_imaginary": (each, roots.imag, "1", "their imaginary part"),
        f"separatrix_{name}": (curve, lines[:, 0], unit, "stable manifolds of the saddles"),
        "separatrix_velocity": (curve, lines[:, 1], unit, "velocity on them"),
        "equilibrium": (("equilibrium",), places.astype(float), unit, f"{name} of the equilibria"),
    }
    contact: dict[str, Any] = (
        {"contact": float(system.model.contact)} if system.model.has_one_contact else {}
    )
    title = "phase portrait computed by saltus"
    attributes = provenance(
        system, title=title, kind="phase_portrait", coordinate=name, **contact, **facts
    )
    data = {
        key: (dims, values, {"units": units, "long_name": text})
        for key, (dims, values, units, text) in columns.items()
    }
    return xarray.Dataset(data, attrs=attributes)


def _padded(rows: list[np.ndarray]) -> np.ndarray:
    """Arrays (k, n) of different lengths n as one, (rows, k, longest), filled up with nan."""
    out = np.full((len(rows), rows[0].shape[0], max(row.shape[1] for row in rows)), np.nan)
    for i, row in enumerate(rows):
        out[i, :, : row.shape[1]] = row
    return out
