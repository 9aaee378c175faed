"""Ensembles: many exact trajectories of one system, from many states and with many parameters, in lanes on all cores."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, near
from saltus.flow.clock import clock
from saltus.flow.emit import Emitter
from saltus.flow.ensemble_dataset import KEPT, check_dims, to_dataset
from saltus.flow.lanes.compile import compile_driver_aside, load_advance, load_helpers, load_lane_functions
from saltus.flow.lanes.run import Jobs, Lanes, available_cores
from saltus.flow.simulation import Program, check_gap, limits_of, program
from saltus.systems import System
from saltus.systems.checks import check_number
from saltus.systems.parameters import numbers

if TYPE_CHECKING:
    import xarray

ENDINGS = ("rest", "settled")


def simulate_many(
    system: System,
    *,
    velocity: Any = 0.0,
    parameters: Mapping[str, Any] | None = None,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: Any = 0.0,
    side: int | None = None,
    stop_at: Iterable[str] = (),
    sample: Iterable[str] = ("state",),
    last: int | str = 1,
    until: Iterable[str] = (),
    sensitivities: Iterable[str] | None = None,
    threads: int | None = None,
    progress: Callable[[float], object] | None = None,
    **coordinates: Any,
) -> xarray.Dataset:
    """Exact trajectories from many states and with many parameters, as `simulate` follows each, and many times as fast.

    Initial coordinates, velocities, times and parameters are numbers or arrays, which broadcast together as NumPy's do; with
    `xarray.DataArray`s by the names of their dimensions, which the result then has. Results depend neither on the number of
    threads nor on what else is computed, to the last bit. What is computed is bounded in memory by what is asked for.

    Args:
        system: what moves.
        velocity: the velocities at the start; a tuple of arrays where there are several coordinates.
        parameters: arrays by dotted path, such as {"load.horizontal.amplitude": np.linspace(0, 1, 101)}.
        periods, duration: how long, in forcing periods or in dimensionless time; one of them.
        tol: the error that one step may make, relative to the state, in [1e-15, 1e-6].
        time: the dimensionless time at the start.
        side: +1 or -1, the side to leave by where the motion from rest at contact is not unique.
        stop_at: margins of the model that end a trajectory; its own `stops` always do.
        sample: what is kept of each of the `last` forcing periods: "state" (at its end, stroboscopically), "extrema" of the first
            coordinate in it, "crossings" (the number of impacts), "speed" (the least abs(v-) of its impacts).
        last: of how many forcing periods, counted back from the end; "all" keeps every one.
        until: ends a trajectory early: "rest", when it is proved to be captured at rest for all later loads (`capture_speed`);
            "settled", when it repeats itself every q <= 16 forcing periods.
        sensitivities: dotted paths of parameters: adds the derivatives of the end state to the initial one and to them.
        threads: how many cores to use; by default all.
        progress: called with the fraction done, ten times a second.
        coordinates: the state at the start by the model's names: theta=..., or x=... for a wall oscillator.

    Returns:
        A Dataset with the state at the end, `time`, `side`, `stop` (why it ended), `crossings`, `grazings`, `periods` done, and
        what `sample` asks for, all over the dimensions of the arguments; see `ensemble_dataset.py`.

    Raises:
        ParameterError: an argument without meaning. A trajectory that cannot go on raises nothing: `stop` says so.
    """
    if not isinstance(system, System):
        raise ParameterError(f"simulate_many takes a System(model=..., load=..., impact=...), got {system!r}")
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    sample, until = _names("sample", sample, tuple(KEPT)), _names("until", until, ENDINGS)
    paths = None if sensitivities is None else _names("sensitivities", sensitivities, None)
    if side is not None and (np.ndim(side) or side not in (1, -1)):
        raise ParameterError(f"side must be +1 or -1, got {side!r}")
    threads = available_cores() if threads is None else threads
    if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or threads < 1:
        raise ParameterError(f"threads must be a whole number of at least 1, got {threads!r}")
    parameters = _mapping(parameters)
    dims, shape, coords, inputs = _broadcast(_inputs(system, velocity, time, parameters, coordinates))
    check_dims(dims, system)
    limits = limits_of(system, stop_at)
    aside = compile_driver_aside()
    run = program(system, limits, paths)
    if system.model.sides:
        check_gap(system.model)
    jobs = _jobs(system, run.env[2], inputs, periods, duration, side or 0, run.structure.module.COLUMNS)
    if "rest" in until:
        jobs.numbers[:, 3] = _capture(system, {path: inputs[path] for path in parameters}, limits)
    legs = int(np.max(jobs.labels[:, 1] - jobs.labels[:, 0] + (jobs.numbers[:, 2] > 0), initial=1))
    lanes = _lanes(system, run, tol, sample, _kept(last, legs), "settled" in until)
    if aside is not None:
        load_helpers(), load_advance()
        aside.wait()
    total = float(np.sum(jobs.labels[:, 1] - jobs.labels[:, 0] + 1))
    ends = lanes.run(jobs, int(threads), progress, total)
    return to_dataset(system, jobs, ends, dims, shape, coords, inputs, limits, paths, sample, periods, tol, until)


def _capture(system: System, columns: dict[str, np.ndarray], limits: tuple[str, ...]) -> Any:
    """The speed below which each trajectory is proved to be captured, computed once for equal parameters.

    Raises:
        ParameterError: a margin to stop at besides the model's own, which a captured motion may still reach.
    """
    from saltus.flow.capture import capture_speed

    asked = [name for name in limits if name not in system.model.stops]
    if asked:
        raise ParameterError(f'until="rest" proves nothing about {asked[0]}; leave out either it or stop_at')
    if not system.model.sides:
        return 0.0
    varied = {path: values for path, values in columns.items() if values.ndim}
    if not varied:
        return capture_speed(system, columns)
    sets, place = np.unique(np.stack(list(varied.values()), axis=1), axis=0, return_inverse=True)
    distinct = dict(zip(varied, sets.T, strict=True))
    return capture_speed(system, columns | distinct)[place.reshape(-1)]


def _names(argument: str, given: Any, known: tuple[str, ...] | None) -> tuple[str, ...]:
    try:
        names = (given,) if isinstance(given, str) else tuple(given)
    except TypeError:
        raise ParameterError(f"{argument} must be names, got {given!r}") from None
    for name in names:
        if known is not None and name not in known:
            raise ParameterError(f"{argument} knows no {name!r}; {near(str(name), known)}")
    return names


def _kept(last: Any, legs: int) -> int:
    if isinstance(last, str) and last == "all":
        return legs
    if isinstance(last, bool) or not isinstance(last, (int, np.integer)) or last < 1:
        raise ParameterError(f'last must be a whole number of forcing periods from 1 on, or "all", got {last!r}')
    return max(1, min(int(last), legs))


def _lanes(system: System, run: Program, tol: float, sample: tuple[str, ...], kept: int, settle: bool) -> Lanes:
    """The compiled lanes of a system and what they are to keep."""
    key = run.structure.module.__name__
    if key not in _functions:
        emitter = Emitter(run.trace)
        emitter.source()
        _functions[key] = load_lane_functions(run.trace, emitter)
    slots, functions = _functions[key]
    own = len(system.model.coordinates)
    columns = [c for name in KEPT if name in sample for c in KEPT[name](own)]
    return Lanes(
        program=run,
        slots=slots,
        functions=functions,
        parameters=np.array([value for _, value in numbers(system)] or [0.0]),
        records=(run.env[2], run.env[3]),
        tol=tol,
        kept=kept if sample else 1,
        sampled=columns,
        watch="extrema" in sample,
        settle=settle,
    )


_functions: dict[str, Any] = {}


# --- arguments ---------------------------------------------------------------------------------------------------------------


def _inputs(system: System, velocity: Any, time: Any, parameters: dict[str, Any], coordinates: dict[str, Any]) -> dict[str, Any]:
    """Everything that may be an array, by name: coordinates, velocities, time, parameters."""
    names = system.model.coordinates
    for name in coordinates:
        if name not in names:
            raise ParameterError(f"{type(system.model).__name__} has no coordinate {name!r}; {near(name, names)}")
    for name in names:
        if name not in coordinates:
            raise ParameterError(f"the state at the start needs {name}=...")
    speeds = (velocity,) if len(names) == 1 else velocity
    if not isinstance(speeds, (tuple, list)) or len(speeds) != len(names):
        raise ParameterError(f"velocity must be a tuple of {len(names)} numbers or arrays, got {velocity!r}")
    inputs = {name: coordinates[name] for name in names}
    inputs |= {_rate(name, names): speed for name, speed in zip(names, speeds, strict=True)}
    inputs["time"] = time
    known = [path for path, _ in numbers(system)]
    for path in parameters:
        if path not in known:
            system.get(str(path))  # refuses what leads nowhere
            raise ParameterError(f"{path} is not a number, so it cannot be varied; {near(str(path), known)}")
    return inputs | parameters


def _mapping(parameters: Any) -> dict[str, Any]:
    if not isinstance(parameters or {}, Mapping):
        raise ParameterError(f"parameters must be arrays by dotted path, such as {{'load.frequency': ...}}, got {parameters!r}")
    return dict(parameters or {})


def _rate(name: str, names: tuple[str, ...]) -> str:
    """The name of a coordinate's velocity."""
    return "velocity" if len(names) == 1 else f"{name}_velocity"


