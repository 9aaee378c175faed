"""Chunks computed by other processes of this machine, or by the workers of a Dask cluster.

Results are sent to this process, which writes them: the machines need no common disk, and only one
process ever writes.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from saltus.errors import SweepError
from saltus.sweep.chunks import Computation, Index, Raised, attempt
from saltus.sweep.store_files import deferred_interrupts

READY = "ready"


class Workers:
    """Up to `count` processes that compute chunks, started as they are needed and kept from one
    sweep to the next.

    It is a context manager; the processes end with the context.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.pool: list[_Worker] = []

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self.pool:
            worker.stop()
        self.pool.clear()

    def outcomes(self, plan: Computation, queue: deque[Index]) -> Iterator[tuple[Index, Any]]:
        """Compute the chunks in the queue, and yield the outcome of each as it comes.

        If a process dies (killed, out of memory), only its own chunk fails, and another process
        takes its place.

        Raises
        ------
        SweepError
            A process ends before it can compute.
        """
        pool = self.pool
        pool += [_Worker() for _ in range(min(self.count, len(queue)) - len(pool))]
        try:
            while queue or any(worker.index is not None for worker in pool):
                for worker in pool:
                    if worker.index is None and queue:
                        worker.take(plan, queue.popleft())
                busy = {worker.connection: worker for worker in pool if worker.index is not None}
                for connection in wait(list(busy)):
                    worker = busy[connection]  # type: ignore[index]
                    outcome = worker.receive()
                    if outcome == READY:
                        worker.ready = True
                        continue
                    index, worker.index = worker.index, None
                    if worker.dead:
                        pool[pool.index(worker)] = _Worker()
                    assert index is not None
                    yield index, outcome
        finally:
            # their chunks are not needed any more
            for worker in [worker for worker in pool if worker.index is not None]:
                pool.remove(worker)
                worker.stop()


class _Worker:
    """A process, the pipe to it, and the chunk that it has."""

    def __init__(self) -> None:
        # a fork would copy threads' locks in whatever state they are
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()
        self.index: Index | None = None
        self.ready = self.dead = False

    def take(self, plan: Computation, index: Index) -> None:
        self.index = index
        with contextlib.suppress(OSError):  # the process has died, which `receive` finds out
            self.connection.send((plan.function, plan.arguments, plan.block(index)))

    def receive(self) -> Any:
        """The outcome that the process has sent; if it has died, a failure with the known
        reason.
        """
        try:
            outcome = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            if not self.ready:
                raise SweepError(
                    f"a worker process ended with exit code {self.process.exitcode} before it could"
                    ' compute; in a script, call the sweep below `if __name__ == "__main__":`'
                ) from None
            self.dead = True
            return Raised(_death(self.process.exitcode or 0))
        return outcome

    def stop(self) -> None:
        self.process.kill()  # it writes no files
        self.process.join()
        self.connection.close()


def _death(code: int) -> str:
    if code >= 0:
        return f"its process ended with exit code {code}"
    memory = ", perhaps for want of memory" if code == -9 else ""
    return f"its process was ended by signal {-code}{memory}"


def _work(connection: Connection) -> None:
    """The main loop of a process: compute the chunks that it is sent, until the pipe is closed."""
    # Ctrl-C reaches all processes; the one that writes decides when to stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(EOFError, OSError):  # the process that writes has ended
        connection.send(READY)
        while True:
            connection.send(attempt(*connection.recv()))


@dataclass(frozen=True)
class ClusterSettings:
    """How long to wait for a cluster, and how many chunks it gets at once."""

    # The time given to the scheduler to answer, and again to have a worker, s.
    patience: float = 5.0
    poll: float = 0.01  # The time between two checks for results and interrupts, s.
    # Chunks for each of the cluster's threads: one in work and one waiting; more would only fill
    # memory.
    ahead: int = 2


CLUSTER = ClusterSettings()


def on_cluster(plan: Computation, queue: deque[Index], address: str) -> Iterator[tuple[Index, Any]]:
    """Compute the chunks in the queue on the cluster at `address`, and yield the outcome of each as
    it comes.

    A chunk whose worker dies is given to another by the scheduler. The workers need saltus and the
    plan's function, in the same versions as here.

    Raises
    ------
    SweepError
        `distributed` is not installed, the scheduler does not answer or goes away, or it has no
        workers.
    """
    client = _connect(address)
    try:
        from distributed import as_completed

        done = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        flying: dict[str, Index] = {}
        with deferred_interrupts() as raise_if_interrupted:
            while queue or flying:
                raise_if_interrupted()
                while queue and len(flying) < max(
                    CLUSTER.ahead, CLUSTER.ahead * sum(client.nthreads().values())
                ):
                    index = queue.popleft()
                    # Not pure: otherwise Dask would keep the error of a failed chunk, and not try
                    # it again.
                    future = client.submit(
                        attempt, plan.function, plan.arguments, plan.block(index), pure=False
                    )
                    flying[future.key] = index
                    done.add(future)
                while not done.has_ready():
                    raise_if_interrupted()
                    time.sleep(CLUSTER.poll)
                future, result = next(done)
                # the status may be out of date if a worker was lost; the result is not
                if isinstance(result, BaseException):
                    raise OSError("the task was given up")
                yield (
                    flying.pop(future.key),
                    Raised(_reason(result)) if future.status == "error" else result,
                )
                del future, result  # so that the cluster forgets them
            raise_if_interrupted()
    except OSError as error:
        raise SweepError(
            f"the Dask scheduler at {address} has gone away ({_first_line(error)}); run the same"
            " again to go on"
        ) from error
    finally:
        with contextlib.suppress(Exception):
            client.close(timeout=1)


def _connect(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise SweepError(
            'a Dask cluster needs the package distributed: pip install ".[cluster]"'
        ) from None
    try:
        client = Client(address, timeout=CLUSTER.patience, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SweepError(
            f"no Dask scheduler answers at {address} ({_first_line(error)}); is it running, and"
            " reachable?"
        ) from error
    try:
        client.wait_for_workers(1, timeout=CLUSTER.patience)
    except TimeoutError:
        client.close(timeout=1)
        raise SweepError(
            f"the Dask scheduler at {address} has no workers; start some with `dask worker"
            f" {address}`"
        ) from None
    return client


def _reason(result: Any) -> str:
    """An error of the cluster itself in words, such as a chunk whose workers died repeatedly."""
    error = result[1] if isinstance(result, tuple) else result
    return f"{type(error).__name__}: {_first_line(error)}"


def _first_line(error: Any) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)
