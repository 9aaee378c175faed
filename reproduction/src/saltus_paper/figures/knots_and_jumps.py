"""Motions behind points of a spectrum, from its DataTree: orbits solved anew, knots of a curve,
jumps at the folds of loops.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus import MotionError, System, find_orbit, simulate_many
from saltus.orbits import orbits_of
from saltus.plots import smooth_lines
from saltus_paper.figure_data import dataset, largest_angle, scalar_dataset
from saltus_paper.measures.spectrum_features import detached, first_fold, main_branch, turning


@dataclass(frozen=True, slots=True, kw_only=True)
class KnotSettings:
    """How knots are solved for, and how long motions are followed past a fold."""

    phases: int = 361  # The number of phases of a forcing period at which motions are given.
    # The relative distance past a fold at which motions start: nearer to it they linger at the lost
    # orbit.
    beyond: float = 3e-3
    # A point of a branch within this relative distance of a fold may be the fold itself.
    apart: float = 1e-5
    # Motions that differ by less, in rad, are one motion that was reached from two points.
    distinct: float = 1e-6
    settle: int = 800  # The number of forcing periods for which a motion past a fold is followed.
    last: int = 12  # The number of the last of these periods from which its extrema are taken.


SETTINGS = KnotSettings()


def orbit_at(branch: Any, index: int, value: float) -> Any:
    """The orbit of a branch near its point `index`, solved at a value of the parameter; None where
    Newton does not converge.
    """
    (near,) = orbits_of(branch.isel(point=[index]))
    if value == float(branch["parameter"][index]):
        return near
    theta, velocity = near.state
    system = near.system.with_({str(branch.attrs["path"]): value})
    try:
        return find_orbit(
            system, theta=float(theta), velocity=float(velocity), period=near.period, settle=0
        )
    except MotionError:
        return None


def knots(spectrum: Any) -> Any:
    """Where the amplitude curve of the main branch crosses itself: two stable motions of one
    amplitude and frequency.

    Returns a Dataset over `knot`: `parameter`, `amplitude` (knot, orbit), `theta` (knot, orbit,
    phase) over one forcing period, `peak` (knot, orbit), the forcing phase of max theta, and
    `apart`, the largest difference of the two motions at one instant.
    """
    branch = main_branch(spectrum)
    rows = [
        row
        for i, j, value in _self_crossings(branch)
        if (row := _knot(branch, i, j, value)) is not None
    ]
    rows = [pair for pair in rows if np.abs(pair[0][2] - pair[1][2]).max() > SETTINGS.distinct]
    phase = np.linspace(0.0, 2 * np.pi, SETTINGS.phases)
    theta = np.array([[row[2] for row in pair] for pair in rows]).reshape(-1, 2, SETTINGS.phases)
    return dataset(
        {
            "parameter": (
                "knot",
                np.array([pair[0][0] for pair in rows]),
                "1",
                str(spectrum.attrs["path"]),
            ),
            "amplitude": (
                ("knot", "orbit"),
                np.array([[row[1] for row in pair] for pair in rows]).reshape(-1, 2),
                "rad",
            ),
            "theta": (("knot", "orbit", "phase"), theta, "rad", "theta over one forcing period"),
            "peak": (
                ("knot", "orbit"),
                phase[theta.argmax(axis=2)],
                "rad",
                "phase of the load at max theta",
            ),
            "apart": (
                "knot",
                np.abs(theta[:, 0] - theta[:, 1]).max(axis=1),
                "rad",
                "largest difference at one instant",
            ),
        },
        {"phase": ("phase", phase, "rad", "Omega tau")},
        what="knots of the amplitude curve",
    )


def _self_crossings(branch: Any) -> list[tuple[int, int, float]]:
    """(i, j, parameter) where stable parts of the amplitude curve cross, i and j the points of the
    branch nearest by.
    """
    start, step, near = _stable_steps(branch)
    low, high = np.sort([start, start + step], axis=0)
    i, j = np.nonzero(np.triu(_overlap(low[:, 0], high[:, 0]) & _overlap(low[:, 1], high[:, 1]), 2))
    det = step[i, 0] * step[j, 1] - step[i, 1] * step[j, 0]
    between = start[j] - start[i]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (between[:, 0] * step[j, 1] - between[:, 1] * step[j, 0]) / det
        w = (between[:, 0] * step[i, 1] - between[:, 1] * step[i, 0]) / det
    crossed = (np.minimum(u, w) > 0) & (np.maximum(u, w) < 1)
    i, j, u = i[crossed], j[crossed], u[crossed]
    return [
        (int(near[a]), int(near[b]), float(start[a, 0] + t * step[a, 0]))
        for a, b, t in zip(i, j, u, strict=True)
    ]


def _overlap(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which of some intervals have values in common, (n, n)."""
    return np.asarray((low[:, None] <= high) & (low <= high[:, None]))


