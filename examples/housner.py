"""
How a rocking block decays
==========================

Each impact keeps the share r of the energy. For a slender block Housner (1963) gives the largest
tilt after n impacts, phi_n = 1 - sqrt(1 - r^n (1 - (1 - phi_0)^2)) with phi = theta / alpha.
"""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

import saltus

alpha, start, r = 0.01, 0.8, 0.8
block = saltus.System(model=saltus.RockingBlock(alpha=alpha), impact=saltus.EnergyRestitution(r=r))
motion = saltus.simulate(block, theta=start * alpha, duration=30.0)

impacts = motion.impacts.time
times = np.linspace(0.0, float(impacts[12]), 6001)
tilt = np.abs(motion.at(times)[0]) / alpha
peaks = np.array([tilt[(times > a) & (times < b)].max() for a, b in pairwise(impacts[:12])])
law = 1 - np.sqrt(1 - r ** np.arange(1, 12) * (1 - (1 - start) ** 2))
print("tilts after each impact:", peaks.round(4))
print("Housner's formula:      ", law.round(4))

figure, ax = plt.subplots()
ax.plot(times, motion.at(times)[0] / alpha)
ax.plot(
    0.5 * (impacts[:11] + impacts[1:12]),
    law * np.sign(motion.at(0.5 * (impacts[:11] + impacts[1:12]))[0]),
    "ko",
)
ax.set(xlabel=r"time $p\,t$", ylabel=r"$\theta/\alpha$", title="dots: Housner's formula")

assert np.abs(peaks - law).max() < 1e-4  # the formula's own error is of the order of alpha^2
