"""Stability charts: the stable motions beside rest, in the plane of two parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Rectangle, check_along, check_axis, check_count, check_number, check_path, check_window, checked_by
from saltus.errors import ParameterError
from saltus.studies.chart.cells import MOTIONS
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

    from saltus.sweep import Plan

STARTS = 12  # initial states in each cell
LONGEST = 6  # forcing periods of a motion that counts
LEAST = 1e-3  # rad: smaller motions are not told from rest
DECAY = 75.0  # a motion settles, or counts as unsettled, while exp(-C tau / 2) falls to exp(-75), as a rule
FEWEST, MOST = 40, 1200  # but within so many forcing periods
TOL = 1e-10  # with larger errors the motion beside an equilibrium would not come to a halt
ROWS = 101  # of the chart in one chunk: more chunks keep more of a run that is killed, and know less of their neighbours
CELLS = "saltus.studies.chart.cells:cells"


def _check(
    system: System, store: Any, workers: object, scheduler: object, progress: object, periods: int | None, **options: Any
) -> None:
    from saltus.sweep import check_store

    axes = [_default_axis(name, options.pop(name)) for name in ("horizontal", "vertical")]
    work = plan(system, *axes, periods=settling(system) if periods is None else periods, **options)
    if store is not None:
        check_store(work, Path(store))


def _default_axis(name: str, values: Any) -> Any:
    if values is not None:
        return values
    return np.linspace(0.0, 0.5, 101) if name == "horizontal" else np.linspace(-2.0, 0.0, 101)


@checked_by(_check)
def stability_chart(
    system: System,
    *,
    horizontal: Iterable[float] | None = None,
    vertical: Iterable[float] | None = None,
    paths: tuple[str, str] = ("load.horizontal.amplitude", "load.vertical"),
    max_period: int = LONGEST,
    starts: int = STARTS,
    window: Rectangle | None = None,
    least: float = LEAST,
    periods: int | None = None,
    tol: float = TOL,
    seed: int = 0,
    rows: int = ROWS,
    store: Any = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[..., object] | None = None,
) -> xarray.Dataset:
    """The largest amplitude of the stable motions beside rest, and their number, over the plane of two parameters (Figs. 14, 15).

    In every cell motions are followed from `starts` initial states, spread evenly over the window and drawn in towards the
    contact, and from every stable motion of the neighbouring cells of the same chunk, until that adds nothing new. So a motion
    is followed to where its stability ends, even where next to nothing leads to it. Deformed equilibria, under no
    horizontal load, are motions too.

    Below Hcr small stable motions of 6, 10, 14, ... impacts accumulate towards rest, so their number depends on what
    still counts: those of an amplitude of at least `least`. What is smaller is not told from rest.

    Args:
        system: what moves, under a load with a frequency.
        horizontal, vertical: the values along the two axes, by default 101 from 0 to 0.5 and from -2 to 0.
        paths: the dotted paths of the parameters along them.
        max_period: the longest period of a motion, in forcing periods; what repeats later counts as unsettled.
        starts, window, seed: initial states, as `search_orbits` takes them.
        least: the smallest amplitude that counts.
        periods: forcing periods after which a motion that has not settled counts as unsettled; by default what the damping takes.
        tol: the error of a step, see `simulate_many`.
        rows: how many rows are one chunk, within which neighbours know of one another.
        store, workers, scheduler, progress: where the chunks are kept and who computes them, see `saltus.sweep.execution`.

    Returns:
        A Dataset over (vertical, horizontal): `amplitude` of the largest motion (rad, NaN where there is none), its `period`,
        `smallest_amplitude`, the `count` of motions (mirror images count once), whether some start was captured at `rest`,
        and how many starts ended on `tiny` motions, or `unsettled`; with `motion` up to 8 motions by falling amplitude:
        `motion_amplitude`, `motion_other` (the extremum on the other side, counted positive there; that of a symmetric motion is
        its amplitude), `motion_period`, `motion_impact_count` (impacts in a period of the motion), and the state at phase 0,
        `motion_theta` and `motion_velocity`. For the metainterface also `beyond_line` and `beyond_kinematic`: whether the largest
        motion goes beyond pi - beta0, or 2 (pi - beta0) (erratum 20).

    Raises:
        ParameterError: an argument without meaning, or one that the system refuses.
    """
    from saltus.sweep import run

    work = plan(
        system,
        _default_axis("horizontal", horizontal),
        _default_axis("vertical", vertical),
        paths=paths,
        max_period=max_period,
        starts=starts,
        window=window,
        least=least,
        periods=settling(system) if periods is None else periods,
        tol=tol,
        seed=seed,
        rows=rows,
    )
    return with_limits(run(work, store, workers=workers, scheduler=scheduler, progress=progress), system, paths)


def settling(system: Any) -> int:
    """Forcing periods in which motions settle that do, by the damping of the model."""
    damping = getattr(getattr(system, "model", None), "damping", 0.0)
    frequency = getattr(getattr(system, "load", None), "frequency", None)
    if not damping or not frequency:
        return MOST
    return math.ceil(min(MOST, max(FEWEST, 2 * DECAY * frequency / (2 * math.pi * damping))))


def plan(system: System, horizontal: Any, vertical: Any, *, paths: tuple[str, str], rows: int, **options: Any) -> Plan:
    """The chart as a sweep: chunks of rows, each a call of `cells`."""
    from saltus import __version__
    from saltus.sweep import Plan

    axes = {"vertical": check_axis("vertical", vertical), "horizontal": check_axis("horizontal", horizontal)}
    check_options(system, paths, axes, rows=rows, **options)
    named = {"vertical": paths[1], "horizontal": paths[0]}
    options["window"] = np.ravel(check_window(options["window"], system)).tolist()
    arguments = {"system": system.to_json(), "paths": named, **options, "threads": None}
    said = {"title": "stability chart computed by saltus", "saltus_version": __version__, **arguments}
    return Plan(
        function=CELLS,
        arguments=arguments,
        axes=axes,
        chunk={"vertical": rows},
        variables=_variables(),
        attrs={name: value for name, value in said.items() if name not in ("paths", "threads")} | {"path": list(paths)},
    )


def _variables() -> dict[str, Any]:
    from saltus.sweep import Variable

    def variable(dtype: str, unit: str, text: str, *extra: tuple[str, int]) -> Variable:
        return Variable(dtype=dtype, extra=extra, attrs={"units": unit, "long_name": text})

    each = ("motion", MOTIONS)
    return {
        "amplitude": variable("f8", "rad", "the largest amplitude of the stable motions beside rest"),
        "period": variable("i2", "1", "forcing periods of the largest motion, 0 where there is none"),
        "smallest_amplitude": variable("f8", "rad", "the smallest amplitude of those that count"),
        "count": variable("i2", "1", "stable motions beside rest, mirror images counted once"),
        "rest": variable("?", "1", "some start is captured at rest"),
        "tiny": variable("i2", "1", "starts that end on motions too small to count"),
        "unsettled": variable("i2", "1", "starts that do not settle"),
        "motion_amplitude": variable("f8", "rad", "amplitude of each motion", each),
        "motion_other": variable("f8", "rad", "extremum of each motion on the other side, as its amplitude if symmetric", each),
        "motion_period": variable("i2", "1", "forcing periods of each motion", each),
        "motion_impact_count": variable("i4", "1", "impacts in a period of each motion", each),
        "motion_theta": variable("f8", "rad", "theta of each motion at phase 0", each),
        "motion_velocity": variable("f8", "1", "d theta / d tau of each motion at phase 0", each),
    }


def check_options(system: Any, paths: Any, axes: dict[str, np.ndarray], **options: Any) -> None:
    """Refuse what has no meaning, before anything is computed."""
    if not isinstance(system, System):
        raise ParameterError(f"stability_chart takes a System(model=..., load=..., impact=...), got {system!r}")
    if system.load.frequency is None:
        raise ParameterError("a stability chart needs a load with a frequency, Load(frequency=..., ...)")
    if len(system.model.coordinates) > 1:
        raise ParameterError("stability_chart works on models with one coordinate")
    if isinstance(paths, str) or len(paths) != 2 or paths[0] == paths[1]:
        raise ParameterError(f"paths must be two parameters, (along horizontal, along vertical), got {paths!r}", "paths")
    for path, values in zip(paths, (axes["horizontal"], axes["vertical"]), strict=True):
        check_path(system, path, "paths")
        check_along(system, path, (values.min(), values.max()), "paths")
    for name in ("max_period", "starts", "periods", "rows"):
        check_count(name, options[name], 1)
    check_count("seed", options["seed"], 0)
    if options["max_period"] > 16:
        raise ParameterError(f"max_period must be at most 16 forcing periods, got {options['max_period']}", "max_period")
    check_number("least", options["least"], above=0.0)
    check_number("tol", options["tol"], at_least=1e-15, at_most=1e-6)
    check_window(options["window"], system)


def monostable(chart: xarray.Dataset) -> xarray.DataArray:
    """Where no motion counts and every start that settles comes to rest: the white region of the paper's charts."""
    return (chart["count"] == 0) & (chart["unsettled"] == 0)


def with_limits(chart: xarray.Dataset, system: System, paths: tuple[str, str]) -> xarray.Dataset:
    """The chart with where its largest motions go beyond the limits of the metainterface (erratum 20)."""
    beta0 = getattr(system.model, "beta0", None)
    if beta0 is None:
        return chart
    name = {path: axis for axis, path in zip(("horizontal", "vertical"), paths, strict=True)}.get("model.beta0")
    straight = math.pi - (beta0 if name is None else chart[name])
    for flag, limit, text in (
        ("beyond_line", straight, "the largest motion passes the straight line, pi - beta0"),
        ("beyond_kinematic", 2 * straight, "the largest motion passes 2 (pi - beta0), where the slider closes again"),
    ):
        chart[flag] = (chart["amplitude"] > limit).transpose(*chart["amplitude"].dims)
        chart[flag].attrs = {"units": "1", "long_name": text}
    return chart