def _stable_steps(branch: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The drawn line where it is stable: starts of its steps, their differences (n, 2), and the
    nearest points of the branch.
    """
    places = np.stack([branch["parameter"].values, branch["amplitude"].values], axis=1)
    starts = [np.empty((0, 2))]
    steps = [np.empty((0, 2))]
    near = [np.empty(0, dtype=int)]
    for line in smooth_lines(branch):
        if line.stable:
            own = np.array(line.points or [line.points.start - 1, line.points.start])
            distance = np.linalg.norm(
                (line.places[:-1, None] - places[own]) / np.ptp(places, axis=0), axis=2
            )
            starts, steps = [*starts, line.places[:-1]], [*steps, np.diff(line.places, axis=0)]
            near.append(own[distance.argmin(axis=1)])
    return np.concatenate(starts), np.concatenate(steps), np.concatenate(near)


def _knot(
    branch: Any, i: int, j: int, value: float
) -> list[tuple[float, float, np.ndarray]] | None:
    """Both orbits at the parameter at which their amplitudes are equal to rounding: (parameter,
    amplitude, theta) of each.
    """
    from scipy.optimize import newton

    def both(x: float) -> list[Any]:
        orbits = [orbit_at(branch, index, x) for index in (i, j)]
        if None in orbits:
            raise ArithmeticError
        return orbits

    def difference(x: float) -> float:
        one, two = both(x)
        return float(one.amplitude - two.amplitude)

    try:
        value = float(newton(difference, value, x1=value * (1 + 1e-4), tol=1e-13, rtol=1e-14))
        orbits = both(value)
    except (ArithmeticError, RuntimeError):
        return None
    if not all(orbit.stable and orbit.admissible for orbit in orbits):
        return None
    return [(value, orbit.amplitude, over_a_period(orbit)) for orbit in orbits]


def over_a_period(orbit: Any) -> np.ndarray:
    """theta of an orbit of one forcing period at `SETTINGS.phases` phases of the load, from 0 to 2
    pi.
    """
    start = float(orbit.start().get("time", 0.0))
    times = np.linspace(0.0, 2 * np.pi, SETTINGS.phases) / orbit.frequency
    return np.asarray(
        orbit.motion().at(start + np.mod(times - start, orbit.duration))[0], dtype=float
    )


def jumps(spectrum: Any) -> Any:
    """What becomes of the motions of detached loops just past the folds where their stability ends,
    by direct simulation.

    Returns a Dataset over `jump`: `branch`, `fold` and `value`, the parameter at the fold and past
    it, `before` and `after`, the largest abs(theta) of the orbit at the fold and of the motion past
    it once it has settled.
    """
    system = System.from_json(str(spectrum.attrs["system"]))
    low, high = spectrum.attrs["bounds"]
    rows = []
    for number, branch in detached(spectrum):
        for fold in turning(branch):
            orbit, sign = _last_stable(branch, float(fold))
            if orbit is not None and low < fold < high:
                rows.append(
                    (number, float(fold), float(fold * (1 + sign * SETTINGS.beyond)), orbit)
                )
    orbits = [row[3] for row in rows]
    columns = {
        name: ("jump", np.array([row[k] for row in rows]), "1")
        for k, name in ((1, "fold"), (2, "value"))
    }
    return dataset(
        {
            "branch": ("jump", np.array([row[0] for row in rows], dtype=int)),
            **columns,
            "before": ("jump", np.array([orbit.amplitude for orbit in orbits]), "rad"),
            "after": (
                "jump",
                _settled(system, str(spectrum.attrs["path"]), columns["value"][1], orbits),
                "rad",
            ),
        },
        what="jumps past the folds of detached loops",
    )


def birth(spectrum: Any) -> Any:
    """The beginning of the main branch: the largest abs(theta) of its orbit at the first fold, and
    of the motion below it.
    """
    system = System.from_json(str(spectrum.attrs["system"]))
    branch = main_branch(spectrum)
    fold, size = first_fold(branch)
    orbit, _ = _last_stable(branch, fold) if np.isfinite(fold) else (None, 0.0)
    value = np.array([fold * (1 - SETTINGS.beyond)])
    after = (
        _settled(system, str(spectrum.attrs["path"]), value, [orbit])
        if orbit is not None
        else [np.nan]
    )
    return scalar_dataset(
        {"fold": fold, "before": size, "after": float(after[0])},
        what="birth of the first limit cycle",
    )


def _settled(system: Any, path: str, values: np.ndarray, orbits: list[Any]) -> np.ndarray:
    """The largest abs(theta) on which motions settle from orbits' own states at other values of the
    parameter, (n,).
    """
    if not orbits:
        return np.empty(0)
    starts: dict[str, Any] = {
        name: np.array([orbit.start().get(name, 0.0) for orbit in orbits])
        for name in ("theta", "velocity", "time")
    }
    ends = simulate_many(
        system,
        **starts,
        parameters={path: values},
        periods=SETTINGS.settle,
        sample=("extrema",),
        last=SETTINGS.last,
    )
    return largest_angle(ends)


def _last_stable(branch: Any, fold: float) -> tuple[Any, float]:
    """The stable orbit nearest to a fold, but not at it, and the sign of the direction in which
    there is none beyond the fold.
    """
    x = branch["parameter"].values
    stable = np.flatnonzero(
        branch["stable"].values & (np.abs(x - fold) > SETTINGS.apart * abs(fold))
    )
    if not stable.size:
        return None, 0.0
    nearest = int(stable[np.argmin(np.abs(x[stable] - fold))])
    return orbit_at(branch, nearest, float(x[nearest])), float(np.sign(fold - x[nearest]))
