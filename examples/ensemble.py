"""
A chart of lift-off from an ensemble
====================================

A chart of the metainterface at rest: which forces H sin(tau) lift it off under which vertical
forces V.

The theory knows the border: rest lasts while H sin(beta0) <= abs(V) cos(beta0),
`critical_horizontal`. What follows beyond it is only known by computing it; here, how many impacts
a forcing period has at the end.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import saltus
from saltus import theory

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.0), vertical=-0.5),
    impact=saltus.VelocityReduction(0.8),
)
H = xr.DataArray(np.linspace(0.0, 0.2, 81), dims="H")
V = xr.DataArray(-np.linspace(0.2, 1.0, 17), dims="V")
chart = saltus.simulate_many(
    system,
    theta=0.0,
    velocity=0.0,
    parameters={"load.horizontal.amplitude": H, "load.vertical": V},
    periods=100,
    sample="impact_count",
    until=("rest", "settled"),
).assign_coords(H=H, V=V)

names = chart.stop.attrs["flag_meanings"].split()
for code, count in zip(*np.unique(chart.stop, return_counts=True), strict=True):
    print(f"{count:5d} of {chart.stop.size} ended as {names[code]}")
periods = np.unique(chart.recurrence_period.values[chart.recurrence_period.values > 0])
print(f"motions that repeat themselves do so every {', '.join(map(str, periods))} forcing periods")
print(f"impacts in the last forcing period: at most {int(chart.period_impact_count.max())}")

figure, ax = plt.subplots()
mesh = ax.pcolormesh(H, V, chart.impact_count.T / chart.periods.T)
figure.colorbar(mesh, label="impacts in a forcing period")
ax.plot(theory.critical_horizontal(np.deg2rad(80), V.values), V, "w--", label=r"$\hat{H}_{cr}$")
ax.set(xlabel=r"$\hat{H}$", ylabel="$V$", xlim=(0, 0.2))
ax.legend(facecolor="0.4", labelcolor="w")

border = H.where(chart.impact_count > 0).min("H")  # the least force that lifts it off, for each V
excess = border - theory.critical_horizontal(np.deg2rad(80), chart.V)
assert float(excess.min()) >= 0.0
assert float(excess.max()) <= float(H[1] - H[0])
