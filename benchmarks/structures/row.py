"""One row, in a process of its own: row.py TASK SIZE, a task being a function of this file; its
answer is the last line, as JSON.

A time is the processor time of this process. The kernels, which no model changes, are compiled
before; what a first call takes longer than the next ones is the tracing and compiling of this
structure.
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
# coordinates of the structure, and cells of the chain, with which the kernels are compiled
BEFORE, CELLS_BEFORE = 2, 3
TOGETHER, ALONE = 64, 8  # motions of an ensemble, and how many of them are followed one by one


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


def before(size: int) -> dict[str, Any]:
    """Everything once, so that what no model changes is compiled."""
    for row in (motion, orbit, sweep, ensemble):
        row(size)
    for chained in (cells, cells_together, cells_differentiated):
        chained(CELLS_BEFORE)
    return {}


def motion(size: int) -> dict[str, Any]:
    """The motion at each tolerance, with its error, what the first call takes longer, and the
    memory of the process.
    """
    displaced(bar(BEFORE if size != BEFORE else BEFORE + 1), EXACT)
    system = bar(size)
    start = _start(system)
    first, _ = timed(lambda: displaced(system, TOLERANCES["ours"][0], start))
    exact = displaced(system, EXACT)
    rows = [
        _row(tol, lambda tol=tol: displaced(system, tol, start), exact)
        for tol in TOLERANCES["ours"]
    ]
    return {"rows": rows, "compile": first - rows[0]["seconds"], "peak": _peak()}


def scipy(size: int) -> dict[str, Any]:
    """The same by SciPy."""
    exact = displaced(bar(size), EXACT)
    return {
        "rows": [
            _row(tol, lambda tol=tol: by_scipy(size, tol), exact, rounds=1)
            for tol in TOLERANCES["SciPy"]
        ]
    }


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


def ensemble(size: int) -> dict[str, Any]:
    """Motions of an ensemble under pushes of 0.9 to 1.1 times the usual one."""
    _together(bar(BEFORE), _start(bar(BEFORE)), "load.push.amplitude")
    return _together(bar(size), _start(bar(size)), "load.push.amplitude")


def cells(size: int) -> dict[str, Any]:
    """A motion of a chain of cells, and what its first call takes longer."""

    def follow(cells: int) -> Any:
        found = saltus.simulate(
            chain(cells), **_start_of_cells(cells), periods=PERIODS, tol=TOL, dense=False
        )
        assert found.stop == "horizon", found.stop  # a motion that ends before would be cheap
        return found

    follow(CELLS_BEFORE)
    found = _twice(lambda: follow(size))
    return found | {"seconds": found["seconds"] / PERIODS}


def cells_together(size: int) -> dict[str, Any]:
    """The same of an ensemble."""
    _together(chain(CELLS_BEFORE), _start_of_cells(CELLS_BEFORE), "load.horizontal.amplitude")
    return _together(chain(size), _start_of_cells(size), "load.horizontal.amplitude")


def cells_differentiated(size: int) -> dict[str, Any]:
    """The same of a motion with its derivatives to the start and to the load."""

    def follow(cells: int) -> Any:
        asked: dict[str, Any] = {**_start_of_cells(cells), "periods": PERIODS, "tol": TOL}
        return saltus.sensitivities(chain(cells), parameters=["load.horizontal.amplitude"], **asked)

    follow(CELLS_BEFORE)
    found = _twice(lambda: follow(size))
    return found | {"seconds": found["seconds"] / PERIODS}


TOL = 1e-8  # of ensembles, and of motions of chains


def _together(system: saltus.System, start: dict[str, Any], path: str) -> dict[str, Any]:
    """The seconds of a motion and a forcing period in an ensemble, what its first call takes
    longer, and those without others.
    """
    values = np.linspace(0.9, 1.1, TOGETHER) * system.get(path)
    asked: dict[str, Any] = {**start, "periods": PERIODS, "tol": TOL}
    found = _twice(
        lambda: saltus.simulate_many(
            system, **asked, sample=(), parameters={path: values}, threads=1
        )
    )
    systems = [system.with_({path: float(value)}) for value in values[:: TOGETHER // ALONE]]
    alone = [
        timed(lambda: [saltus.simulate(each, **asked, dense=False) for each in systems])[0]
        for _ in range(2)
    ]
    each = found["seconds"] / (TOGETHER * PERIODS)
    return found | {"seconds": each, "alone": min(alone) / (len(systems) * PERIODS)}


def _start_of_cells(cells: int) -> dict[str, Any]:
    """All layers open, the more so the farther along the chain."""
    signs = [contact.sign for contact in chain(cells).model.contacts]
    return {
        name: sign * (0.2 + 0.01 * i)
        for i, (name, sign) in enumerate(zip(chain(cells).model.coordinates, signs, strict=True))
    }


def _start(system: saltus.System) -> dict[str, Any]:
    model: Any = system.model
    found: dict[str, Any] = model.start()
    return found


def _row(
    tol: float, call: Callable[[], np.ndarray], exact: np.ndarray, rounds: int = 3
) -> dict[str, float]:
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
