"""What the first use of each kind of model costs where nothing is compiled yet.

    python benchmarks/cold.py [MODEL ...]

Each model is used in processes of their own with an empty cache of compiled code: first a motion, then
an orbit, then lanes. A line says the processor time of each process with its children, and in brackets the
time by the clock. The last column is a motion once more, when all is compiled.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

START = "import saltus, numpy as np;"
MODELS = {
    "one contact": (
        "s = saltus.System(model=saltus.WallOscillator(damping=0.1), load=saltus.Load(frequency=1.2,"
        " force=saltus.Harmonic(amplitude=0.5)), impact=saltus.NewtonImpact(e=0.7)); x = {'x': 0.0}"
    ),
    "two stops": (
        "s = saltus.System(model=saltus.TwoStops(damping=0.05), load=saltus.Load(frequency=1.0,"
        " force=saltus.Harmonic(amplitude=2.0)), impact=saltus.NewtonImpact(e=0.7)); x = {'x': 0.1}"
    ),
    "a belt with friction": (
        "s = saltus.System(model=saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.3),"
        " load=saltus.Load(frequency=1.3, force=saltus.Harmonic(amplitude=0.4))); x = {'x': 0.1}"
    ),
    "a structure with a stop": (
        "k = 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1); m = saltus.Structure(mass=np.eye(3),"
        " stiffness=k, damping=0.02 * k, contacts=[saltus.Contact(name='stop', coordinate=2,"
        " position=1.0, sign=-1)], forces={'push': 2}); s = saltus.System(model=m,"
        " load=saltus.Load(frequency=0.5, push=saltus.Harmonic(amplitude=0.6)),"
        " impact=saltus.NewtonImpact(e=0.7)); x = m.start(displacement=0.0)"
    ),
}  # fmt: skip
VERBS = {
    "motion": "saltus.simulate(s, **x, periods=20)",
    "orbit": "saltus.find_orbit(s, **x)",
    "lanes": "saltus.simulate_many(s, **{n: np.multiply.outer(v, np.ones(64)) for n, v in x.items()}, periods=20)",
    "motion again": "saltus.simulate(s, **x, periods=20)",
}


def seconds(code: str, cache: str) -> tuple[float, float]:
    """The processor time and the time by the clock of a process, with its children."""
    before, began = os.times(), time.perf_counter()
    subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"SALTUS_CACHE_DIR": cache}, check=True
    )
    after = os.times()
    used = after.children_user + after.children_system
    return used - before.children_user - before.children_system, time.perf_counter() - began


def main(wanted: list[str]) -> None:
    """Print a line for each model."""
    print(f"{'':26}" + "".join(f"{verb:>18}" for verb in VERBS))
    for name in wanted or MODELS:
        with tempfile.TemporaryDirectory() as cache:
            row = [seconds(f"{START}{MODELS[name]};{verb}", cache) for verb in VERBS.values()]
        print(
            f"{name:26}" + "".join(f"{used:9.1f} ({passed:5.1f})" for used, passed in row),
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
