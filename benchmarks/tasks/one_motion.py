"""One motion of 1, 20 and 1000 forcing periods, where a user's own loop lives, beside heyoka.py's
scalar code at equal error.

saltus is measured twice in the same run: as it is, and as it was at the commit `BEFORE`. Each code
computes in a process of its own, which this file is when it is run as a script with the name of the
code; they take turns. The error of a code is that of its end against the other code's at its
tightest tolerance.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

BENCHMARKS = Path(__file__).resolve().parent.parent
BEFORE = "ff7e16c"
PERIODS = {1: 20, 20: 10, 1000: 1}  # and how many motions are timed together
TOLERANCES = {
    "heyoka": (1e-5, 1e-7, 1e-9, 1e-11, 1e-13),
    "saltus": (1e-6, 1e-8, 1e-10, 1e-12, 1e-14),
}
TIGHTEST = 1e-15
CODES = ("heyoka.py scalar", "saltus", f"saltus at {BEFORE}")
THETA, VELOCITY = 0.3, 0.0


def one_motion(rounds: int) -> list[dict[str, Any]]:
    """A row for each code, number of periods and tolerance: the error, and the least microseconds
    of a motion.
    """
    with contextlib.ExitStack() as stack:
        sources = [BENCHMARKS.parent / "src"] * 2
        # no repository, or not that commit
        with contextlib.suppress(subprocess.CalledProcessError, FileNotFoundError):
            from against import sources_of

            sources.append(stack.enter_context(sources_of(BEFORE)))
        codes = {
            name: stack.enter_context(_process(name, path))
            for name, path in zip(CODES, sources, strict=False)
        }
        return [row for periods in PERIODS for row in _rows(codes, periods, rounds)]


def _rows(codes: dict[str, Callable[..., Any]], periods: int, rounds: int) -> list[dict[str, Any]]:
    """The rows of all codes for one number of periods."""
    ends = {name: code(periods, TIGHTEST)["end"] for name, code in codes.items()}
    asked = [
        (name, tol)
        for name in codes
        for tol in TOLERANCES[name.partition(" ")[0].partition(".")[0]]
    ]
    times, errors = dict.fromkeys(asked, math.inf), dict[tuple[str, float], float]()
    for _ in range(rounds):
        for name, tol in asked:
            found = codes[name](periods, tol)
            known = ends[CODES[1] if name == CODES[0] else CODES[0]]
            times[name, tol] = min(times[name, tol], found["microseconds"])
            errors[name, tol] = max(abs(a - b) for a, b in zip(found["end"], known, strict=True))
    return [
        {"code": n, "periods": periods, "tol": t, "error": errors[n, t], "least": times[n, t]}
        for n, t in asked
    ]


@contextlib.contextmanager
def _process(name: str, sources: Path) -> Iterator[Callable[[int, float], Any]]:
    """A code in a process of its own: a function of periods and tolerance."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(sources), str(BENCHMARKS)])}
    process = subprocess.Popen(
        [sys.executable, __file__, name],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    reads, writes = process.stdout, process.stdin

    def ask(periods: int, tol: float) -> Any:
        writes.write(json.dumps([periods, tol]) + "\n")
        writes.flush()
        return json.loads(reads.readline())

    yield ask
    writes.close()
    process.wait()


def _heyoka(periods: int, tol: float) -> Callable[[], tuple[float, float]]:
    import numpy as np
    from peers import heyoka_scalar
    from reference import FREQUENCY

    heyoka_scalar.HORIZON = periods * 2.0 * math.pi / FREQUENCY
    flow, start = heyoka_scalar.setup(tol), (np.array([THETA]), np.array([VELOCITY]))
    return lambda: tuple(float(x[0]) for x in flow(*start))  # type: ignore[return-value]


def _saltus(periods: int, tol: float) -> Callable[[], tuple[float, float]]:
    from peers.saltus_scalar import system

    import saltus

    what = system()

    def motion() -> tuple[float, float]:
        found = saltus.simulate(
            what, theta=THETA, velocity=VELOCITY, periods=periods, tol=tol, dense=False
        )
        return found.theta, found.velocity

    return motion


def answer(code: str) -> None:
    """Answer each line [periods, tol] with the end of the motion and the microseconds that it
    takes.
    """
    made: dict[tuple[int, float], Callable[[], tuple[float, float]]] = {}
    for line in sys.stdin:
        periods, tol = json.loads(line)
        flow = (
            (_heyoka if code == CODES[0] else _saltus)(periods, tol)
            if (periods, tol) not in made
            else made[periods, tol]
        )
        made[periods, tol] = flow
        end, count = flow(), PERIODS[periods]
        start = time.process_time()
        for _ in range(count):
            flow()
        print(
            json.dumps({"end": end, "microseconds": 1e6 * (time.process_time() - start) / count}),
            flush=True,
        )


if __name__ == "__main__":
    answer(sys.argv[1])
