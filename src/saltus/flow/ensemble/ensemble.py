"""Ensembles: many exact trajectories of one system, from many states and with many parameters, in lanes on all cores."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_number
from saltus.errors import ParameterError, near
from saltus.flow.ensemble.compiled_lanes import compile_beside, compile_driver_aside, load_lane_functions
from saltus.flow.ensemble.ensemble_dataset import KEPT, Wanted, to_dataset
from saltus.flow.ensemble.inputs import Inputs, read_inputs
from saltus.flow.ensemble.lane_layout import JobLabel, JobNumber
from saltus.flow.ensemble.threads import Jobs, Lanes, available_cores
from saltus.flow.forcing_time import Clock, clock
from saltus.flow.structures import Program, check_gap, limits_of, program
from saltus.progress import Progress, silent
from saltus.systems import System, check_system, numbers

if TYPE_CHECKING:
    import xarray

ENDINGS = ("rest", "settled")
MOST_SYSTEMS, MOST_PROVED = 16, 1 << 18  # systems, and parameter sets of each, whose speeds of capture are remembered
SLIVER = 1e-9  # of a forcing period: a duration that ends within less of a whole one was meant to be whole


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
    progress: Progress = silent,
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
        periods, duration: how long, in forcing periods or in dimensionless time; one of them, one number for all.
        tol: the error that one step may make, relative to the state, in [1e-15, 1e-6].
        time: the dimensionless time at the start.
        side: +1 or -1, the side to leave by where the motion from rest at contact is not unique.
        stop_at: margins of the model that end a trajectory; its own `stops` always do.
        sample: what is kept of each of the `last` forcing periods: "state" (at its end, stroboscopically), "extrema" of the first
            coordinate in it, "impact_count" (the number of impacts), "speed" (the least abs(v-) of its impacts). They are counted
            from the start, and the one in which the trajectory ends is kept, however short. Of "extrema" and "speed" the whole
            motion's are returned too.
        last: of how many forcing periods, counted back from the end; "all" keeps every one.
        until: ends a trajectory early: "rest", when it is proved to be captured at rest for all later loads (`capture_speed`);
            "settled", when it repeats itself every q <= 16 forcing periods.
        sensitivities: dotted paths of parameters: adds the derivatives of the end state to the initial one and to them. The time
            at the start is fixed, and at the end too, but that n periods asked for end at time + n 2 pi / W, which moves with
            "load.frequency" W, also where a trajectory has settled; and that a margin's end moves with it.
        threads: how many cores to use; by default all.
        progress: called with the fraction done and what is being done, ten times a second.
        coordinates: the state at the start by the model's names: theta=..., or x=... for a wall oscillator.

    Returns:
        A Dataset with the state at the end, `time`, `side`, `stop` (why it ended), `impact_count`, `grazings`, `periods` done
        (2.5 for two and a half), and what `sample` asks for, all over the dimensions of the arguments; see `ensemble_dataset.py`.

    Raises:
        ParameterError: an argument without meaning. A trajectory that cannot go on raises nothing: `stop` says so.
    """
    check_system(system, "simulate_many")
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    wanted = Wanted(
        tol=tol,
        periods=periods,
        limits=limits_of(system, stop_at),
        sample=_names("sample", sample, tuple(KEPT)),
        until=_names("until", until, ENDINGS),
        paths=None if sensitivities is None else _names("sensitivities", sensitivities, None),
    )
    side, threads = _side(side), _threads(threads)
    inputs = read_inputs(system, velocity, time, parameters, coordinates)
    aside = compile_driver_aside()
    run = program(system, wanted.limits, wanted.paths)
    if system.model.sides:
        check_gap(system.model)
    jobs = _jobs(system, run, inputs, periods, duration, side)
    if "rest" in wanted.until:
        jobs.numbers[:, JobNumber.CAPTURE_SPEED] = _capture(system, inputs.parameters, wanted.limits)
    spans = jobs.labels[:, JobLabel.LAST_PERIOD] - jobs.labels[:, JobLabel.FIRST_PERIOD]
    begun = jobs.numbers[:, JobNumber.END_TIME] > jobs.numbers[:, JobNumber.START_TIME]
    lanes = compiled_lanes(system, run, wanted, _kept(last, int(np.max(spans + begun, initial=1))))
    if aside is not None:
        compile_beside(aside)
    ends = lanes.run(jobs, threads, progress, total=float(np.sum(spans + 1)))
    return to_dataset(system, inputs, wanted, jobs, ends)


def _capture(system: System, columns: dict[str, np.ndarray], limits: tuple[str, ...]) -> Any:
    """The speed below which each trajectory is proved to be captured, computed once for equal parameters.

    Raises:
        ParameterError: a margin to stop at besides the model's own, which a captured motion may still reach.
    """
    from saltus.bounds import proved_speeds

    asked = [name for name in limits if name not in system.model.stops]
    if asked:
        raise ParameterError(f'until="rest" proves nothing about {asked[0]}; leave out either it or stop_at')
    if not system.model.sides:
        return 0.0
    varied = {path: values for path, values in columns.items() if values.ndim}
    if not varied:
        return proved_speeds(system, columns)
    sets, place = np.unique(np.stack(list(varied.values()), axis=1), axis=0, return_inverse=True)
    single = {path: float(values) for path, values in columns.items() if not values.ndim}
    if len(_proved) >= MOST_SYSTEMS:
        _proved.clear()
    known = _proved.setdefault((system.to_json(), *varied, *single.items()), {})
    rows = [row.tobytes() for row in sets]
    new = [i for i, row in enumerate(rows) if row not in known]
    if new:
        if len(known) + len(new) > MOST_PROVED:
            known.clear()
            new = list(range(len(rows)))
        distinct = dict(zip(varied, sets[new].T, strict=True))
        known.update(zip((rows[i] for i in new), proved_speeds(system, columns | distinct).tolist(), strict=True))
    return np.array([known[row] for row in rows])[place.reshape(-1)]