def _broadcast(inputs: dict[str, Any]) -> tuple[tuple[str, ...], tuple[int, ...], dict[Any, Any], dict[str, np.ndarray]]:
    """The dimensions of an ensemble, its shape, its coordinates, and each input as a flat array or as one number."""
    import xarray

    arrays: dict[str, Any] = {}
    for name, given in inputs.items():
        try:
            if np.iscomplexobj(given):
                raise TypeError
            array = given.astype(float) if isinstance(given, xarray.DataArray) else np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            raise ParameterError(f"{name} must be a number or an array of numbers, got {given!r}") from None
        if not np.isfinite(array).all():
            raise ParameterError(f"{name} must be finite; it holds nan or inf")
        arrays[name] = array
    named = [name for name, a in arrays.items() if isinstance(a, xarray.DataArray) and a.ndim]
    plain = [name for name, a in arrays.items() if not isinstance(a, xarray.DataArray) and a.ndim]
    if named and plain:
        raise ParameterError(f"{named[0]} has named dimensions and {plain[0]} has not; give DataArrays or arrays, not both")
    coords: dict[Any, Any] = {}
    if named:
        try:
            together = xarray.broadcast(*xarray.align(*(arrays[name] for name in named), join="exact"))
        except ValueError:
            raise ParameterError(
                f"the DataArrays ({', '.join(named)}) have dimensions of the same name with other lengths or coordinates; "
                "give such dimensions different names"
            ) from None
        for name in named:
            coords |= arrays[name].coords
        for name in named:  # an array along a dimension of its own name is the dimension's coordinate
            if arrays[name].dims in ((name,), (f"initial_{name}",)):
                coords.setdefault(arrays[name].dims[0], arrays[name].values)
        arrays |= dict(zip(named, together, strict=True))
        dims, shape = tuple(str(d) for d in together[0].dims), together[0].shape
    else:
        try:
            shape = np.broadcast_shapes(*(np.shape(a) for a in arrays.values()))
        except ValueError:
            shapes = ", ".join(f"{name} {np.shape(arrays[name])}" for name in plain)
            raise ParameterError(f"the arrays do not broadcast together: {shapes}") from None
        dims = ("trajectory",) if len(shape) == 1 else tuple(f"axis_{i}" for i in range(len(shape)))
    flat = {}
    for name, array in arrays.items():
        values = np.asarray(array)
        flat[name] = np.broadcast_to(values, shape).reshape(-1) if values.ndim else values
    return dims, shape, coords, flat


