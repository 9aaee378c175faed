"""What a card gains: throughput, a chart, a basin and the fragility of a block, beside the lanes of
the same machine; first whether both agree.

    python benchmarks/card.py            # on a machine with a card, some five minutes
    python benchmarks/card.py --small    # a thousandth of the work, to try the script

Agreement of more models is a test: `python -m pytest -m gpu tests/flow/test_cuda.py`.
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


def agreement(device: str) -> None:
    """Print how far the ends of motions are from those of the lanes, and whether counts differ."""
    many = {"periods": 20, "sample": (), **grid(30)}
    here = saltus.simulate_many(metainterface(0.9), **many)
    there = saltus.simulate_many(metainterface(0.9), device=device, **many)
    apart = max(float(abs(here[name] - there[name]).max()) for name in ("theta", "velocity"))
    counts = int((here.impact_count != there.impact_count).sum())
    print(f"900 motions: apart by {apart:.1e}, {counts} counts of impacts differ", flush=True)


def shaken_blocks(device: str, count: int) -> None:
    """Print the time for blocks under a record, each with its own scale and slenderness."""
    time_of = np.linspace(0.0, 20.0, 1001)
    shaking = np.random.default_rng(1).normal(size=time_of.size) * np.exp(-((time_of / 8 - 1) ** 2))
    record = saltus.Record(time_of, shaking, quantity="acceleration")
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.2), load=saltus.Load(ground_horizontal=record)
    )
    rng = np.random.default_rng(2)
    columns = {
        "model.alpha": rng.uniform(0.1, 0.3, count),
        "load.ground_horizontal.scale": rng.uniform(0.1, 1.0, count),
    }
    begin = time.perf_counter()
    ends = saltus.simulate_many(
        block, theta=0.0, parameters=columns, duration=25.0, sample=(), device=device
    )
    taken = time.perf_counter() - begin
    names = list(ends.stop.attrs["flag_meanings"].split())
    fallen = float((ends.stop == names.index("limit")).mean())
    print(f"{count} blocks under a record: {taken:.3f} s, {fallen:.1%} overturn", flush=True)


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    shrunk = 30 if given.small else 1
    agreement(given.device)
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
    shaken_blocks(given.device, 10**5 // shrunk)
    # A call takes ten million motions at most.
    measured("a basin of 3000 x 3000", given.device, periods=50, **grid(3000 // shrunk))


if __name__ == "__main__":
    main()
