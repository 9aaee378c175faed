"""Ensembles: many exact trajectories of one system, from many states and with many parameters, in lanes on all cores."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_memory, check_number, check_work
from saltus.flow.kernel.structures import Program, limits_of, program
from saltus.flow.lanes.capture_speeds import capture_speeds
from saltus.flow.lanes.compiled_lanes import compile_beside, compile_driver_aside, load_lane_functions
from saltus.flow.lanes.ensemble_dataset import to_dataset
from saltus.flow.lanes.ensemble_result import EnsembleResult
from saltus.flow.lanes.inputs import Inputs, read_inputs
from saltus.flow.lanes.lane_layout import JobLabel, JobNumber
from saltus.flow.lanes.threads import Jobs, Lanes
from saltus.flow.lanes.wanted import Sample, Until, Wanted, read_last, read_names, read_side, read_threads
from saltus.flow.motion.forcing_time import Clock, clock
from saltus.progress import Progress, silent
from saltus.public_functions import Numbers
from saltus.systems import System, check_system, numbers
from saltus.taylor import record_tables

if TYPE_CHECKING:
    import xarray

SLIVER = 1e-9  # A duration that ends nearer than this share of a forcing period to the period's end is meant to end there.


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
    stop_at: Iterable[str] = (),
    sample: Iterable[str] = ("state",),
    last: int | str = 1,
    until: Iterable[str] = (),
    sensitivities: Iterable[str] | None = None,
    threads: int | None = None,
    progress: Progress = silent,
    **coordinates: Any,
) -> xarray.Dataset:
    """Exact trajectories from many states and with many parameters: each as `simulate` would follow it, but many times faster.

    Initial coordinates, velocities, times and parameters are numbers or arrays, which broadcast together as in NumPy.
    `xarray.DataArray`s broadcast by the names of their dimensions, which the result then has. To the last bit, the result of a
    trajectory depends neither on the number of threads nor on the other trajectories. The memory needed is that of the result.

    Parameters
    ----------
    system
        What moves.
    parameters
        Arrays by dotted path, such as {"load.horizontal.amplitude": np.linspace(0, 1, 101)}.
    sample
        The quantities that are kept for each of the `last` forcing periods, see `Sample`. Periods are counted from the start; the
        period in which the trajectory ends is kept, however short it is. "extrema" and "speed" are also returned for the whole
        motion.
    last
        For how many forcing periods samples are kept, counted back from the end; "all" keeps every one.
    until
        Ends a trajectory early, see `Until`.
    sensitivities
        Dotted paths of parameters. Adds the derivatives of the end state to the initial state and to these parameters, at
        a fixed time; but the end after n periods moves with "load.frequency", and an end at a margin with the margin.
    threads
        How many cores to use; by default all.
    velocity, periods, duration, tol, time, side, stop_at, progress, coordinates
        As for `simulate`; velocity a tuple of
        arrays where there are several coordinates.

    Returns
    -------
    xarray.Dataset
        A Dataset with the state at the end, `time`, `side`, `stop` (why it ended), `impact_count`, `grazings`, `periods` done
        (2.5 for two and a half), and what `sample` asks for, all over the dimensions of the arguments; see `ensemble_dataset.py`.

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
    check_system(system, "simulate_many", several_contacts=True)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    wanted = Wanted(
        tol=tol,
        periods=periods,
        limits=limits_of(system, stop_at),
        sample=read_names("sample", sample, Sample),
        until=read_names("until", until, Until),
        paths=None if sensitivities is None else read_names("sensitivities", sensitivities),
    )
    side, threads = read_side(side), read_threads(threads)
    inputs = read_inputs(system, velocity, time, parameters, coordinates)
    return to_dataset(run_ensemble(system, inputs, wanted, threads, progress, duration=duration, side=side, last=last))


