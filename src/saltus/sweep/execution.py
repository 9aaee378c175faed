"""The execution of a plan: missing chunks are computed here, in other processes or on a cluster,
and written by this process.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_count
from saltus.errors import ParameterError, SweepError, shown
from saltus.progress import Progress, silent
from saltus.sweep.chunks import Arrays, Computation, Failure, Index, Raised, attempt, checked
from saltus.sweep.plan import Plan
from saltus.sweep.store import Store, opened

if TYPE_CHECKING:
    import xarray

    from saltus.sweep.workers import Workers

Outcomes = Iterator[tuple[Index, Any]]

NOTE_EVERY = 1.0  # the least time between two writes of the list of failures, s

log = logging.getLogger("saltus.sweep")


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; the message says what is kept and how to go on.

    Examples
    --------
    >>> issubclass(saltus.sweep.SweepInterrupted, KeyboardInterrupt)
    True
    """


@answered
def run(
    plan: Plan,
    store: Path | str | None = None,
    *,
    workers: int | Workers | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    retries: int = 1,
) -> xarray.Dataset:
    r"""Compute what is missing of a sweep.

    A chunk whose function raises is reported through `logging` and tried again after the others.
    Results are written by this process alone, wherever they are computed: a cluster's machines need
    not share its disk.

    Parameters
    ----------
    plan
        What is computed.
    store
        A folder for a Zarr v3 store; it is made, or gone on with if it is of the same plan. None
        keeps all in memory.
    workers
        How many processes compute chunks at once; None computes one chunk after the other in this
        one, which is right for functions that use all cores themselves. `Workers` are kept from one
        run to the next. Scripts need `if __name__ == "__main__":` around a run with workers.
    scheduler
        The address of a Dask scheduler, such as "tcp://host:8786", whose workers compute the
        chunks.
    progress
        Called before the first chunk and after each with the share of the chunks that are done, and
        in words with their number and about how many seconds are left.
    retries
        How often a failed chunk is tried again.

    Returns
    -------
    xarray.Dataset
        The complete dataset, with the plan's variables, coordinates and attributes: in memory, or
        read from the store when it is needed.

    Raises
    ------
    ParameterError
        Bad arguments, the store of another plan, or a function that returns something else than
        planned.
    SweepError
        Chunks failed for good, the store cannot be written, another run writes to it, or the
        cluster does not answer.
    SweepInterrupted
        Ctrl-C. In all these cases the chunks written before are kept.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("squares.py").write_text("def squares(arguments, block):\n    return {'y': block['x'] ** 2}\n")
    >>> axes, variables = {"x": np.arange(4.0)}, {"y": saltus.sweep.Variable()}
    >>> plan = saltus.sweep.Plan(function="squares:squares", axes=axes, variables=variables)
    >>> saltus.sweep.run(plan)["y"].values
    array([0., 1., 4., 9.])
    """
    if not isinstance(plan, Plan):
        raise ParameterError(f"plan must be a Plan, got {plan!r:.80}", "plan")
    check_count("retries", retries, 0, 100)
    path = check_run(store, workers, scheduler, progress)
    with nullcontext(MemoryResults(plan)) if path is None else opened(plan, path) as results:
        sweep = _SweepRun(plan, results, progress, retries)
        try:
            sweep.fill(workers, scheduler)
        except BaseException as error:
            if sweep.failures:
                results.note(sweep.failures.values())
            if not isinstance(error, KeyboardInterrupt):
                raise
            kept = (
                "nothing is kept without a store"
                if path is None
                else f"{path} keeps them: run the same again to go on"
            )
            raise SweepInterrupted(
                f"interrupted after {sweep.done} of {sweep.total} chunks; {kept}"
            ) from None
        sweep.conclude()
        return results.dataset()


class MemoryResults:
    """The arrays of a plan, in memory, with the interface of a `Store`."""

    path = None

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.arrays = {
            name: np.full(plan.shape(name), v.fill, dtype=v.dtype)
            for name, v in plan.variables.items()
        }

    def missing(self) -> list[Index]:
        """All chunks."""
        return list(self.plan.chunks.indices())

    def write(self, index: Index, values: Arrays) -> None:
        """Keep a chunk."""
        cut = self.plan.chunks.slices(index)
        for name, array in self.arrays.items():
            array[cut] = values[name]

    def note(self, failures: Iterable[Failure]) -> None:
        """Do nothing: in memory, nobody could read a list of failures while the sweep runs."""

    def dataset(self) -> xarray.Dataset:
        """The dataset of all chunks that were computed."""
        import xarray

        variables = {
            name: (self.plan.dimensions(name), array, self.plan.variables[name].attrs)
            for name, array in self.arrays.items()
        }
        axes = {name: (name, values.copy()) for name, values in self.plan.axes.items()}
        return xarray.Dataset(variables, coords=axes, attrs=self.plan.attributes)