_proved: dict[tuple[Any, ...], dict[bytes, float]] = {}  # studies ask for the same parameters again and again


def _names(argument: str, given: Any, known: tuple[str, ...] | None) -> tuple[str, ...]:
    try:
        names = (given,) if isinstance(given, str) else tuple(given)
    except TypeError:
        raise ParameterError(f"{argument} must be names, got {given!r}", argument) from None
    for name in names:
        if known is not None and name not in known:
            raise ParameterError(f"{argument} knows no {name!r}; {near(str(name), known)}", argument)
    return names


def _kept(last: Any, periods: int) -> int:
    if isinstance(last, str) and last == "all":
        return periods
    if isinstance(last, bool) or not isinstance(last, (int, np.integer)) or last < 1:
        raise ParameterError(f'last must be a whole number of forcing periods from 1 on, or "all", got {last!r}', "last")
    return max(1, min(int(last), periods))


def _side(side: Any) -> int:
    if side is not None and (np.ndim(side) or side not in (1, -1)):
        raise ParameterError(f"side must be +1 or -1, got {side!r}", "side")
    return side or 0


def _threads(threads: Any) -> int:
    threads = available_cores() if threads is None else threads
    if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or threads < 1:
        raise ParameterError(f"threads must be a whole number of at least 1, got {threads!r}", "threads")
    return int(threads)


def compiled_lanes(system: System, run: Program, wanted: Wanted, kept: int) -> Lanes:
    """The compiled lanes of a system and what they are to keep."""
    key = run.structure.module.__name__
    if key not in _functions:
        _functions[key] = load_lane_functions(run.trace)
    slots, functions = _functions[key]
    own = len(system.model.coordinates)
    return Lanes(
        program=run,
        slots=slots,
        functions=functions,
        parameters=np.array([value for _, value in numbers(system)] or [0.0]),
        records=(run.env[2], run.env[3]),
        tol=wanted.tol,
        kept=kept if wanted.sample else 1,
        sampled=[c for name in KEPT if name in wanted.sample for c in KEPT[name](own)],
        extrema="extrema" in wanted.sample,
        settle="settled" in wanted.until,
    )


_functions: dict[str, Any] = {}


def _jobs(system: System, run: Program, inputs: Inputs, periods: float | None, duration: float | None, side: int) -> Jobs:
    """The trajectories as the driver takes them."""
    known = [path for path, _ in numbers(system)]
    columns = {known.index(path): np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()}
    states = _first_states(inputs, len(system.model.coordinates), run.structure.module.COLUMNS)
    numbers_of, labels = np.zeros((inputs.size, len(JobNumber))), np.zeros((inputs.size, len(JobLabel)), dtype=np.int64)
    time, frequency = inputs.values["time"], inputs.values.get("load.frequency", system.load.frequency)
    length = None if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
    at = clock(time, length, periods, duration)
    last, end = _from_the_start(at)
    numbers_of[:, JobNumber.START_TIME], numbers_of[:, JobNumber.PERIOD_LENGTH] = at.local, at.length
    numbers_of[:, JobNumber.END_TIME] = end
    labels[:, JobLabel.FIRST_PERIOD], labels[:, JobLabel.LAST_PERIOD], labels[:, JobLabel.LEAVE_BY] = at.first, last, side
    labels[:, JobLabel.PIECE] = np.searchsorted(run.env[2], time, side="right")
    return Jobs(states, numbers_of, labels, columns)


def _from_the_start(at: Clock) -> tuple[Any, Any]:
    """The last forcing period and the local time at the end, if periods are counted from the start, with its phase.

    What is longer than whole periods by no more than rounding ends in the last of these.
    """
    part = np.divide(at.end - at.local, at.length, out=np.zeros(np.shape(at.end)), where=np.greater(at.length, 0))
    back = np.where(part == 0.0, 0, np.minimum(1 - np.ceil(part - SLIVER), at.last - at.first))
    return at.last - back, at.end + back * at.length


def _first_states(inputs: Inputs, own: int, columns: int) -> np.ndarray:
    """Coordinates with the tangent's columns, then velocities with theirs: (n, 2 (own + own columns))."""
    rows = own * (1 + columns)
    states = np.zeros((inputs.size, 2 * rows))
    for i, values in enumerate(list(inputs.values.values())[: 2 * own]):
        states[:, i % own + rows * (i // own)] = values
    for j in range(min(columns, 2 * own)):  # the derivatives of the initial state to itself
        states[:, own + j * own + j % own + rows * (j // own)] = 1.0
    return states
