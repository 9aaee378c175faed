"""
The square root beside a grazing
================================

A motion that just fails to touch a wall and one that just hits it part like the square root of what
lies between them. This is why multipliers have no limit at a grazing, and why no step of a smooth
method gets through it unharmed.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

# Free oscillation x = A cos(t) below a wall at x = 1: it touches for A = 1, and hits with the speed
# sqrt(A^2 - 1) beyond.
system = saltus.System(model=saltus.WallOscillator(wall=1.0), impact=saltus.VelocityReduction(0.5))
excess = 10.0 ** -np.arange(2.0, 11.0)
ends = saltus.simulate_many(system, x=-(1 + excess), velocity=0.0, duration=2 * np.pi, tol=1e-14)
# from the motion that touches, which comes back to x = -1
apart = np.hypot(ends.x - -1.0, ends.velocity)
order = np.polyfit(np.log(excess), np.log(apart), 1)[0]
print(f"distance after the impact ~ excess^{order:.4f}")

figure, ax = plt.subplots()
ax.loglog(excess, apart, "o-", label="exact motions")
ax.loglog(excess, 1.5 * np.sqrt(2 * excess), "k:", label=r"$(1+e)\sqrt{2(A-1)}$")
ax.set(xlabel="$A - 1$, how far the wall is hit", ylabel="distance from the motion that touches")
ax.legend()

assert (ends.impact_count == 1).all()
assert abs(order - 0.5) < 0.01
assert np.abs(apart / (1.5 * np.sqrt(2 * excess)) - 1)[-1] < 1e-4
