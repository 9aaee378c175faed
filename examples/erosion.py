"""
How a basin is eroded
=====================

The motion near rest of a metainterface that is shaken harder and harder: how safe it is, by the
size of its basin and by the exact distance from the curve where the basin ends."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=2.4, horizontal=saltus.Harmonic(amplitude=1.0), vertical=-0.5),
)
GRID = np.linspace(-2.0, 2.0, 41)


def safety(amplitude):
    """The integrity of the basin of the smallest motion."""
    loaded = system.with_({"load.horizontal.amplitude": amplitude})
    found = saltus.find_attractors(loaded, window=((-2.0, 2.0), (-2.0, 2.0)), starts=32)
    basins = saltus.basins_of_attraction(
        loaded, theta=GRID, velocity=GRID, found=found, curves=True
    )
    smallest = saltus.basin_integrity(basins).isel(attractor=int(basins.amplitude.values.argmin()))
    return {
        name: float(smallest[name])
        for name in ("area", "distance", "factor", "distance_from_curve")
    }


amplitudes = [0.9, 1.1]
profile = saltus.map_over(safety, {"amplitude": amplitudes})
print(profile.to_dataframe().round(3))

figure, ax = plt.subplots(layout="constrained")
for name in ("area", "distance", "factor", "distance_from_curve"):
    ax.plot(profile.amplitude, profile[name] / profile[name][0], "o-", label=name.replace("_", " "))
ax.set(xlabel="amplitude $H$", ylabel="integrity, of that at the first value", ylim=(0, None))
ax.legend()

# The grid knows the distance to within a cell; that from the boundary curve is exact, and grid and
# curve agree.
difference = float(np.abs(profile.distance - profile.distance_from_curve).max())
print(
    f"{difference:.3f} between the distance on the grid and the exact one; a cell is "
    f"{np.hypot(0.1, 0.1):.3f} across"
)
assert difference < np.hypot(0.1, 0.1)
assert float(profile.distance_from_curve[1] / profile.distance_from_curve[0]) < 0.3
