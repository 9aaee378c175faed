"""The paper's smoothed sign compared with the exact equation: branches and special points, errors
and work over B.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus import System, continue_orbit, find_orbit, simulate, simulate_many, switch_branch
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import dataset, joined, largest_angle
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import BETA0, DAMPING, FREQUENCY, VERTICAL, under_force
from saltus_paper.figures.smoothing_panels import BOUNDS, MARKERS, REGULAR, draw

AMPLITUDE = 0.5  # Hhat
SHARPNESS = (20.0, 50.0, 100.0, 200.0, 400.0, 1000.0, 2000.0)  # B of the branches
# kind and frequency near which a special point is looked for, and how far away it may be
FEATURES = {
    "fold of the primary resonance (upper)": ("LP", 0.9088, 1e-3),
    "fold of the primary resonance (lower)": ("LP", 0.8485, 1e-3),
    "symmetry breaking": ("BPC", 0.284, 0.006),
    "fold beside the upper grazing": ("LP", 0.28467, 1e-4),
    "fold beside the lower grazing": ("LP", 0.268495, 2e-5),
}
KNOT = (0.8486, 0.8492)  # the values of Omega between which the amplitude curve crosses itself
CONFIRMED = 1e-3  # rad by which the amplitudes of a confirmed motion may differ
LONGEST_STEP = 1e-4  # the paper's Maximum Time Step
ENOUGH = 400.0  # B from which all stable motions must be confirmed


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkSettings:
    """The motion for which the work of an integrator is counted, and the values over which it
    is.
    """

    # The number of forcing periods: enough impacts for their number not to matter.
    periods: int = 20
    start: float = 0.3  # The angle in rad from which the motion starts at rest.
    # The values of B, up to where 1/B is below the errors shown.
    sharpness: tuple[float, ...] = (50.0, 200.0, 1e3, 5e3, 2e4)
    # The tolerances of the integrator, from rough to near its best.
    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10)


WORK = WorkSettings()


def compute(count: int = 161) -> Any:
    """Branches, features, confirmation at `count` frequencies, and the work of an independent
    integrator (DOP853).
    """
    branches = {sharpness: _branch(sharpness) for sharpness in (None, *SHARPNESS)}
    groups = {
        "exact" if b is None else f"B{b:g}": branch.to_xarray() for b, branch in branches.items()
    }
    groups |= {
        "broken": _broken(branches[None]).to_xarray(),
        "features": _features(branches),
        "confirmed": _confirmed(branches, count),
        "work": _work(),
    }
    parts = {name: xr.DataTree(group) for name, group in groups.items()}
    return joined(
        parts, what=f"the smoothed equation beside the exact one, load (i), Hhat = {AMPLITUDE}"
    )


def _system(sharpness: float | None, frequency: float = REGULAR) -> System:
    system = under_force(frequency=frequency, amplitude=AMPLITUDE)
    return system if sharpness is None else system.with_({"model.smoothing": sharpness})


def _branch(sharpness: float | None) -> Any:
    return continue_orbit(find_orbit(_system(sharpness), theta=0.3), FREQUENCY, BOUNDS)


def _broken(branch: Any) -> Any:
    """The branch of unsymmetric orbits that leaves the exact one."""
    (place,) = (p for p in branch.special if p.kind == "BPC")
    return switch_branch(place, BOUNDS, both=False)[0]


def _features(branches: dict[float | None, Any]) -> Any:
    """The places of the special points and of the knot, and the amplitude at `REGULAR`, by B; B =
    inf is the exact equation.
    """
    every = list(branches.values())
    place = np.array(
        [[_nearest(branch, *feature) for feature in FEATURES.values()] for branch in every]
    )
    return dataset(
        {
            "frequency": (
                ("sharpness", "feature"),
                place,
                "1",
                "Omega of the special point, NaN if there is none",
            ),
            "knot": (
                "sharpness",
                [_knot(branch) for branch in every],
                "1",
                "Omega at which the curve crosses itself",
            ),
            "regular": (
                "sharpness",
                [branch.at(REGULAR)[0].amplitude for branch in every],
                "rad",
                "max abs(theta)",
            ),
            "special": (
                "sharpness",
                [sum(p.kind in MARKERS for p in branch.special) for branch in every],
                "1",
                "number",
            ),
            "complete": (
                "sharpness",
                [_is_complete(branch) for branch in every],
                "1",
                "followed over all of the range",
            ),
        },
        {
            "sharpness": ("sharpness", [math.inf if b is None else b for b in branches]),
            "feature": ("feature", list(FEATURES)),
        },
        what="special points of the exact and of the smoothed branches",
    )


def _is_complete(branch: Any) -> bool:
    frequencies = [orbit.frequency for orbit in branch.orbits]
    return bool(np.allclose((min(frequencies), max(frequencies)), BOUNDS, rtol=0.0, atol=1e-9))


def _nearest(branch: Any, kind: str, place: float, within: float) -> float:
    found = [
        p.parameter for p in branch.special if p.kind == kind and abs(p.parameter - place) <= within
    ]
    return min(found, key=lambda value: abs(value - place)) if found else math.nan


def _knot(branch: Any) -> float:
    """The frequency at which two stable orbits of the branch have the same amplitude."""
    from scipy.optimize import brentq

    def difference(frequency: float) -> float:
        one, two = sorted(
            (orbit for orbit in branch.at(frequency) if orbit.stable),
            key=lambda orbit: orbit.state[1],
        )
        return float(one.amplitude - two.amplitude)

    return float(brentq(difference, *KNOT, xtol=1e-12))


def _confirmed(branches: dict[float | None, Any], count: int) -> Any:
    """The stable orbits of each smoothed branch at `count` frequencies, and the amplitudes on which
    exact motions from their states settle."""
    frequencies = np.linspace(*BOUNDS, count)[1:-1]
    rows = [
        (b, w, orbit.amplitude, *map(float, orbit.state))
        for b, branch in branches.items()
        if b is not None
        for w in frequencies
        for orbit in branch.at(float(w))
        if orbit.stable
    ]
    sharpness, frequency, amplitude, theta, velocity = np.array(rows, dtype=float).T
    late = simulate_many(
        _system(None),
        theta=theta,
        velocity=velocity,
        parameters={FREQUENCY: frequency},
        periods=400,
        sample="extrema",
        last=12,
    )
    return dataset(
        {
            "amplitude": ("motion", amplitude, "rad", "max abs(theta) of the smoothed orbit"),
            "settled": (
                "motion",
                largest_angle(late),
                "rad",
                "that of the exact motion from its state, periods 389 to 400",
            ),
            "sharpness": ("motion", sharpness, "1", "B"),
            "frequency": ("motion", frequency, "1", "Omega"),
        },
        what="exact motions from the states of stable smoothed orbits",
    )


def _work() -> Any:
    """Evaluations of the right-hand side and errors of the state after `WORK` periods by DOP853:
    smoothed, and with events.
    """
    system = _system(None)
    exact = simulate(system, theta=WORK.start, velocity=0.0, periods=WORK.periods, tol=1e-14)
    runs = {
        sharpness: [_integrated(sharpness, rtol) for rtol in WORK.tolerances]
        for sharpness in (*WORK.sharpness, math.inf)
    }
    evaluations = np.array([[count for count, _, _ in row] for row in runs.values()])
    error = np.array(
        [
            [math.hypot(x - exact.theta, v - exact.velocity) for _, x, v in row]
            for row in runs.values()
        ]
    )
    return dataset(
        {
            "evaluations": (
                ("sharpness", "rtol"),
                evaluations,
                "1",
                "evaluations of the right-hand side",
            ),
            "error": (
                ("sharpness", "rtol"),
                error,
                "1",
                "distance of the last state from that of the exact motion",
            ),
        },
        {"sharpness": ("sharpness", list(runs)), "rtol": ("rtol", list(WORK.tolerances))},
        what="work and error of DOP853",
        duration=float(exact.time),
    )


def _integrated(sharpness: float, rtol: float) -> tuple[int, float, float]:
    """Evaluations, and the last state: on one piece with the smoothed sign, or from impact to
    impact where B is inf.
    """
    from scipy.integrate import solve_ivp

    end = WORK.periods * 2 * math.pi / REGULAR
    beta0 = math.radians(BETA0)
    state = [WORK.start, 0.0]
    time = 0.0
    count = 0

    def rate(t: float, y: np.ndarray, side: float) -> list[float]:
        sign = side if math.isinf(sharpness) else math.tanh(sharpness * y[0] / 2)
        size = beta0 + sign * y[0]
        push = math.sin(size) * AMPLITUDE * math.sin(REGULAR * t) + sign * math.cos(size) * VERTICAL
        return [y[1], push - DAMPING * y[1] - y[0]]

    def crossing(t: float, y: np.ndarray, side: float) -> float:
        # the start of a piece is no crossing
        return float(y[0] * side + (1e-9 if t - time < 1e-6 else 0.0))

    crossing.terminal = True  # type: ignore[attr-defined]
    crossing.direction = -1  # type: ignore[attr-defined]
    side = 1.0
    while time < end:
        events = crossing if math.isinf(sharpness) else None
        piece = solve_ivp(
            rate,
            (time, end),
            state,
            method="DOP853",
            rtol=rtol,
            atol=rtol,
            events=events,
            args=(side,),
        )
        count, time = count + int(piece.nfev), float(piece.t[-1])
        state, side = (
            [0.0 if piece.status == 1 else float(piece.y[0, -1]), float(piece.y[1, -1])],
            -side,
        )
    return count, state[0], state[1]


def measure(data: Any) -> dict[str, Measured]:
    """The paper's statements on the smoothing, and the changes that it makes."""
    found = {
        **_accuracy(data["features"], data["confirmed"]),
        **_kinds(data),
        **_cost(data["work"]),
    }
    return found | {"abstract-branch-point": _branch_point(data["exact"], data["broken"])}


