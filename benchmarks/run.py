"""Speed of one trajectory at equal achieved error, side by side in one run: saltus, heyoka.py, SciPy.

The trajectory is load (i) of the paper at beta0 = 80 deg, C = 0.1, V = -0.5, H = 0.5, Omega = 1, from theta = 0.3 at rest,
over 20 forcing periods and 39 impacts; its end is known to 40 digits. The codes take turns, so that a machine whose speed
drifts slows them alike; medians and spreads over the rounds are written to benchmarks/results/.

    make bench            or            python benchmarks/run.py [rounds]
"""

from __future__ import annotations

import json
import math
import platform
import statistics
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import saltus

PERIODS = 20
BETA0, DAMPING, VERTICAL, AMPLITUDE = math.radians(80), 0.1, -0.5, 0.5
# 40 digits, two orders of an arbitrary-precision Taylor method agreeing
THETA, VELOCITY = -0.235680595299311781821932031456, -1.02103882791726021543767997137
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 1e-14)


def run_saltus(tol: float) -> tuple[float, float]:
    """The exact motion, without dense output as for the others."""
    system = saltus.System(
        model=saltus.Metainterface(beta0=BETA0, damping=DAMPING),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=AMPLITUDE), vertical=VERTICAL),
    )
    motion = saltus.simulate(system, theta=0.3, periods=PERIODS, tol=tol, dense=False)
    return motion.theta, motion.velocity


def run_scipy(tol: float) -> tuple[float, float]:
    """DOP853, restarted at every impact that its event location finds."""
    t, end, state, side = 0.0, PERIODS * 2 * math.pi, np.array([0.3, 0.0]), 1.0

    def slope(t: float, y: np.ndarray, side: float) -> tuple[float, float]:
        angle = side * y[0] + BETA0
        push = math.sin(angle) * AMPLITUDE * math.sin(t) + side * math.cos(angle) * VERTICAL
        return y[1], push - DAMPING * y[1] - y[0]

    def contact(t: float, y: np.ndarray, side: float) -> float:
        return float(y[0])

    contact.terminal = True  # type: ignore[attr-defined]
    while t < end:
        contact.direction = -side  # type: ignore[attr-defined]
        solution = solve_ivp(slope, (t, end), state, "DOP853", events=contact, args=(side,), rtol=max(tol, 3e-14), atol=tol)
        t, state = solution.t[-1], solution.y[:, -1].copy()
        if solution.status == 1:
            state[0], side = 0.0, -side
    return float(state[0]), float(state[1])


def heyoka_runner() -> Callable[[float], tuple[float, float]] | None:
    """heyoka.py's scalar integrator, one for each tolerance, with a terminal event; None where it is not installed."""
    try:
        import heyoka as hy
    except ImportError:
        return None
    x, v = hy.make_vars("x", "v")
    side = hy.par[0]
    angle = side * x + BETA0
    push = hy.sin(angle) * AMPLITUDE * hy.sin(hy.time) + side * hy.cos(angle) * VERTICAL
    made: dict[float, object] = {}

    def flip(integrator: object, sign: int) -> bool:
        integrator.pars[0] = -integrator.pars[0]  # type: ignore[attr-defined]
        return True

    def run(tol: float) -> tuple[float, float]:
        if tol not in made:
            event = hy.t_event(x, callback=flip)
            equations = [(x, v), (v, push - DAMPING * v - x)]
            made[tol] = hy.taylor_adaptive(equations, [0.3, 0.0], tol=tol, t_events=[event], pars=[1.0])
        integrator = made[tol]
        integrator.time = 0.0  # type: ignore[attr-defined]
        integrator.state[:] = [0.3, 0.0]  # type: ignore[attr-defined]
        integrator.pars[0] = 1.0  # type: ignore[attr-defined]
        integrator.reset_cooldowns()  # type: ignore[attr-defined]
        integrator.propagate_until(PERIODS * 2 * math.pi)  # type: ignore[attr-defined]
        return float(integrator.state[0]), float(integrator.state[1])  # type: ignore[attr-defined]

    return run


def measure(rounds: int) -> list[dict[str, object]]:
    """Every code at every tolerance, in turn, `rounds` times."""
    codes: dict[str, Callable[[float], tuple[float, float]]] = {"saltus": run_saltus, "SciPy DOP853": run_scipy}
    heyoka = heyoka_runner()
    if heyoka is not None:
        codes["heyoka.py"] = heyoka
    rows: dict[tuple[str, float], list[float]] = {}
    errors: dict[tuple[str, float], float] = {}
    for round_ in range(rounds + 1):  # the first one compiles and warms up
        for tol in TOLERANCES:
            for name, code in codes.items():
                repeats = 1 if name.startswith("SciPy") else 20
                start = time.perf_counter()
                for _ in range(repeats):
                    theta, velocity = code(tol)
                spent = (time.perf_counter() - start) / repeats / PERIODS * 1e6
                errors[name, tol] = max(abs(theta - THETA), abs(velocity - VELOCITY))
                if round_:
                    rows.setdefault((name, tol), []).append(spent)
    return [
        {
            "code": name,
            "tol": tol,
            "error": errors[name, tol],
            "median_us": statistics.median(t),
            "min_us": min(t),
            "max_us": max(t),
        }
        for (name, tol), t in rows.items()
    ]


def write(rows: list[dict[str, object]], rounds: int) -> Path:
    """The table as Markdown and JSON, with machine and versions."""
    folder = Path(__file__).parent / "results"
    folder.mkdir(exist_ok=True)
    packages = [p for p in ("saltus", "numba", "scipy", "heyoka") if p == "saltus" or _installed(p)]
    about = {"machine": platform.processor() or platform.machine(), "python": platform.python_version(), "rounds": rounds}
    about |= {p: version(p) for p in packages}
    (folder / "scalar.json").write_text(json.dumps({"about": about, "rows": rows}, indent=1))
    lines = ["# One trajectory, 20 forcing periods, 39 impacts", "", ", ".join(f"{k} {v}" for k, v in about.items()), ""]
    lines += ["| code | tol | error after 20 periods | us a period: median (min to max) |", "|---|---|---|---|"]
    for row in rows:
        spread = f"{row['median_us']:.1f} ({row['min_us']:.1f} to {row['max_us']:.1f})"
        lines.append(f"| {row['code']} | {row['tol']:.0e} | {row['error']:.1e} | {spread} |")
    path = folder / "scalar.md"
    path.write_text("\n".join(lines) + "\n")
    return path


def _installed(package: str) -> bool:
    try:
        version(package)
    except ImportError:
        return False
    return True


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    path = write(measure(count), count)
    print(path.read_text())
    print(f"written to {path} and {path.with_suffix('.json')}")
