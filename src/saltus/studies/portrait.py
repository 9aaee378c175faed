"""Phase portraits under a constant load: motions, the equilibria and the separatrices between them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.separatrices import saddles, separatrices
from saltus.errors import ParameterError
from saltus.flow import simulate
from saltus.orbits.search import initial_states
from saltus.systems import System, VelocityReduction
from saltus.systems.checks import check_number

if TYPE_CHECKING:
    import xarray

WINDOW = ((-3.0, 3.0), (-3.0, 3.0))
MOTIONS = 24  # from states spread evenly over the window, unless they are given


def phase_portrait(
    system: System,
    *,
    window: tuple[tuple[float, float], tuple[float, float]] = WINDOW,
    starts: Iterable[tuple[float, float]] | None = None,
    duration: float = 30.0,
    samples: int = 1500,
    seed: int = 0,
) -> xarray.Dataset:
    """The phase plane of a system with one coordinate under a constant load (the paper's Figs. 4 and 5).

    Args:
        system: what moves.
        window: the least and the largest coordinate, then velocity.
        starts: states (coordinate, velocity) from which motions are followed; by default 24 spread over the window.
        duration: how long, in dimensionless time.
        samples: instants at which each motion is given; the two sides of an impact apart, so that the velocity may jump.
        seed: of the spread.

    Returns:
        A Dataset: `time`, the coordinate and `velocity` over (motion, sample), nan between the pieces that impacts part; the
        `saddle`s; `separatrix_<coordinate>` and `separatrix_velocity` over (separatrix, point), where the impact law has an
        inverse.

    Raises:
        ParameterError: a load that varies, several coordinates, a window or starts without meaning.
    """
    check_number("duration", duration, above=0.0)
    points = saddles(system, window)  # which refuses what has no phase plane
    (left, right), (low, high) = window
    if starts is None:
        half = (0.5 * (right - left), 0.5 * (high - low))
        states = initial_states(system, MOTIONS, half, seed)
    else:
        states = _states(starts)
    name = system.model.coordinates[0]
    rows = [_sampled(system, name, state, duration, samples) for state in states]
    parting = separatrices(system, window) if _invertible(system) else ()
    return _dataset(system, name, rows, [p.theta for p in points], parting, window)


def _states(starts: Any) -> np.ndarray:
    try:
        states = np.array([[float(x) for x in state] for state in starts])
    except (TypeError, ValueError):
        states = np.empty(0)
    if states.ndim != 2 or states.shape[1] != 2 or not len(states) or not np.isfinite(states).all():
        raise ParameterError(f"starts must be states (coordinate, velocity), such as [[0.3, 0.0]], got {starts!r:.80}")
    return states


def _invertible(system: System) -> bool:
    """Whether a motion can be followed back through impacts."""
    return not system.model.sides or (isinstance(system.impact, VelocityReduction) and system.impact.e > 0.0)


def _sampled(system: System, name: str, state: np.ndarray, duration: float, samples: int) -> np.ndarray:
    """(3, n): times, coordinate and velocity; nan at each impact."""
    begin: dict[str, Any] = {name: float(state[0])}
    motion = simulate(system, **begin, velocity=float(state[1]), duration=duration)
    times = np.linspace(0.0, motion.time, samples)
    position, velocity = (np.asarray(x, dtype=float) for x in motion.at(times))
    row = np.stack([times, position.reshape(samples, -1)[:, 0], velocity.reshape(samples, -1)[:, 0]])
    impacts = np.searchsorted(times, motion.crossings.time)
    jumps = np.abs(motion.crossings.velocity_after - motion.crossings.velocity_before) > 0.0
    return np.asarray(np.insert(row, np.unique(impacts[jumps]), np.nan, axis=1))


def _dataset(system: System, name: str, rows: Any, points: list[float], parting: Any, window: Any) -> xarray.Dataset:
    import xarray

    from saltus import __version__

    unit = "rad" if name.startswith("theta") else "1"
    motions = _padded(rows)
    curves = _padded([np.stack([s.theta, s.velocity]) for s in parting]) if parting else np.empty((0, 2, 0))
    columns = {
        "time": (("motion", "sample"), motions[:, 0], {"units": "1", "long_name": "dimensionless time"}),
        name: (("motion", "sample"), motions[:, 1], {"units": unit, "long_name": name}),
        "velocity": (("motion", "sample"), motions[:, 2], {"units": "1", "long_name": f"d {name} / d tau"}),
        "saddle": ("equilibrium", np.array(points), {"units": unit, "long_name": "saddle equilibria"}),
        f"separatrix_{name}": (
            ("separatrix", "point"),
            curves[:, 0],
            {"units": unit, "long_name": "stable manifolds of the saddles"},
        ),
        "separatrix_velocity": (("separatrix", "point"), curves[:, 1], {"units": "1", "long_name": "velocity on them"}),
    }
    attributes = {
        "title": "phase portrait computed by saltus",
        "kind": "phase_portrait",
        "system": system.to_json(),
        "saltus_version": __version__,
        "coordinate": name,
        "window": [float(x) for pair in window for x in pair],
    }
    return xarray.Dataset(columns, attrs=attributes)


def _padded(rows: list[np.ndarray]) -> np.ndarray:
    """Arrays (k, n) of various lengths as one (rows, k, longest), nan behind each."""
    out = np.full((len(rows), rows[0].shape[0], max(row.shape[1] for row in rows)), np.nan)
    for i, row in enumerate(rows):
        out[i, :, : row.shape[1]] = row
    return out