def run_ensemble(
    system: System,
    inputs: Inputs,
    wanted: Wanted,
    threads: int,
    progress: Progress,
    *,
    duration: float | None = None,
    side: int = 0,
    last: int | str = 1,
    captured: np.ndarray | None = None,
) -> EnsembleResult:
    """Compile the code that is not there yet, and run the trajectories; `captured` holds speeds of capture that are known."""
    driver = compile_driver_aside(system.model.holds_coordinates)
    run = program(system, wanted.limits, wanted.paths)
    jobs = _jobs(system, run, inputs, wanted.periods, duration, side)
    if Until.REST in wanted.until:
        jobs.numbers[:, JobNumber.CAPTURE_SPEED] = capture_speeds(system, inputs.parameters, wanted.limits, known=captured)
    spans = jobs.labels[:, JobLabel.LAST_PERIOD] - jobs.labels[:, JobLabel.FIRST_PERIOD]
    begun = jobs.numbers[:, JobNumber.END_TIME] > jobs.numbers[:, JobNumber.START_TIME]
    check_work("periods" if duration is None else "duration", inputs.size, float(np.max(spans, initial=0)))
    kept = read_last(last, int(np.max(spans + begun, initial=1)))
    check_memory("last", 16.0 * len(wanted.sample) * kept * inputs.size, f"samples of {kept} periods of {inputs.size} motions")
    lanes = compiled_lanes(system, run, wanted, kept)
    if driver is not None:
        compile_beside(driver, system.model.holds_coordinates)
    ends = lanes.run(jobs, threads, progress, total=float(np.sum(spans + 1)))
    return EnsembleResult(system, inputs, wanted, jobs, ends)


def compiled_lanes(system: System, run: Program, wanted: Wanted, kept: int) -> Lanes:
    """The compiled lanes of a system, with the settings for the samples that they keep of each trajectory."""
    key = run.structure.functions  # their addresses
    if key not in _functions:
        _functions[key] = load_lane_functions(run.trace)
    slots, functions = _functions[key]
    own = len(system.model.coordinates)
    return Lanes(
        program=run,
        slots=slots,
        functions=functions,
        parameters=run.env[0] if run.trace.several else np.array([value for _, value in numbers(system)] or [0.0]),
        tol=wanted.tol,
        kept=kept if wanted.sample else 1,
        sampled=[column for kind in Sample if kind in wanted.sample for column in kind.columns(own)],
        extrema=Sample.EXTREMA in wanted.sample,
        from_start=wanted.from_start,
        settle=Until.SETTLED in wanted.until,
    )


_functions: dict[tuple[int, ...], Any] = {}


def _jobs(system: System, run: Program, inputs: Inputs, periods: float | None, duration: float | None, side: int) -> Jobs:
    """The trajectories in the arrays that the driver takes."""
    known = [path for path, _ in numbers(system)]
    columns = {known.index(path): np.broadcast_to(a, inputs.size) for path, a in inputs.parameters.items()}
    states = _first_states(inputs, len(system.model.coordinates), run.structure.sizes.columns)
    numbers_of, labels = np.zeros((inputs.size, len(JobNumber))), np.zeros((inputs.size, len(JobLabel)), dtype=np.int64)
    time, frequency = inputs.values["time"], inputs.values.get("load.frequency", system.load.frequency)
    length = None if frequency is None else 2.0 * math.pi / np.asarray(frequency, dtype=float)
    at = clock(time, length, periods, duration)
    last, end = _from_the_start(at)
    numbers_of[:, JobNumber.START_TIME], numbers_of[:, JobNumber.PERIOD_LENGTH] = at.local, at.length
    numbers_of[:, JobNumber.END_TIME] = end
    labels[:, JobLabel.FIRST_PERIOD], labels[:, JobLabel.LAST_PERIOD], labels[:, JobLabel.LEAVE_BY] = at.first, last, side
    records = record_tables(system, run.trace.records, inputs.parameters)
    labels[:, JobLabel.PIECE] = np.count_nonzero(records[0] <= np.reshape(time, (-1, 1)), axis=1)
    return Jobs(states, numbers_of, labels, columns, records)


def _from_the_start(at: Clock) -> tuple[Any, Any]:
    """The last forcing period and the local time at the end, where periods are counted from the start of the motion, at its
    phase.

    A motion that is longer than a whole number of periods by rounding only ends with the last of these.
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