def _branch_point(exact: Any, broken: Any) -> Measured:
    """A symmetry breaking at which the stability of the symmetric orbits changes, with unsymmetric
    stable ones beside it.
    """
    here = exact["kind"].values == "BPC"
    place = float(exact["special_parameter"].values[here][0]) if here.any() else math.nan
    near = abs(exact["parameter"].values - place)
    first, second = (
        exact["stable"].values[np.where(side, near, np.inf).argmin()]
        for side in _sides(exact, place)
    )
    uneven = np.where(
        broken["stable"].values, abs(broken["highest"].values + broken["lowest"].values), 0.0
    )
    apart = float(uneven.max())
    return measured(bool(first != second and apart > 1e-3), place=place, apart=apart)


def _sides(branch: Any, place: float) -> tuple[np.ndarray, np.ndarray]:
    frequency = branch["parameter"].values
    return frequency < place, frequency > place


def _accuracy(features: Any, confirmed: Any) -> dict[str, Measured]:
    """Whether a B that is large enough gives the limit cycles, and stable motions that the exact
    equation confirms.
    """
    sharpness = features["sharpness"].values
    away = abs(confirmed["amplitude"].values - confirmed["settled"].values)
    rows: list[dict[str, Any]] = []
    for b in sharpness[1:]:
        here = confirmed["sharpness"].values == b
        wrong = here & (away > CONFIRMED)
        low = confirmed["frequency"].values[wrong].min(initial=9.0)
        high = confirmed["frequency"].values[wrong].max(initial=0.0)
        places = [{"low": float(low), "high": float(high)}] if wrong.any() else []
        rows.append(
            {"b": float(b), "orbits": int(here.sum()), "wrong": int(wrong.sum()), "places": places}
        )
    large = [row for row in rows if row["b"] >= ENOUGH]
    error = abs(features["regular"].values[1:] - features["regular"].values[0])
    order = -float(np.polyfit(np.log(sharpness[-3:]), np.log(error[-3:]), 1)[0])
    errors = [{"b": float(b), "error": float(e)} for b, e in zip(sharpness[1:], error, strict=True)]
    confirmed_all = len(large) > 1 and not any(row["wrong"] for row in large)
    return {
        "smoothing-limit-cycle": measured(
            bool(error[-1] < 1e-6 and features["complete"].values.all()),
            errors=errors,
            regular=REGULAR,
        ),
        "smoothing-confirmed": measured(
            confirmed_all, panels=rows, within=CONFIRMED, enough=ENOUGH
        ),
        "smoothing-order": measured(abs(order - 2) < 0.1, order=order),
    }


