"""What a card gains: throughput, a chart and a basin, beside the lanes of the same machine.

    python benchmarks/card.py            # on a machine with a card, under four minutes
    python benchmarks/card.py --small    # a thousandth of the work, to try the script

Agreement with the lanes is a test: `python -m pytest -m gpu tests/flow/test_cuda.py`.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import saltus

PERIODS = 100


def metainterface(e: float = 1.0) -> saltus.System:
    """The metainterface of the README."""
    return saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
        impact=saltus.VelocityReduction(e),
    )


def grid(side: int) -> dict[str, np.ndarray]:
    """Initial states, side x side."""
    theta, velocity = np.meshgrid(np.linspace(-1.0, 1.0, side), np.linspace(-0.5, 0.5, side))
    return {"theta": theta, "velocity": velocity}


def measured(what: str, device: str, **arguments: object) -> None:
    """Print how many forcing periods are followed in a second, copies included, best of two."""
    system = arguments.pop("system", None) or metainterface()
    best = np.inf
    for _ in range(2):
        begin = time.perf_counter()
        ends = saltus.simulate_many(system, sample=(), device=device, **arguments)
        best = min(best, time.perf_counter() - begin)
    done = float(ends.periods.sum())
    name = ends.attrs.get("device", "this processor")
    print(
        f"{what}: {best:.3f} s, {done / best / 1e6:.1f} million periods a second, {name}",
        flush=True,
    )


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    shrunk = 30 if given.small else 1
    for tol in (1e-6, 1e-9, 1e-12):
        for side in (100, 316, 1000):
            states = grid(max(4, side // shrunk))
            measured(
                f"{side**2} motions, tol {tol:g}", given.device, periods=PERIODS, tol=tol, **states
            )
    measured("10^4 motions", "cpu", periods=PERIODS, **grid(max(4, 100 // shrunk)))
    amplitude, vertical = np.meshgrid(
        np.linspace(0.0, 1.5, 1000 // shrunk), np.linspace(-2.0, -0.2, 1000 // shrunk)
    )
    columns = {"load.horizontal.amplitude": amplitude, "load.vertical": vertical}
    chart = {"parameters": columns, "theta": 0.3, "until": ("rest",), "periods": PERIODS}
    measured("a chart of 10^6 cells", given.device, system=metainterface(0.9), **chart)
    measured("a basin of 4000 x 4000", given.device, periods=50, **grid(4000 // shrunk))


if __name__ == "__main__":
    main()
