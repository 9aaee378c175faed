"""The comparison: every B on every mesh by AUTO, the exact branch by saltus, and the files that
hold them.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from peers.peer import AbsentError

from auto.case import HIGHEST, KNOWN, SHARPNESSES, TIMED, Known, first_orbit
from auto.exact import exact_curve, exact_rows
from auto.picture import SHOWN, draw
from auto.program import Mesh, constants, linked, run, version
from auto.section import report
from auto.verdicts import row
from saltus.files import write_bytes, write_text

RESULTS = Path(__file__).resolve().parent.parent / "results"
MESHES = (Mesh(20), Mesh(100), Mesh(400), Mesh(200, 7))
QUICK_MESHES, QUICK_SHARPNESSES = (Mesh(20), Mesh(100)), (50.0, 5000.0)


def beside_auto(about: dict[str, Any], quick: bool = False, folder: Path = RESULTS) -> None:
    """Measure, write auto.json, auto.md and auto.png into `folder`, and print the table.

    Where AUTO is not installed, the report says how to install it, and nothing else is done.
    """
    start = time.perf_counter()
    try:
        results = {"about": about} | measured(quick)
        write_bytes(folder / "auto.png", draw(results))
    except AbsentError as reason:
        results = {"about": about, "absent": str(reason)}
    write_text(folder / "auto.json", json.dumps(results, indent=1) + "\n")
    print(write_text(folder / "auto.md", report(results)).read_text())
    print(f"auto: {time.perf_counter() - start:.0f} s", flush=True)


def measured(quick: bool) -> dict[str, Any]:
    """Every run. Raises AbsentError where AUTO is not installed."""
    meshes, sharpnesses = (QUICK_MESHES, QUICK_SHARPNESSES) if quick else (MESHES, SHARPNESSES)
    rows = []
    with linked() as program:
        for amplitude, known in KNOWN.items():
            orbit = first_orbit(amplitude)
            for sharpness in sharpnesses:
                for mesh in meshes:
                    names = {"amplitude": amplitude, "sharpness": sharpness, "mesh": str(mesh)}
                    rows.append(names | _row(program, orbit, names, mesh, known))
                print(f"auto: H = {amplitude:g}, B = {sharpness:g}", flush=True)
    exact = {
        str(amplitude): exact_rows(amplitude, known, 1 if quick else 3)
        for amplitude, known in KNOWN.items()
    }
    return {"version": version(), "auto": rows, "exact": exact, "curve": exact_curve(SHOWN)}


def _row(
    program: Path, orbit: np.ndarray, names: dict[str, Any], mesh: Mesh, known: Known
) -> dict[str, Any]:
    """One run, and one down to TIMED alone for its time, where AUTO gets there."""
    amplitude, sharpness = names["amplitude"], names["sharpness"]
    done = run(program, orbit, constants(amplitude, sharpness, mesh))
    curve = {
        "omega": [p.omega for p in done.branch],
        "amplitude": [p.amplitude for p in done.branch],
    }
    timed = None
    if min(curve["omega"], default=HIGHEST) <= TIMED:
        part = run(program, orbit, constants(amplitude, sharpness, mesh, lowest=TIMED))
        timed = part.seconds if part.branch and part.branch[-1].omega <= TIMED else None
    return row(done, known) | {"timed": timed, "curve": curve}
