"""
The period of a rocking block
=============================

A free rigid block without losses rocks the more slowly the farther it tilts: its exact period is an
elliptic integral, and Housner's formula for slender blocks, 4 arccosh(1 / (1 - theta0 / alpha)), is
near to it. Here the exact motion is timed instead.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

alpha = 0.25
# nothing is lost
block = saltus.System(model=saltus.RockingBlock(alpha=alpha), impact=saltus.VelocityReduction(1.0))
tilts = alpha * np.array([0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
periods = []
for tilt in tilts:
    motion = saltus.simulate(block, theta=float(tilt), duration=60.0, tol=1e-14)
    # two impacts a period, one on each corner
    periods.append(motion.impacts.time[2] - motion.impacts.time[0])

exact = theory.rocking_period(tilts, alpha=alpha)
print("largest error of the timed periods:", f"{np.abs(periods / exact - 1).max():.0e}")

fine = alpha * np.linspace(0.01, 0.995, 300)
figure, ax = plt.subplots()
ax.plot(fine / alpha, theory.rocking_period(fine, alpha=alpha), label="elliptic integral")
ax.plot(
    fine / alpha,
    theory.slender_rocking_period(fine, alpha=alpha),
    "--",
    label="slender block (Housner)",
)
ax.plot(tilts / alpha, periods, "ko", label="exact motions")
ax.set(xlabel=r"amplitude $\theta_0/\alpha$", ylabel=r"period $p\,T_0$")
ax.legend()

assert np.abs(periods / exact - 1).max() < 1e-11
