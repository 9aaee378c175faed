"""
Period doublings and Feigenbaum's constant
==========================================

The symmetric motion of the metainterface loses its symmetry, then doubles its period again and
again. Each doubling is solved for on the exact equations; the ratios of their distances tend to
4.669...
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import doubling_cascade
from saltus.orbits import switch_branch

FEIGENBAUM = 4.669201609
system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=1.0), vertical=-0.5),
)
path = "load.horizontal.amplitude"
main = saltus.continue_orbit(saltus.find_orbit(system, theta=0.3), path, (0.5, 2.0))
one, _ = switch_branch(next(point for point in main.special if point.kind == "BPC"), (0.5, 2.0))
first = next(point for point in one.special if point.kind == "PD")
cascade = doubling_cascade(first, (1.6, 1.8), max_period=32)
for period, place in zip(2 ** np.arange(1, 9), cascade.parameters, strict=False):
    print(f"period {period // 2:2} doubles at H = {place:.9f}")
print("ratios of the distances:", cascade.ratios.round(3))

figure, ax = plt.subplots()
ax.plot(main.parameters, main.amplitudes, "0.6", label="symmetric")
ax.plot(one.parameters, one.amplitudes, label="unsymmetric, period 1")
for place in cascade.parameters:
    ax.axvline(place, color="tab:red", linewidth=0.7)
ax.set(
    xlabel=r"amplitude $\hat{H}$ of the load",
    ylabel=r"amplitude of $\theta$ (rad)",
    xlim=(1.4, 1.8),
    title="lines: doublings",
)
ax.legend()

assert abs(cascade.ratios[-1] - FEIGENBAUM) < 0.05
assert np.all(np.diff(np.abs(cascade.ratios - FEIGENBAUM)) < 0)
