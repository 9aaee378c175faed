"""
Both layers as they move
========================

Both layers as they really move: how far the reduced model, whose other layer never opens, is from
them.

Under Omega = 1, V = -0.5, C = 0.1 the reduced motion is exact for small loads. At H = 0.2 the
closed layer opens for a moment before each crossing, so that the impact law never acts, and the
steady amplitude is 0.5694 in place of 0.5856.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

BETA0, PERIODS = np.deg2rad(80), 60


def load(amplitude: float) -> saltus.Load:
    return saltus.Load(
        frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=amplitude)
    )


def steady(motion: saltus.Motion) -> float:
    """The largest angle of any layer in the last forcing period."""
    last = np.linspace(motion.time - 2 * np.pi, motion.time, 2001)
    return float(np.abs(motion.at(last)[0]).max())


def reduced(amplitude: float) -> float:
    system = saltus.System(
        model=saltus.Metainterface(beta0=BETA0, damping=0.1), load=load(amplitude)
    )
    return steady(saltus.simulate(system, theta=0.1, periods=PERIODS))


def both(amplitude: float) -> saltus.Motion:
    system = saltus.System(model=saltus.TwoLayer(beta0=BETA0, damping=0.1), load=load(amplitude))
    return saltus.simulate(system, theta=(0.1, 0.0), periods=PERIODS)


for amplitude in (0.1, 0.2, 0.5):
    motion = both(amplitude)
    opened = sum(event.kind == "release" for event in motion.events)
    print(
        f"H = {amplitude}: {steady(motion):.4f} with both layers, {reduced(amplitude):.4f} "
        f"reduced, {opened} releases"
    )

figure, ax = plt.subplots()
motion = both(0.5)
times = np.linspace(motion.time - 4 * np.pi, motion.time, 3000)
for angle, name in zip(
    motion.at(times)[0], (r"$\theta_1$, lower", r"$\theta_2$, upper"), strict=True
):
    ax.plot(times, angle, label=name)
ax.set(xlabel=r"$\tau$", ylabel="angle (rad)", title="both layers at $H = 0.5$")
ax.legend()

assert abs(steady(both(0.2)) - 0.5694) < 1e-4
assert abs(reduced(0.2) - 0.5856) < 1e-4
assert abs(steady(both(0.5)) - 1.0161) < 1e-4
assert abs(steady(both(0.1)) - reduced(0.1)) < 1e-9