def _kinds(data: Any) -> dict[str, Measured]:
    """Where the smoothed branches have other special points than the exact one."""
    features = data["features"]
    exact, *smoothed = features["special"].values.tolist()
    lost = np.isnan(features["frequency"].values)
    knot = abs(features["knot"].values[1:] - features["knot"].values[0])
    folds = abs(features["frequency"].values[1:, :2] - features["frequency"].values[0, :2]).max(
        axis=1
    )
    rows = [
        {"b": float(b), "special": int(n), "lost": int(row.sum())}
        for b, n, row in zip(features["sharpness"].values[1:], smoothed, lost[1:], strict=True)
    ]
    few = np.isin(features["sharpness"].values[1:], (50.0, 100.0))
    return {
        "smoothing-grazings": measured(
            not lost[0].any()
            and all(n != exact for n in smoothed)
            and bool((lost[1:3].sum(axis=1) == 3).all()),
            exact=exact,
            panels=rows,
        ),
        "smoothing-primary": measured(
            bool(folds[few].max() < 1e-5 and knot[few].max() < 1e-5),
            knot=float(knot[few].max()),
            folds=float(folds[few].max()),
        ),
    }


def _cost(work: Any) -> dict[str, Measured]:
    """The evaluations for an error of 1e-8, smoothed and from impact to impact, and those that the
    paper's longest step takes.
    """
    exact, smoothed = (_needed(work, b, 1e-7) for b in (math.inf, 5000.0))
    steps = float(work.attrs["duration"]) / LONGEST_STEP
    numbers = {
        "exact": exact,
        "smoothed": smoothed,
        "ratio": smoothed / exact,
        "paper": 6 * steps,
        "step": LONGEST_STEP,
    }
    return {"smoothing-work": measured(exact < smoothed < 6 * steps, **numbers)}


def _needed(work: Any, sharpness: float, error: float) -> float:
    """The fewest evaluations that keep the error."""
    row = work.sel(sharpness=sharpness)
    kept = row["error"].values <= error
    return float(row["evaluations"].values[kept].astype(float).min(initial=math.inf))


FIGURE = paper_figure("smoothing", quick={"count": 41}, compute=compute, draw=draw, measure=measure)
