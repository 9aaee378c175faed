"""
Chaos, and the sum of its exponents
===================================

A chaotic motion of the metainterface on its Poincare section. Without a loss at impact areas shrink
by the damping alone, so that the two Lyapunov exponents add up to -C: a check that no computed
exponent can pass by accident.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

C = 0.1
system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=C),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=1.76), vertical=-0.5),
)
section = saltus.simulate_many(system, theta=0.3, periods=4000, sample="state", last=3500)
exponents = saltus.lyapunov_spectrum(
    system, theta=float(section.theta), velocity=float(section.velocity), periods=2000
)
print(exponents)
print(f"their sum is {exponents.values.sum():.12f}, the law says {-C}")

figure, ax = plt.subplots()
ax.plot(section.sampled_theta, section.sampled_velocity, "k,")
ax.plot(section.sampled_theta, section.sampled_velocity, ".", markersize=1.5, markeredgewidth=0)
ax.set(
    xlabel=r"$\theta$ (rad)", ylabel=r"$\theta'$", title=r"once a forcing period, $\hat{H} = 1.76$"
)

assert exponents.values[0] - exponents.errors[0] > 0.0
assert abs(exponents.values.sum() + C) < 1e-8