class _SweepRun:
    """One run of a plan: the queue of missing chunks, the failures, and the progress."""

    def __init__(
        self, plan: Plan, results: Store | MemoryResults, progress: Progress, retries: int
    ) -> None:
        self.plan = plan
        self.results = results
        self.progress = progress
        self.retries = retries
        self.queue = deque(results.missing())
        self.total = plan.chunks.total
        self.done = self.before = self.total - len(self.queue)
        self.failures: dict[Index, Failure] = {}
        self.noted = -NOTE_EVERY

    def fill(self, workers: int | Workers | None, scheduler: str | None) -> None:
        """Compute and write chunks until none is left that may be tried."""
        self.start = time.monotonic()
        self._report_progress()
        if not self.queue:
            return
        with closing(outcomes(self.plan, self.queue, workers, scheduler)) as found:
            for index, outcome in found:
                if isinstance(outcome, Raised):
                    self._fail(index, outcome)
                    continue
                self.results.write(index, checked(self.plan, index, outcome))
                self.done += 1
                if self.failures.pop(index, None):
                    self._save_failures()
                self._report_progress()

    def conclude(self) -> None:
        """Raise if chunks are missing."""
        self.results.note(self.failures.values())
        if not self.failures:
            return
        first, *others = sorted(self.failures.values(), key=lambda failure: failure.index)
        more = f", and {len(others)} more" if others else ""
        if self.results.path is None:
            dataset = self.results.dataset()
            kept = "the others are in the error's `dataset`"
        else:
            dataset = None
            kept = (
                f"{self.results.path} keeps the others, and the same run again computes only "
                "what is missing"
            )
        sentence = f"{len(self.failures)} of {self.total} chunks failed: {first}{more}; {kept}"
        raise SweepError(sentence, (first, *others), dataset)

    def _fail(self, index: Index, raised: Raised) -> None:
        attempts = self.failures[index].attempts + 1 if index in self.failures else 1
        failure = self.failures[index] = Failure(
            index, self.plan.place(index), raised.error, attempts
        )
        again = attempts <= self.retries
        if again:
            self.queue.append(index)
        given_up = f"given up after {attempts} attempt{'s' * (attempts > 1)}"
        log.warning("%s; %s", failure, "it is tried again" if again else given_up)
        log.debug("%s", raised.traceback)
        self._save_failures()

    def _save_failures(self) -> None:
        """Write the list of failures, which may be long, unless it was written only just before."""
        if time.monotonic() - self.noted > NOTE_EVERY:
            self.results.note(self.failures.values())
            self.noted = time.monotonic()

    def _report_progress(self) -> None:
        computed = self.done - self.before
        elapsed = time.monotonic() - self.start
        left = elapsed / computed * (self.total - self.done) if computed else 0.0
        estimate = f", about {left:.0f} s left" if left else ""
        self.progress(
            self.done / self.total,
            f"{self.done} of {self.total} chunks{estimate}" if self.total > 1 else "computing",
        )


def outcomes(
    plan: Computation, queue: deque[Index], workers: int | Workers | None, scheduler: str | None
) -> Any:
    """Take chunks from the queue until it is empty, and yield the outcome of each, in any order."""
    if scheduler is not None:
        from saltus.sweep.workers import on_cluster

        return on_cluster(plan, queue, scheduler)
    if isinstance(workers, int):
        return _in_processes(plan, queue, workers)
    return _here(plan, queue) if workers is None else workers.outcomes(plan, queue)


def _in_processes(plan: Computation, queue: deque[Index], count: int) -> Outcomes:
    from saltus.sweep.workers import Workers

    with Workers(count) as workers:
        yield from workers.outcomes(plan, queue)


def _here(plan: Computation, queue: deque[Index]) -> Outcomes:
    while queue:
        index = queue.popleft()
        yield index, attempt(plan.function, plan.arguments, plan.block(index))


def check_run(store: Any, workers: Any, scheduler: Any, progress: Any) -> Path | None:
    """Check the arguments that say where chunks are kept and who computes them; returns the path of
    the store.

    Raises
    ------
    ParameterError
        One of them has no meaning.
    """
    if workers is not None:
        check_count("workers", getattr(workers, "count", workers), 1)
    if scheduler is not None and (not isinstance(scheduler, str) or "://" not in scheduler):
        raise ParameterError(
            f"scheduler must be an address such as 'tcp://host:8786', got {scheduler!r}",
            "scheduler",
        )
    if scheduler is not None and workers is not None:
        raise ParameterError(
            "workers and scheduler are given both; a cluster has workers of its own"
        )
    if not callable(progress):
        raise ParameterError(
            "progress must be a function of the fraction done and of what is being done, got "
            f"{progress!r}",
            "progress",
        )
    return store_path(store)


def store_path(store: Any) -> Path | None:
    """The path of a store, or None.

    Raises
    ------
    ParameterError
        It is no path of a folder on this machine.
    """
    if store is not None and not isinstance(store, str | Path):
        raise ParameterError(
            f"store must be the path of a folder, or None, got {store!r:.80}", "store"
        )
    if "\0" in str(store):
        raise ParameterError("store must be the path of a folder, without a null letter", "store")
    if isinstance(store, str) and "://" in store:
        raise ParameterError(
            f"store must be a folder on this machine, got the address {store!r}", "store"
        )
    if store is None:
        return None
    try:
        Path(store).exists()
    except OSError as error:
        raise ParameterError(
            f"store must be the path of a folder: {error.strerror}, got {shown(str(store))}",
            "store",
        ) from None
    return Path(store)
