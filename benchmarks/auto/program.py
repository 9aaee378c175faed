"""AUTO-07p as a program: found, linked with the equations, and run on one core in a folder of its
own.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers.peer import AbsentError
from reference import BETA0, DAMPING, VERTICAL

from auto.case import HIGHEST, LOWEST
from auto.diagram import Point, parse

EQUATIONS = Path(__file__).with_name("smoothed.f90")
LIMIT = 180.0  # seconds for one run
MOST_POINTS = 800
TURNED_BACK = HIGHEST + 0.2  # a branch that comes back here has lost its way


@dataclass(frozen=True)
class Mesh:
    """The discretisation: NTST intervals, adapted at every step, with NCOL collocation points
    each.
    """

    intervals: int
    points: int = 4

    def __str__(self) -> str:
        return f"{self.intervals} x {self.points}"


@dataclass(frozen=True)
class Run:
    """What AUTO computed, in how many seconds of processor time; `fails` where it ended otherwise
    than by itself.
    """

    branch: list[Point]
    seconds: float
    fails: str = ""


def libraries() -> list[str]:
    """AUTO's object files. Raises AbsentError where AUTO or the compiler is not installed."""
    command = shutil.which("auto-07p") or shutil.which("auto")
    places = [Path(os.environ["AUTO_DIR"])] if "AUTO_DIR" in os.environ else []
    places += (
        [
            Path(command).resolve().parents[1] / "lib" / "auto-07p",
            Path(command).resolve().parents[1],
        ]
        if command
        else []
    )
    found = next(
        (files for place in places if (files := sorted(map(str, (place / "lib").glob("*.o"))))), []
    )
    if not found or shutil.which("gfortran") is None:
        raise AbsentError(
            "AUTO-07p needs its libraries and gfortran: apt-get install auto-07p gfortran, or "
            "set AUTO_DIR"
        )
    return found


@contextmanager
def linked() -> Iterator[Path]:
    """The program, in a temporary folder that is gone afterwards."""
    objects = libraries()
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "smoothed"
        command = [
            "gfortran",
            "-O2",
            "-std=legacy",
            "-fopenmp",
            str(EQUATIONS),
            "-o",
            str(program),
            *objects,
        ]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        if done.returncode:
            raise AbsentError(f"AUTO-07p does not link: {done.stderr.strip()[-200:]}")
        yield program


def constants(
    amplitude: float, sharpness: float, mesh: Mesh, lowest: float = LOWEST, jacobian: bool = True
) -> str:
    """AUTO's constants: Omega from 3 down to `lowest`, with folds, branch points, period doublings
    and tori looked for.

    The period is left out of the arclength (THL), or most of a step at low Omega would go into it.
    Tolerances a hundred times below AUTO's usual ones, more iterations, and a mesh adapted at every
    step were what followed the sharp corners best.
    """
    parameters = {1: HIGHEST, 2: amplitude, 3: sharpness, 4: VERTICAL, 5: DAMPING, 6: BETA0}
    return "\n".join(
        [
            "dat='smoothed', NDIM=4, IPS=2, IRS=0, ILP=1, ISP=2, ISW=1, MXBF=0, ICP=[1, 11, 8, 9]",
            "PAR={"
            + ", ".join(f"{number}: {value!r}" for number, value in parameters.items())
            + "}",
            (
                f"NTST={mesh.intervals}, NCOL={mesh.points}, IAD=1, JAC={int(jacobian)}, IPLT=0, "
                "NBC=0, NINT=0, IID=2"
            ),
            "EPSL=1e-8, EPSU=1e-8, EPSS=1e-6, ITMX=9, ITNW=9, NWTN=3",
            "DS=-0.01, DSMIN=1e-7, DSMAX=0.05, IADS=1, THL={11: 0.0}",
            f"NMX={MOST_POINTS}, NPR=0, RL0={lowest}, RL1={TURNED_BACK}",
            "",
        ]
    )


def run(program: Path, orbit: np.ndarray, text: str, limit: float = LIMIT) -> Run:
    """Follow the branch that starts at `orbit` (rows of time and state) under the constants
    `text`.
    """
    with tempfile.TemporaryDirectory() as folder:
        np.savetxt(Path(folder) / "smoothed.dat", orbit, fmt="%.17g")
        before, fails = _used(), ""
        try:
            done = subprocess.run(
                [str(program)], input=text, capture_output=True, text=True, cwd=folder, timeout=limit,
                env=os.environ | {"OMP_NUM_THREADS": "1"},
            )  # fmt: skip
            if done.returncode:
                fails = f"exit status {done.returncode}"
        except subprocess.TimeoutExpired:
            fails = f"not done in {limit:g} s"
        seconds = _used() - before
        diagram = Path(folder) / "fort.7"
        return Run(parse(diagram.read_text()) if diagram.exists() else [], seconds, fails)


def _used() -> float:
    """Processor time of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def version() -> str:
    """What Debian calls the installed version, where it is Debian's; or `AUTO_VERSION`, beside
    `AUTO_DIR`.
    """
    if "AUTO_VERSION" in os.environ:
        return os.environ["AUTO_VERSION"]
    if shutil.which("dpkg-query") is None:
        return "version unknown"
    done = subprocess.run(
        ["dpkg-query", "-W", "-f=${Version}", "auto-07p"], capture_output=True, text=True
    )
    return done.stdout.strip() or "version unknown"
