"""Chunks computed by other processes of this machine."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections import deque
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from typing import Any

from saltus.errors import SweepError
from saltus.sweep.chunks import Computation, Index, Raised, attempt

READY = "ready"


class Workers:
    """Up to `count` processes that compute chunks, started as they are needed and kept from one sweep to the next.

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

        If a process dies (killed, out of memory), only its own chunk fails, and another process takes its place.

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
            for worker in [worker for worker in pool if worker.index is not None]:  # their chunks are not needed any more
                pool.remove(worker)
                worker.stop()


class _Worker:
    """A process, the pipe to it, and the chunk that it has."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would copy threads' locks in whatever state they are
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
        """The outcome that the process has sent; if it has died, a failure with the known reason."""
        try:
            outcome = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            if not self.ready:
                raise SweepError(
                    f"a worker process ended with exit code {self.process.exitcode} before it could compute; in a script, "
                    'call the sweep below `if __name__ == "__main__":`'
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the one that writes decides when to stop
    with contextlib.suppress(EOFError, OSError):  # the process that writes has ended
        connection.send(READY)
        while True:
            connection.send(attempt(*connection.recv()))
