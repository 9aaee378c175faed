"""The rows of all sizes, kept as they come, and their table."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measure import equal_error
from report import number, table

from saltus.files import write_text

HERE = Path(__file__).resolve().parent
RESULTS, KEPT = (
    HERE.parent / "results",
    HERE.parent.parent / "results" / "benchmarks" / "structures",
)
SIZES, CELLS = (1, 3, 10, 30, 100, 200), (1, 2, 4, 8, 16, 32)
QUICK_SIZES, QUICK_CELLS = (1, 10, 30), (1, 4)
# seconds for a row, and for what all rows share
LIMIT, LIMIT_OF_QUICK, LIMIT_OF_KERNELS = 400.0, 60.0, 1800.0
TARGETS = (1e-4, 1e-7)  # errors of displacements, the largest of which is some 0.06
CODES = {"motion": "saltus", "scipy": "SciPy DOP853", "siconos": "Siconos"}

READING = """
A bar of n lumped masses, held at one end, pushed at the other by a sine near its first resonance, against a wall that it meets
without restitution: an impact and a release in most of ten forcing periods, from rest. Errors are those of all displacements at
the end, against saltus at tol 1e-14; times are those of processors, at equal errors, for a forcing period of a whole call.
Beside it SciPy's DOP853, restarted at each of its events, with the dense matrices of the problem, and Siconos' time stepping
(theta = 1/2), its loop in C++ alone. *Compiling* is what the first call takes longer than the next, in a process that has
followed another structure before; of an orbit and a sweep too. A *sweep* is of five frequencies, up and down. A star:
extrapolated at first order. An *ensemble* is of 64 motions, at tol 1e-8; what a motion takes in it, beside motions one by one.
""".strip()


def beside_structures(
    about: dict[str, Any], quick: bool = False, folder: Path = RESULTS, again: bool = False
) -> None:
    """Measure what is not kept yet, and write structures.json and structures.md into `folder` after
    each row.
    """
    start, sizes, cells = (
        time.perf_counter(),
        QUICK_SIZES if quick else SIZES,
        QUICK_CELLS if quick else CELLS,
    )
    asked = [(task, n) for n in sizes for task in (*CODES, "ensemble", "orbit", "sweep")]
    asked += [
        (task, n) for n in cells for task in ("cells", "cells_together", "cells_differentiated")
    ]
    rows: dict[str, Any] = {f"{task} {n}": {"fails": "not run"} for task, n in asked}
    # all rows share their kernels, and none finds its structure compiled
    with tempfile.TemporaryDirectory() as cache:
        make = _Rows(about, LIMIT_OF_QUICK if quick else LIMIT, Path(cache), again)
        # written after each row, so that a run that is broken off leaves a table
        for task, n in asked:
            rows[f"{task} {n}"] = make.row(task, n)
            results = {"about": about, "rows": rows}
            write_text(folder / "structures.json", json.dumps(results, indent=1) + "\n")
            written = write_text(folder / "structures.md", report(results))
    print(written.read_text())
    print(f"structures: {time.perf_counter() - start:.0f} s", flush=True)


@dataclass
class _Rows:
    """The rows that were kept, and new ones, each from a process of its own."""

    about: dict[str, Any]
    limit: float
    cache: Path
    again: bool
    warm: bool = False

    def row(self, task: str, size: int) -> dict[str, Any]:
        """A row that was kept, or a new one."""
        path, key = KEPT / f"{task}_{size}.json", _key(self.about)
        if path.exists() and not self.again:
            found: dict[str, Any] = json.loads(path.read_text())
            if found["key"] == key and "fails" not in found:
                return found
        if not self.warm:  # what all rows share is compiled first, which takes minutes
            self.warm = True
            self._made("before", 2, LIMIT_OF_KERNELS)
        row = self._made(task, size, self.limit) | {"key": key}
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(row) + "\n")
        return row

    def _made(self, task: str, size: int, limit: float) -> dict[str, Any]:
        """A new row, and a line about it."""
        start = time.perf_counter()
        row = _computed(task, size, limit, self.cache)
        print(
            f"{task} {size}: {row.get('fails', 'done')}, {time.perf_counter() - start:.0f} s",
            flush=True,
        )
        return row


def _key(about: dict[str, Any]) -> str:
    """What a row that is kept depends on: the processor, the versions, and the sources."""
    sources = sorted([*(HERE.parent.parent / "src").rglob("*.py"), *HERE.rglob("*.py")])
    texts = [about["processor"], about["versions"], *(path.read_text() for path in sources)]
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:20]


def _computed(task: str, size: int, limit: float, cache: Path) -> dict[str, Any]:
    """A row from a process of its own, or `fails` with the reason."""
    command = [sys.executable, str(HERE / "row.py"), task, str(size)]
    one_core = {
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "NUMBA_NUM_THREADS": "1",
        "SALTUS_CACHE_DIR": str(cache),
    }
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=limit, env=os.environ | one_core
        )
    except subprocess.TimeoutExpired:
        return {"fails": f"over {limit:g} s"}
    if done.returncode:
        return {"fails": (done.stderr.strip().splitlines() or ["no answer"])[-1][:200]}
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def report(results: dict[str, Any]) -> str:
    """What was found, in Markdown."""
    rows, about = results["rows"], results["about"]
    parts = [
        "# Structures by their size",
        "\n".join(f"* {key}: {value}" for key, value in about.items()),
        READING,
    ]
    for target in TARGETS:
        head = (
            "n",
            *(f"{code}, us" for code in CODES.values()),
            "SciPy / saltus",
            "Siconos / saltus",
        )
        parts.append(
            f"## A forcing period, at an error of {target:.0e}\n\n"
            + table(head, _periods(rows, target))
        )
    head = (
        "n",
        "compiling, s",
        "MiB",
        "orbit, s",
        "its compiling, s",
        "MiB",
        "sweep, s",
        "its compiling, s",
        "MiB",
    )
    parts.append("## Compiling, orbits, sweeps and memory\n\n" + table(head, _costs(rows)))
    together = ("in an ensemble, us", "alone, us", "its compiling, s", "MiB")
    parts.append(
        "## A motion's forcing period in an ensemble\n\n"
        + table(("n", *together), _together(rows, "ensemble"))
    )
    lines = [
        (*line, *_cells(rows[f"cells_together {line[0]}"], *TOGETHER))
        for line in _alone(rows, "cells")
    ]
    head = ("cells", "compiling, s", "a period, us", "MiB", *together)
    parts.append("## Chains of cells, at tol 1e-8\n\n" + table(head, lines))
    head = ("cells", "compiling, s", "a period, us", "MiB")
    parts.append(
        "## Derivatives of chains, to the start and one parameter\n\n"
        + table(head, _alone(rows, "cells_differentiated"))
    )
    return "\n\n".join(parts) + "\n"


# what is said of an ensemble, and in which unit
TOGETHER = (("seconds", 1e6), ("alone", 1e6), ("compile", 1.0), ("peak", 1.0))


def _together(rows: dict[str, Any], task: str) -> list[tuple[str, ...]]:
    """The lines of a table of ensembles."""
    return [
        (name.split()[1], *_cells(row, *TOGETHER))
        for name, row in rows.items()
        if name.split()[0] == task
    ]


def _alone(rows: dict[str, Any], task: str) -> list[tuple[str, ...]]:
    """The lines of a table of motions."""
    asked = ("compile", 1.0), ("seconds", 1e6), ("peak", 1.0)
    return [
        (name.split()[1], *_cells(row, *asked))
        for name, row in rows.items()
        if name.split()[0] == task
    ]


def _sizes(rows: dict[str, Any]) -> list[str]:
    return [name.split()[1] for name in rows if name.startswith("motion ")]


def _periods(rows: dict[str, Any], target: float) -> list[tuple[str, ...]]:
    """The lines of the table at an error: microseconds for a period of each code, and the
    ratios.
    """
    from structures.case import PERIODS

    found = []
    for n in _sizes(rows):
        times = {task: at_error(rows[f"{task} {n}"], target) for task in CODES}
        cells = [
            _said(rows[f"{task} {n}"], times[task][0] / PERIODS * 1e6, times[task][1])
            for task in CODES
        ]
        ratios = [
            _said({}, times[task][0] / times["motion"][0], times[task][1])
            for task in ("scipy", "siconos")
        ]
        found.append((n, *cells, *ratios))
    return found


def at_error(row: dict[str, Any], target: float) -> tuple[float, bool]:
    """Seconds for an error of at most `target`, and whether they were reached; those beyond the
    smallest step at first order.
    """
    if "rows" not in row:
        return float("nan"), True
    errors, seconds = (
        [max(each[name], 1e-16) for each in row["rows"]] for name in ("error", "seconds")
    )
    found = float(equal_error(errors, seconds, [target])[0])
    return (found, True) if np.isfinite(found) else (seconds[-1] * errors[-1] / target, False)


def _said(row: dict[str, Any], value: float, reached: bool) -> str:
    return row["fails"] if "fails" in row else number(value) + ("" if reached else "*")


def _costs(rows: dict[str, Any]) -> list[tuple[str, ...]]:
    """The lines of the table of what comes beside motions."""
    found = []
    for n in _sizes(rows):
        cells = _cells(rows[f"motion {n}"], ("compile", 1.0), ("peak", 1.0))
        for task in ("orbit", "sweep"):
            cells += _cells(rows[f"{task} {n}"], ("seconds", 1.0), ("compile", 1.0), ("peak", 1.0))
        found.append((n, *cells))
    return found


def _cells(row: dict[str, Any], *asked: tuple[str, float]) -> list[str]:
    """Numbers of a row in other units; its failure takes the place of the first of them."""
    if "fails" in row:
        return [row["fails"], *[""] * (len(asked) - 1)]
    return [number(row[name] * unit) for name, unit in asked]