def _check_parameters(system: System, columns: dict[str, np.ndarray]) -> None:
    """Refuse values that the system refuses, tried at the ends of every column."""
    for path, values in columns.items():
        if values.size and path.endswith(".order") and not np.equal(values, np.round(values)).all():
            raise ParameterError(f"{path} must be whole numbers")
        for value in {float(values.min()), float(values.max())} if values.size else ():
            system.with_({path: value})


def _jobs(
    system: System,
    breaks: np.ndarray,
    inputs: dict[str, np.ndarray],
    periods: float | None,
    duration: float | None,
    side: int,
    tangent_columns: int,
) -> Jobs:
    """The trajectories as the driver takes them."""
    names = system.model.coordinates
    own = len(names)
    state_names = [*names, *(_rate(name, names) for name in names)]
    known = [path for path, _ in numbers(system)]
    columns = {path: a for path, a in inputs.items() if path not in state_names and path != "time"}
    _check_parameters(system, columns)
    n = int(np.max([a.size if a.ndim else 1 for a in inputs.values()])) if all(a.size for a in inputs.values()) else 0
    rows = own * (1 + tangent_columns)
    states = np.zeros((n, 2 * rows))
    for i, name in enumerate(state_names):
        states[:, i % own + rows * (i // own)] = inputs[name]
    for j in range(min(tangent_columns, 2 * own)):  # the derivatives of the initial state to itself
        states[:, own + j * own + j % own + rows * (j // own)] = 1.0
    jobs = Jobs(
        states,
        np.zeros((n, 4)),
        np.zeros((n, 4), dtype=np.int64),
        {known.index(path): np.broadcast_to(a, n) for path, a in columns.items()},
    )
    frequency = inputs.get("load.frequency", system.load.frequency)
    length = None if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
    at = clock(np.asarray(inputs["time"]), length, periods, duration)
    jobs.numbers[:, 0], jobs.numbers[:, 1], jobs.numbers[:, 2] = at.local, at.length, at.end
    jobs.labels[:, 0], jobs.labels[:, 1] = at.first, at.last
    jobs.labels[:, 2] = side
    jobs.labels[:, 3] = np.searchsorted(breaks, inputs["time"], side="right")
    return jobs
