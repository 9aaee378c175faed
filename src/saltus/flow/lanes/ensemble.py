"""Ensembles: many exact trajectories of one system, from many states and with many parameters, in
lanes on all cores.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from saltus.checks import Numbers, check_memory, check_number, check_work
from saltus.errors import ParameterError
from saltus.flow.cuda.devices import read_device, target_of
from saltus.flow.cuda.launch import run_on
from saltus.flow.kernel.layout import SHORTEST, Mode, Status
from saltus.flow.lane_steps.memory import JOB
from saltus.flow.lanes.capture_speeds import capture_speeds
from saltus.flow.lanes.ensemble_dataset import to_dataset
from saltus.flow.lanes.ensemble_result import EnsembleResult
from saltus.flow.lanes.inputs import Inputs, read_inputs
from saltus.flow.lanes.one_by_one import followed_one_by_one, goes_alone
from saltus.flow.lanes.options import (
    EnsembleOptions,
    Sample,
    Until,
    read_last,
    read_names,
    read_side,
    read_threads,
)
from saltus.flow.motion.kernel_state import longest_time
from saltus.flow.motion.simulate import Clock, clock
from saltus.flow.programs.compiled import Program, limits_of, program
from saltus.flow.programs.compiled_lanes import (
    compile_beside,
    compile_driver_aside,
    compile_everything,
    load_lane_functions,
)
from saltus.flow.programs.lane_threads import Jobs, Lanes
from saltus.progress import Progress, silent
from saltus.systems import System, check_system, inert_frictions, natural_units, numbers
from saltus.taylor import record_tables

if TYPE_CHECKING:
    import xarray

# A duration that ends nearer than this share of a forcing period to the period's end is meant to
# end there.
SLIVER = 1e-9


def simulate_many(
    system: System,
    *,
    velocity: Numbers = 0.0,
    parameters: Mapping[str, Any] | None = None,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: Numbers = 0.0,
    side: int | None = None,
    relays: Mapping[str, Any] | None = None,
    stop_at: Iterable[str] = (),
    sample: Iterable[str] = ("state",),
    last: int | str = 1,
    until: Iterable[str] = (),
    sensitivities: Iterable[str] | None = None,
    threads: int | None = None,
    device: str = "cpu",
    progress: Progress = silent,
    **coordinates: Any,
) -> xarray.Dataset:
    """Exact trajectories from many states and with many parameters: each as `simulate` would follow
    it, but many times faster.

    Initial coordinates, velocities, times and parameters are numbers or arrays, which broadcast
    together as in NumPy. `xarray.DataArray`s broadcast by the names of their dimensions, which the
    result then has. To the last bit, the result of a trajectory depends neither on the number of
    threads nor on the other trajectories. The memory needed is that of the result.

    Parameters
    ----------
    system
        What moves.
    parameters
        Arrays by dotted path, such as {"load.horizontal.amplitude": np.linspace(0, 1, 101)}.
    sample
        The quantities that are kept for each of the `last` forcing periods, see `Sample`. Periods
        are counted from the start; the period in which the trajectory ends is kept, however short
        it is. "extrema" and "speed" are also returned for the whole motion.
    last
        For how many forcing periods samples are kept, counted back from the end; "all" keeps every
        one.
    until
        Ends a trajectory early, see `Until`.
    sensitivities
        Dotted paths of parameters. Adds the derivatives of the end state to the initial state and
        to these parameters, at a fixed time; but the end after n periods moves with
        "load.frequency", and an end at a margin with the margin.
    threads
        How many cores to use; by default all.
    device
        "cuda" follows the motions on a card, of models with at most one contact (`docs/howto/gpu.md`);
        "auto" does so where there is one and it is faster. Within a study "cpu" is the study's own.
    relays
        Whether each `Relay` of the model is on at the start, such as {"heater": True}, or an array
        for each. Motions with relays, with surfaces that reset the state or with contacts of a
        `distance` are followed one by one.
    velocity, periods, duration, tol, time, side, stop_at, progress, coordinates
        As for `simulate`; velocity a tuple of
        arrays where there are several coordinates.

    Returns
    -------
    xarray.Dataset
        A Dataset over the dimensions of the arguments, with the state at the end, `time`, `side`,
        `stop` (why it ended), `impact_count`, `grazings` and what `sample` asks for. Its `periods`
        are those done, 2.5 for two and a half; see `ensemble_dataset.py`. Of a relay "heater" it has
        `side_heater`.

    Raises
    ------
    ParameterError
        An argument has no meaning. A trajectory that cannot go on raises no error: `stop` says so.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2, 0.3], periods=20)
    >>> ends.impact_count.values, float(ends.theta[2])
    (array([39, 39, 39]), -0.23568059529931645)
    """
    check_system(
        system,
        "simulate_many",
        several_contacts=True,
        multipliers=True,
        switches=True,
        jumps=True,
        resets=True,
        relays=True,
    )
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    options = EnsembleOptions(
        tol=tol,
        periods=periods,
        limits=limits_of(system, stop_at),
        sample=read_names("sample", sample, Sample),
        until=read_names("until", until, Until),
        paths=None if sensitivities is None else read_names("sensitivities", sensitivities),
    )
    side, threads, device = read_side(side), read_threads(threads), read_device(device)
    inputs = read_inputs(system, velocity, time, parameters, coordinates, relays)
    inner = system.in_gap_coordinates
    if inner is not system and (Sample.EXTREMA in options.sample or options.paths):
        raise ParameterError(
            "extrema of many motions, and their derivatives to parameters, need a coordinate for "
            "each gap: give system.in_gap_coordinates, which has"
            f" {', '.join(inner.model.coordinates)}",
            "sample",
        )
    return to_dataset(
        run_ensemble(
            system,
            inputs,
            options,
            threads,
            progress,
            duration=duration,
            side=side,
            last=last,
            device=device,
        )
    )


def run_ensemble(
    system: System,
    inputs: Inputs,
    options: EnsembleOptions,
    threads: int,
    progress: Progress,
    *,
    duration: float | None = None,
    side: int = 0,
    last: int | str = 1,
    captured: np.ndarray | None = None,
    device: str = "cpu",
) -> EnsembleResult:
    """Compile the code that is not there yet, and run the trajectories; `captured` holds speeds of
    capture that are known.
    """
    own = system
    given = inputs
    system, inputs = system.in_gap_coordinates, inputs.in_gaps(system)
    driver = None
    alone = goes_alone(system.model)
    if not alone:
        driver = compile_driver_aside(system.model.holds_coordinates)
    run = program(system, options.limits, options.paths)
    if run.structure.several and any(path.startswith("model.") for path in inputs.parameters):
        # the table of eigenmodes has the model's numbers
        run = replace(run, model=run.model._replace(eigenmodes=np.zeros(0)))
    if run.trace.corner_column and system.load.jumps:
        raise ParameterError(
            "load.frequency moves the instants at which the load jumps, and ensembles have no"
            " derivatives to it: take saltus.sensitivities, one motion at a time",
            "sensitivities",
        )
    jobs = _jobs(system, run, inputs, options.periods, duration, side)
    if Until.REST in options.until:
        jobs.rows["capture_speed"] = capture_speeds(
            system, inputs.parameters, options.limits, known=captured
        )
    spans = jobs.rows["last_period"] - jobs.rows["first_period"]
    begun = jobs.rows["end_time"] > jobs.rows["start_time"]
    check_work(
        "periods" if duration is None else "duration", inputs.size, float(np.max(spans, initial=0))
    )
    kept = read_last(last, int(np.max(spans + begun, initial=1)))
    check_memory(
        "last",
        16.0 * len(options.sample) * kept * inputs.size,
        f"samples of {kept} periods of {inputs.size} motions",
    )
    if alone:
        if device == "cuda":
            raise ParameterError(
                "motions with relays, resets or contacts of a distance are followed one by one, not"
                " on a card: leave device out",
                "device",
            )
        ends = followed_one_by_one(system, inputs, options, jobs, kept, side, progress, duration)
        return EnsembleResult(own, given, options, jobs, ends)
    lanes = compiled_lanes(system, run, options, kept, inputs.parameters)
    if driver is not None:
        compile_beside(driver, system.model.holds_coordinates)
    total = float(np.sum(spans + 1))
    target = target_of(device, run, inputs.size, total, threads)
    if target is None:
        ends = lanes.run(jobs, threads, progress, total)
        return EnsembleResult(own, given, options, jobs, ends)
    ends = run_on(target, lanes, jobs, threads, progress, total)
    return EnsembleResult(own, given, options, jobs, ends, target.name)


def compiled_lanes(
    system: System,
    run: Program,
    options: EnsembleOptions,
    kept: int,
    parameters: Mapping[str, np.ndarray] | None = None,
) -> Lanes:
    """The compiled lanes of a system, with the settings for the samples that they keep of each
    trajectory; lanes differ in the values of `parameters`.
    """
    varied: dict[str, Iterable[float]] = dict.fromkeys(options.paths or (), ())
    for path, values in (parameters or {}).items():
        varied[path] = float(np.min(values)), float(np.max(values))
    # their addresses, which structures of different sizes may share
    key = run.structure.functions, run.structure.sizes
    if key not in _functions:
        _functions[key] = load_lane_functions(run.trace)
    plan, functions = _functions[key]
    own = len(system.model.coordinates)
    return Lanes(
        program=run,
        plan=plan,
        functions=functions,
        parameters=(
            run.env[0]
            if run.trace.several
            else np.array([value for _, value in numbers(system)] or [0.0])
        ),
        tol=options.tol,
        kept=kept if options.sample else 1,
        sampled=[
            column for kind in Sample if kind in options.sample for column in kind.columns(own)
        ],
        extrema=Sample.EXTREMA in options.sample,
        from_start=options.from_start,
        natural_length=natural_units(system).length,
        settle=Until.SETTLED in options.until,
        natural_time=longest_time(system, *_periods_of(system, run, varied)),
        shortest_step=SHORTEST * natural_units(system).time,
        inert_frictions=inert_frictions(system, varied),
    )


def _periods_of(
    system: System, run: Program, varied: Mapping[str, Iterable[float]]
) -> tuple[float, Program | None]:
    """The longest period of the load, and the program where its numbers are those of all lanes."""
    frequencies = tuple(varied.get("load.frequency", ())) or (system.load.frequency or 0.0,)
    lowest = float(min(frequencies))
    others = any(path != "load.frequency" and tuple(values) for path, values in varied.items())
    return 2.0 * math.pi / lowest if lowest > 0.0 else math.inf, None if others else run


_functions: dict[tuple[Any, ...], Any] = {}


def _jobs(
    system: System,
    run: Program,
    inputs: Inputs,
    periods: float | None,
    duration: float | None,
    side: int,
) -> Jobs:
    """The trajectories in the arrays that the driver takes."""
    known = [path for path, _ in numbers(system)]
    columns = {
        known.index(path): np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()
    }
    states = _first_states(inputs, len(system.model.coordinates), run.structure.sizes.columns)
    rows = np.zeros(inputs.size, dtype=JOB)
    time = inputs.values["time"]
    frequency = inputs.values.get("load.frequency", system.load.frequency)
    length = None if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
    at = clock(time, length, periods, duration)
    last, end = _from_the_start(at)
    rows["start_time"] = at.local
    rows["period_length"] = at.length
    rows["end_time"] = end
    rows["first_period"] = at.first
    rows["last_period"] = last
    rows["leave_by"] = side
    records = record_tables(system, run.trace.records, inputs.parameters)
    if not run.trace.repeats:  # else it begins with the forcing period
        rows["piece"] = np.count_nonzero(records[0] <= np.reshape(time, (-1, 1)), axis=1)
    return Jobs(states, rows, columns, records)


def _from_the_start(at: Clock) -> tuple[Any, Any]:
    """The last forcing period and the local time at the end, where periods are counted from the
    start of the motion, at its phase.

    A motion that is longer than a whole number of periods by rounding only ends with the last of
    these.
    """
    part = np.divide(
        at.end - at.local, at.length, out=np.zeros(np.shape(at.end)), where=np.greater(at.length, 0)
    )
    back = np.where(part == 0.0, 0, np.minimum(1 - np.ceil(part - SLIVER), at.last - at.first))
    return at.last - back, at.end + back * at.length


def _first_states(inputs: Inputs, own: int, columns: int) -> np.ndarray:
    """Coordinates with the tangent's columns, then velocities with theirs: (n, 2 (own + own
    columns)).
    """
    rows = own * (1 + columns)
    states = np.zeros((inputs.size, 2 * rows))
    for i, values in enumerate(list(inputs.values.values())[: 2 * own]):
        states[:, i % own + rows * (i // own)] = values
    for j in range(min(columns, 2 * own)):  # the derivatives of the initial state to itself
        states[:, own + j * own + j % own + rows * (j // own)] = 1.0
    return states


class Advanced(NamedTuple):
    """Motions at the end of a span."""

    states: np.ndarray  # (n, 6), as `TangentEnsemble.advance` takes them
    # (n,): whether the motion came to the end with a known phase, and all numbers are finite
    sound: np.ndarray


class TangentEnsemble:
    """Motions of a system with one coordinate, each with parameters and a forcing period of its
    own.
    """

    def __init__(
        self, system: System, parameters: Mapping[str, np.ndarray], lengths: np.ndarray, tol: float
    ) -> None:
        limits = limits_of(system, ())
        places = list(system.parameters)
        options = EnsembleOptions(
            tol=tol, periods=None, limits=limits, sample=(), until=(), paths=()
        )
        run = program(system, limits, ())
        self._lanes = compiled_lanes(system, run, options, 1, parameters)
        self._columns = {places.index(path): values for path, values in parameters.items()}
        self._lengths, self.holds_coordinates = lengths, system.model.holds_coordinates
        self._records = record_tables(system, run.trace.records, {})
        # here, not in each thread that advances some of the motions
        compile_everything(self.holds_coordinates)

    def advance(
        self, rows: np.ndarray, states: np.ndarray, begin: np.ndarray, end: np.ndarray
    ) -> Advanced:
        """Advance the motions of these numbers between two local times of a forcing period, (n,)
        each, on this thread.

        A state holds coordinate, its two derivatives, velocity, its two: (n, 6).
        """
        jobs = np.zeros(rows.size, dtype=JOB)
        jobs["start_time"] = begin
        jobs["end_time"] = end
        jobs["period_length"] = self._lengths[rows]
        columns = {c: values[rows] for c, values in self._columns.items()}
        ends = self._lanes.run(Jobs(states, jobs, columns, self._records), 1)
        done = (ends.rows["status"] == Status.DONE) & (ends.rows["mode"] != Mode.CHATTER)
        return Advanced(ends.states, done & np.isfinite(ends.states).all(axis=1))
