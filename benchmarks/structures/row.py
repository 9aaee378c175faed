"""One row, in a process of its own: row.py TASK SIZE, a task being a function of this file; its answer is the last line, as JSON.

A time is the processor time of this process. The kernels, which no model changes, are compiled before; what a first call takes
longer than the next ones is the tracing and compiling of this structure.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import saltus
from structures.case import END, PERIODS, SWEPT, bar, by_scipy, chain, for_siconos

TOLERANCES = {"ours": (1e-6, 1e-8, 1e-10), "SciPy": (1e-4, 1e-6, 1e-8)}
STEPS = tuple(2000 * 4**k for k in range(4))
EXACT = 1e-14
BEFORE = 2  # coordinates of the structure, or cells of the chain, with which the kernels are compiled


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of processor time, and the result."""
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def displaced(system: saltus.System, tol: float, start: dict[str, Any] | None = None) -> np.ndarray:
    """The displacements at the end."""
    model: Any = system.model
    motion = saltus.simulate(system, **(start or model.start()), duration=END, tol=tol, dense=False)
    return np.asarray(model.displacements(np.atleast_1d(motion.position)))


def motion(size: int) -> dict[str, Any]:
    """The motion at each tolerance, with its error, what the first call takes longer, and the memory of the process."""
    displaced(bar(BEFORE if size != BEFORE else BEFORE + 1), EXACT)
    system = bar(size)
    start = _start(system)
    first, _ = timed(lambda: displaced(system, TOLERANCES["ours"][0], start))
    exact = displaced(system, EXACT)
    rows = [_row(tol, lambda tol=tol: displaced(system, tol, start), exact) for tol in TOLERANCES["ours"]]
    return {"rows": rows, "compile": first - rows[0]["seconds"], "peak": _peak()}


def scipy(size: int) -> dict[str, Any]:
    """The same by SciPy."""
    exact = displaced(bar(size), EXACT)
    return {"rows": [_row(tol, lambda tol=tol: by_scipy(size, tol), exact, rounds=1) for tol in TOLERANCES["SciPy"]]}


def siconos(size: int) -> dict[str, Any]:
    """The same by Siconos, whose tolerances are numbers of steps."""
    from siconos.program import march

    exact, rows = displaced(bar(size), EXACT), []
    for count in STEPS:
        (answer,) = march([for_siconos(size, count)])
        error = np.abs(np.array(answer["state"][:size]) - exact).max()
        rows.append({"tol": count, "seconds": answer["seconds"][0], "error": float(error)})
        if answer["seconds"][0] > MOST_OF_SICONOS:
            break
    return {"rows": rows}


MOST_OF_SICONOS = 10.0  # seconds, after which no smaller steps are tried


def orbit(size: int) -> dict[str, Any]:
    """A periodic orbit from rest, and what it takes longer at the first time."""
    saltus.find_orbit(bar(BEFORE), **_start(bar(BEFORE)))
    return _twice(lambda: saltus.find_orbit(bar(size), **_start(bar(size))))


def sweep(size: int) -> dict[str, Any]:
    """A sweep of five values, up and down."""
    return _twice(lambda: saltus.frequency_sweep(bar(size), SWEPT, tol=1e-9, **_start(bar(size))))


def cells(size: int) -> dict[str, Any]:
    """A motion of a chain of cells, and what its first call takes longer."""

    def follow(cells: int) -> Any:
        system = chain(cells)
        signs = {contact.coordinate: contact.sign for contact in system.model.contacts}
        start = {name: signs[name] * (0.2 + 0.01 * i) for i, name in enumerate(system.model.coordinates)}
        return saltus.simulate(system, **start, duration=END, tol=1e-8, dense=False)

    follow(BEFORE if size != BEFORE else BEFORE + 1)
    first, _ = timed(lambda: follow(size))
    again, _ = timed(lambda: follow(size))
    return {"compile": first - again, "seconds": again / PERIODS, "peak": _peak()}


def _start(system: saltus.System) -> dict[str, Any]:
    model: Any = system.model
    found: dict[str, Any] = model.start()
    return found


def _row(tol: float, call: Callable[[], np.ndarray], exact: np.ndarray, rounds: int = 3) -> dict[str, float]:
    """The least seconds of some rounds, and the error."""
    found = [timed(call) for _ in range(rounds)]
    error = float(np.abs(found[0][1] - exact).max())
    return {"tol": tol, "seconds": min(seconds for seconds, _ in found), "error": error}


def _twice(call: Callable[[], Any]) -> dict[str, Any]:
    """The seconds of a call, and what the first one takes longer."""
    first, _ = timed(call)
    again, _ = timed(call)
    return {"compile": first - again, "seconds": again, "peak": _peak()}


def _peak() -> float:
    """The most memory that the process has had, in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    answer = globals()[sys.argv[1]](int(sys.argv[2]))
    print(json.dumps(answer))
