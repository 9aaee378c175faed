"""An ensemble as an xarray Dataset, with units and provenance."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import layout as k
from saltus.flow.lanes import layout as at
from saltus.flow.tangent import FREQUENCY

if TYPE_CHECKING:
    import xarray

    from saltus.flow.lanes.run import Ends, Jobs
    from saltus.systems import System

# Which columns of the driver's samples a name of `sample` keeps, for so many coordinates.
KEPT: dict[str, Callable[[int], list[int]]] = {
    "state": lambda own: list(range(2 * own)),
    "extrema": lambda own: [2 * own, 2 * own + 1],
    "speed": lambda own: [2 * own + 2],
    "crossings": lambda own: [2 * own + 3],
}
# Why a trajectory ended: the driver's reason, and its name.
STOPS = {
    k.DONE: "horizon",
    -1: "rest",  # the time asked for, at rest
    k.LIMITED: "limit",
    at.CAPTURED: "captured",
    at.SETTLED: "settled",
    k.NOT_UNIQUE: "not_unique",
    k.NO_IMPACT: "no_impact",
    k.NOT_FINITE: "not_finite",
    k.STALLED: "stalled",
    at.OUTSIDE: "outside",
    at.UNRESOLVED: "unresolved",
}
MEANINGS = {
    "horizon": "the time asked for",
    "rest": "the time asked for, at rest",
    "limit": "a margin of the model reached zero",
    "captured": "proved to be captured at rest for all later loads",
    "settled": "repeats itself every `cycle` forcing periods",
    "not_unique": "the motion from rest at contact is not unique",
    "no_impact": "the impact law has no velocity after the impact",
    "not_finite": "the motion leaves the range of numbers",
    "stalled": "the acceleration is singular",
    "outside": "the state at the start lies beyond the contact",
    "unresolved": "impacts accumulate too slowly to be followed: more than a million in a forcing period",
}


# Names that the dataset needs for itself, besides the coordinates and velocities of the model.
TAKEN = (
    *("period", "state", "column", "time", "side", "stop", "limit", "cycle", "crossings", "grazings", "periods"),
    *("chatter_speed", "derivative", "least_speed", "period_crossings"),
)


def check_dims(dims: tuple[str, ...], system: System) -> None:
    """Refuse a dimension that has the name of a result."""
    for dim in dims:
        if dim in (*TAKEN, *system.model.coordinates) or (dim.endswith("velocity") and not dim.startswith("initial_")):
            raise ParameterError(f"a dimension cannot be called {dim!r}, as a result is; call it initial_{dim}, or as you like")


def to_dataset(
    system: System,
    jobs: Jobs,
    ends: Ends,
    dims: tuple[str, ...],
    shape: tuple[int, ...],
    coords: dict[Any, Any],
    inputs: dict[str, Any],
    limits: tuple[str, ...],
    paths: tuple[str, ...] | None,
    sample: tuple[str, ...],
    periods: float | None,
    tol: float,
    until: tuple[str, ...],
) -> xarray.Dataset:
    """The ends of all trajectories and what was sampled of them."""
    import xarray

    from saltus import __version__

    names = system.model.coordinates
    own, rows = len(names), jobs.states.shape[1] // 2
    known = {name: given if hasattr(given, "dims") else (name, given) for name, given in coords.items()}
    variables: dict[str, Any] = {}

    def add(name: str, values: np.ndarray, unit: str, text: str, *extra: str, **more: Any) -> None:
        reshaped = values.reshape((*shape, *values.shape[1:]))
        variables[name] = ((*dims, *extra), reshaped, {"units": unit, "long_name": text} | more)

    rates = ["velocity" if own == 1 else f"{name}_velocity" for name in names]
    for i, (name, rate) in enumerate(zip(names, rates, strict=True)):
        unit = "rad" if name.startswith("theta") else "1"
        add(name, ends.states[:, i], unit, f"{name} at the end")
        add(rate, ends.states[:, rows + i], unit, f"d {name} / d tau at the end")
    lengths = jobs.numbers[:, 1]
    add("time", ends.labels[:, 4] * lengths + ends.numbers[:, 0], "1", "dimensionless time tau at the end")
    held = (ends.labels[:, 2] == k.REST) | (ends.labels[:, 2] == k.CHATTER)
    add("side", np.where(held, 0, ends.labels[:, 3]).astype(np.int8), "1", "side at the end, 0 at rest")
    add("crossings", ends.labels[:, 5], "1", "impacts")
    add("grazings", ends.labels[:, 6], "1", "touches of the contact without an impact")
    add("periods", ends.labels[:, 7], "1", "forcing periods that were ended")
    _add_stops(add, ends, limits, until)
    add("chatter_speed", ends.numbers[:, 1], "1", "speed of the gap after impacts too small to be followed, else 0")
    _add_samples(add, ends, names, rates, sample)
    if paths is not None:
        _add_derivatives(add, jobs, ends, names, rates, paths, periods)
    attributes: dict[str, Any] = {
        "title": "ensemble computed by saltus",
        "saltus_version": __version__,
        "system": system.to_json(),
        "tol": tol,
        "Conventions": "CF-1.8",
    }
    for name, values in inputs.items():
        where = f"initial_{name}" if name in (*names, *rates, "time") else name
        if where in dims:  # it is a coordinate
            continue
        if np.ndim(values):
            add(where, values, "1", f"{name} at the start" if where != name else f"parameter {name}")
        else:
            attributes[where] = float(values)
    if paths is not None:
        known |= {"state": ("state", [*names, *rates]), "column": ("column", [*names, *rates, *paths])}
    return xarray.Dataset(variables, known, attributes)


def _add_stops(add: Any, ends: Ends, limits: tuple[str, ...], until: tuple[str, ...]) -> None:
    reasons = ends.labels[:, 0].copy()
    reasons[(reasons == k.DONE) & (ends.labels[:, 2] == k.REST)] = -1
    codes = np.full(reasons.shape, -1, dtype=np.int8)
    for code, reason in enumerate(STOPS):
        codes[reasons == reason] = code
    comment = "; ".join(f"{name}: {MEANINGS[name]}" for name in STOPS.values())
    add("stop", codes, "1", "why it ended", **_flags(tuple(STOPS.values())), comment=comment)
    if limits:
        which = np.where(reasons == k.LIMITED, ends.labels[:, 1], -1).astype(np.int8)
        add("limit", which, "1", "the margin that ended it, -1 for none", **_flags(limits))
    if "settled" in until:
        cycle = np.where(reasons == at.SETTLED, ends.labels[:, 1], 0)
        add("cycle", cycle, "1", "forcing periods after which it repeats itself, 0 where it has not settled")


def _flags(names: tuple[str, ...]) -> dict[str, Any]:
    """What the numbers 0, 1, ... stand for, as the CF conventions write it."""
    return {"flag_values": np.arange(len(names), dtype=np.int8), "flag_meanings": " ".join(names)}


def _add_samples(add: Any, ends: Ends, names: Any, rates: list[str], sample: tuple[str, ...]) -> None:
    """What was kept of the last forcing periods, in the order of time, nan where there were fewer."""
    kept = ends.samples.shape[1]
    done = ends.labels[:, 7]
    order = (done[:, None] + np.arange(kept)) % kept  # the ring's oldest first
    missing = np.arange(kept)[None, :] < (kept - done)[:, None]
    samples = np.take_along_axis(ends.samples, order[:, :, None], axis=1)
    samples[missing] = np.nan
    column, first = 0, names[0]
    texts = {
        "state": [(f"sampled_{name}", f"{name} at the end of the forcing period") for name in (*names, *rates)],
        "extrema": [
            (f"largest_{first}", f"the largest {first} in the forcing period"),
            (f"smallest_{first}", f"the smallest {first}"),
        ],
        "speed": [("least_speed", "the least speed before an impact in the forcing period, inf without impacts")],
        "crossings": [("period_crossings", "impacts in the forcing period")],
    }
    for name in KEPT:
        if name in sample:
            for variable, text in texts[name]:
                add(variable, np.ascontiguousarray(samples[:, :, column]), "1", text, "period")
                column += 1


def _add_derivatives(
    add: Any, jobs: Jobs, ends: Ends, names: Any, rates: list[str], paths: tuple[str, ...], periods: float | None
) -> None:
    """The derivatives of the end state to the initial one and to parameters, (..., state, column)."""
    own, rows = len(names), jobs.states.shape[1] // 2
    columns = [*names, *rates, *paths]
    q = ends.states[:, own:rows].reshape(-1, len(columns), own)
    v = ends.states[:, rows + own :].reshape(-1, len(columns), own)
    derivative = np.concatenate([q, v], axis=2).transpose(0, 2, 1).copy()
    slope = np.concatenate([ends.states[:, rows : rows + own], ends.numbers[:, 5 : 5 + own]], axis=1)
    limited = ends.labels[:, 0] == k.LIMITED  # the end moves with the margin
    with np.errstate(invalid="ignore"):  # the instant of a margin met without speed has no derivative
        derivative[limited] += slope[limited, :, None] * ends.numbers[limited, None, 5 + own :]
    if periods is not None and FREQUENCY in paths:
        moving = np.isin(ends.labels[:, 0], (k.DONE, at.SETTLED)) & (ends.labels[:, 2] == k.ARC)
        length = jobs.numbers[:, 1]
        start = jobs.labels[:, 0] * length + jobs.numbers[:, 0]
        span = ends.labels[:, 4] * length + ends.numbers[:, 0] - start
        shift = np.where(moving, -span * length / (2.0 * np.pi), 0.0)  # d(end)/dW = -span / W
        derivative[:, :, columns.index(FREQUENCY)] += np.where(moving[:, None], shift[:, None] * slope, 0.0)
    add("derivative", derivative, "1", "derivative of the state at the end", "state", "column")
