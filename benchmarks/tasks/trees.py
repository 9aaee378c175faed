"""What `against.py` measures, by functions that stand in both trees; run as a script it computes
the tasks that it reads.

Every line of its input names a task, and its answer is the processor time in seconds, of all
threads.
"""

from __future__ import annotations

import gc
import json
import math
import sys
import time
from collections.abc import Callable
from functools import cache
from typing import Any

BETA0, AMPLITUDE = math.radians(80), "load.horizontal.amplitude"
SYSTEM = (
    "import math, saltus, numpy as np; model = saltus.Metainterface(beta0=math.radians(80),"
    " damping=0.1);load = saltus.Load(frequency=1.0, vertical=-0.5,"
    " horizontal=saltus.Harmonic(amplitude=0.5));system = saltus.System(model=model, load=load);"
)
MOTION = "saltus.simulate(system, theta=0.3, periods=20)"
CHART = (
    "axes = {'horizontal': np.linspace(0.05, 1.5, 21), 'vertical': np.linspace(-0.9, 0.9, 21)};"
    "saltus.stability_chart(system, **axes, starts=4, workers=1)"
)
PROCESSES = {  # what the interpreter is given, in a process of its own
    "import saltus": ["-c", "import saltus"],
    "saltus --help": ["-m", "saltus", "--help"],
    "the first motion of a process": ["-c", SYSTEM + MOTION],
    "a chart of 21 x 21": ["-c", SYSTEM + CHART],  # its cells are computed in a process besides
}


@cache
def system(amplitude: float = 0.5, **impact: float) -> Any:
    """The paper's system under load (i)."""
    import saltus

    load = saltus.Load(
        frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=amplitude)
    )
    law = {"impact": saltus.VelocityReduction(**impact)} if impact else {}
    return saltus.System(model=saltus.Metainterface(beta0=BETA0, damping=0.1), load=load, **law)


@cache
def layers() -> Any:
    """Both layers with a restitution."""
    import saltus

    model = saltus.TwoLayer(beta0=BETA0, damping=0.1, mass_ratio=0.2)
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.4))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.5))


@cache
def stops() -> Any:
    """A mass between two stops."""
    import saltus

    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=2.0))
    return saltus.System(
        model=saltus.TwoStops(damping=0.05), load=load, impact=saltus.NewtonImpact(e=0.7)
    )


@cache
def belt() -> Any:
    """A mass on a belt, which sticks and slides, under a force."""
    import saltus

    load = saltus.Load(frequency=1.3, force=saltus.Harmonic(amplitude=0.4))
    return saltus.System(
        model=saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.3), load=load
    )


@cache
def orbit() -> Any:
    """Where the branch begins."""
    import saltus

    return saltus.find_orbit(system(), theta=0.3)


@cache
def orbit_of_layers() -> Any:
    """Where the branch of both layers begins."""
    import saltus

    return saltus.find_orbit(layers(), theta_1=0.1, theta_2=0.0)


def short_motions() -> None:
    """Sixty motions of 20 periods with their polynomials."""
    import saltus

    for n in range(60):
        saltus.simulate(system(), theta=0.3 + 0.01 * n, periods=20)


def long_motion() -> None:
    """Ten motions of 1000 periods."""
    import saltus

    for n in range(10):
        saltus.simulate(system(), theta=0.3 + 0.01 * n, periods=1000, dense=False)


def lanes() -> None:
    """4096 motions of 20 periods, of which the ends are kept."""
    import numpy as np

    import saltus

    theta = np.linspace(-1.0, 1.0, 4096)
    saltus.simulate_many(system(), theta=theta, velocity=0.1, periods=20, sample=(), threads=1)


def found_orbits() -> None:
    """Ten orbits from motions."""
    import saltus

    for n in range(10):
        saltus.find_orbit(system(), theta=0.3 + 0.01 * n)


def branch() -> None:
    """A branch over the amplitude, without the search of its start."""
    import saltus

    saltus.continue_orbit(orbit(), AMPLITUDE, (0.1, 1.2))


def branch_of_layers() -> None:
    """A branch of orbits of several contacts."""
    import saltus

    saltus.continue_orbit(orbit_of_layers(), AMPLITUDE, (0.38, 0.42))


def both_layers() -> None:
    """Motions of both layers over 200 periods."""
    import saltus

    for n in range(5):
        saltus.simulate(
            layers(),
            theta_1=0.1 + 0.01 * n,
            theta_2=-0.05,
            velocity=(0.0, 0.0),
            periods=200,
            dense=False,
        )


def two_stops() -> None:
    """Motions between two stops over 200 periods."""
    import saltus

    for n in range(5):
        saltus.simulate(stops(), x=0.1 + 0.01 * n, periods=200, dense=False)


def on_a_belt() -> None:
    """Motions on a belt over 200 periods."""
    import saltus

    for n in range(5):
        saltus.simulate(belt(), x=0.1 + 0.01 * n, periods=200, dense=False)


def lanes_of_layers() -> None:
    """128 motions of both layers over 20 periods."""
    import numpy as np

    import saltus

    theta = np.linspace(0.02, 0.3, 128)
    saltus.simulate_many(
        layers(),
        theta_1=theta,
        theta_2=-0.05,
        velocity=(0.0, 0.0),
        periods=20,
        sample=(),
        threads=1,
    )


def sensitivities() -> None:
    """Motions between two stops with their derivatives to state and force."""
    import saltus

    for n in range(10):
        saltus.sensitivities(
            stops(), x=0.1 + 0.01 * n, periods=100, parameters=("load.force.amplitude",)
        )


TASKS: dict[str, Callable[[], None]] = {
    "60 motions of 20 periods": short_motions,
    "10 motions of 1000 periods": long_motion,
    "lanes, 4096 motions": lanes,
    "10 orbits": found_orbits,
    "a branch": branch,
    "a branch of both layers": branch_of_layers,
    "both layers": both_layers,
    "two stops": two_stops,
    "a belt with friction": on_a_belt,
    "lanes of both layers, 128 motions": lanes_of_layers,
    "two stops with sensitivities": sensitivities,
}


def answer() -> None:
    """Compute each task that is asked for."""
    for line in sys.stdin:
        gc.collect()
        start = time.process_time()
        TASKS[line.strip()]()
        print(json.dumps(time.process_time() - start), flush=True)


if __name__ == "__main__":
    import saltus

    if not str(saltus.__file__).startswith(sys.argv[1]):
        raise SystemExit(f"this is another tree: {saltus.__file__}")
    answer()
