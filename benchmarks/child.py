"""What runs in a process of its own, because it may hang, because it must start cold, or because
its memory is measured.

python child.py first MODULE PEER [VARIANT]     the first motion of a peer after the interpreter has
started python child.py zeno MODULE PEER ENOUGH         an accumulation of impacts python child.py
grid N PERIODS TOL              N x N states by lanes on all cores
"""

from __future__ import annotations

import importlib
import json
import resource
import sys
import time
from typing import Any

import numpy as np


def find(module: str, name: str) -> Any:
    """A peer by its module and name."""
    return next(p for p in importlib.import_module(f"peers.{module}").PEERS if p.name == name)


def first(module: str, name: str, variant: str = "") -> dict[str, Any]:
    """Seconds for the first motion at 1e-10, after the imports; a variant of the system is for
    saltus only.
    """
    home = importlib.import_module(f"peers.{module}")
    if module.startswith("saltus"):  # what its first use imports
        import saltus

        if module == "saltus_lanes":
            import xarray  # noqa: F401
        getattr(saltus, "simulate_many" if module == "saltus_lanes" else "simulate")
    start = time.perf_counter()
    flow = home.flow_of(variant, 1e-10) if variant else find(module, name).setup(1e-10)
    theta, _ = flow(np.array([0.3]), np.array([0.0]))
    return {"theta": float(theta[0]), "after_imports": time.perf_counter() - start}


def zeno(module: str, name: str, enough: str) -> dict[str, Any]:
    """Where a peer is with the accumulation of impacts."""
    answer: dict[str, Any] = find(module, name).zeno(int(enough))
    return answer


def grid(n: str, periods: str, tol: str) -> dict[str, Any]:
    """Seconds and peak memory, after a small run that loads or compiles everything."""
    from peers.saltus_scalar import system

    import saltus

    def run(side: int) -> Any:
        theta, velocity = np.meshgrid(
            np.linspace(-1.5, 1.5, side), np.linspace(-1.5, 1.5, side), indexing="ij"
        )
        return saltus.simulate_many(
            system(),
            theta=theta.ravel(),
            velocity=velocity.ravel(),
            periods=int(periods),
            tol=float(tol),
        )

    run(4)
    before = peak()
    start = time.perf_counter()
    ends = run(int(n))
    seconds = time.perf_counter() - start
    rate = int(n) ** 2 * int(periods) / seconds
    finite = bool(np.isfinite(ends["theta"].values).all())
    return {"n": int(n), "periods": int(periods), "tol": float(tol), "seconds": seconds, "rate": rate, "finite": finite,
            "peak_before": before, "peak": peak(), "bytes_of_result": int(ends.nbytes)}  # fmt: skip


def peak() -> int:
    """The largest memory of this process so far, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
        1 if sys.platform == "darwin" else 1024
    )


if __name__ == "__main__":
    verb = {"first": first, "zeno": zeno, "grid": grid}[sys.argv[1]]
    print("answer", json.dumps(verb(*sys.argv[2:])))
