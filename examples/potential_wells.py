"""
Three wells: a tristable metainterface
======================================

Under a strong vertical load the metainterface has three stable states. Their potential has a corner
at theta = 0, equilibria where its slope vanishes, and motions that keep their energy to rounding.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80)), load=saltus.Load(vertical=-1.5)
)
states = theory.equilibria(system)
for state in states:
    print(f"theta = {state.theta:+.9f} rad, {state.stability}, energy {state.energy:.9f}")

theta = np.linspace(-1.7, 1.7, 801)
figure, ax = plt.subplots()
ax.plot(theta, theory.potential_energy(system, theta))
for state in states:
    ax.plot(state.theta, state.energy, "o", color="k", fillstyle="full" if state.stable else "none")
ax.set(xlabel=r"$\theta$ (rad)", ylabel="$P(\\theta)$ over $K_2$", title="full circles: stable")

motion = saltus.simulate(system, theta=1.6, velocity=0.6, duration=500.0)
before = theory.total_energy(system, 1.6, 0.6)
after = theory.total_energy(system, motion.theta, motion.velocity)
print(f"energy after {len(motion.impacts)} impacts: changed by {after - before:.0e}")

assert sum(state.stable for state in states) == 3
assert all(abs(theory.potential_slope(system, state.theta)) < 1e-12 for state in states)
assert abs(after - before) < 1e-11
