"""Both layers beside the reduced model where they move alike: processor time of a forcing period in
an ensemble, and its ratio.

    python benchmarks/two_layers.py

Ten thousand motions at Hhat = 0.1, below the load at which the closed layer opens, at tol 1e-12 on
one core, in turns.
"""

from __future__ import annotations

import numpy as np
from measure import interleave

import saltus

MOTIONS, PERIODS, ROUNDS = 10_000, 40, 5
BETA0 = np.deg2rad(80)
LOAD = saltus.Load(frequency=1.0, vertical=-0.5, ground_horizontal=saltus.Harmonic(amplitude=0.1))
MODELS = {
    model.__name__: model(beta0=BETA0, damping=0.1)
    for model in (saltus.Metainterface, saltus.TwoLayer)
}


def main() -> None:
    """Measure, and say whether the motions are the same."""
    theta, options = (
        np.random.default_rng(1).uniform(0.02, 0.12, MOTIONS),
        {"periods": PERIODS, "threads": 1},
    )
    starts = {
        "Metainterface": {"theta": theta},
        "TwoLayer": {"theta_1": theta, "theta_2": 0.0, "velocity": (0.0, 0.0)},
    }
    ends = {}

    def follow(name: str) -> None:
        system = saltus.System(model=MODELS[name], load=LOAD, impact=saltus.VelocityReduction(1.0))
        ends[name] = saltus.simulate_many(system, **starts[name], **options)

    timings = interleave(
        {name: lambda name=name: follow(name) for name in MODELS}, ROUNDS, one_core=True
    )
    each = {name: timing.per(MOTIONS * PERIODS).median for name, timing in timings.items()}
    apart = np.abs(
        ends["TwoLayer"].theta_1 + ends["TwoLayer"].theta_2 - ends["Metainterface"].theta
    ).max()
    print(", ".join(f"{name} {value:.3f} us a period" for name, value in each.items()))
    print(
        f"ratio {each['TwoLayer'] / each['Metainterface']:.2f}; the ends are {float(apart):.1e} "
        "apart"
    )


if __name__ == "__main__":
    main()
