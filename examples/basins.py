"""
Three attractors, their basins and the curves between
=====================================================

Where motions of the metainterface end: three attractors under one load, their basins, and the
curves that part them."""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import basins_of_attraction, find_attractors, stable_manifold
from saltus.attractors import uncertainty_exponent
from saltus.plots import draw_basins

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=2.4, horizontal=saltus.Harmonic(amplitude=1.0), vertical=-0.5),
)
found = find_attractors(system, window=((-2.0, 2.0), (-2.0, 2.0)))
print(found)

grid = np.linspace(-2.0, 2.0, 101)
picture = basins_of_attraction(system, theta=grid, velocity=grid, found=found)
exponent = uncertainty_exponent(picture.label)
print(
    f"boundary of dimension {exponent.dimension:.2f} +- {exponent.error:.2f}, as far as this "
    "grid shows it"
)

# The saddle orbits: the states that the flow takes to them, computed by the exact backward flow,
# are where the basins meet.
branch = saltus.continue_orbit(found.of(3).orbit, "load.frequency", (2.1, 3.2))
saddles = [orbit for orbit in branch.at(2.4) if not orbit.stable]
curves = [stable_manifold(saddle, window=((-2.0, 2.0), (-2.0, 2.0))) for saddle in saddles]
draw_basins(picture, [curve.states for curve in curves], ax=plt.gca())

labels = picture.label.values
rows, columns = np.nonzero(labels[:, 1:] != labels[:, :-1])
edge = np.stack([0.5 * (grid[columns] + grid[columns + 1]), grid[rows]], axis=1)
states = np.concatenate([curve.states for curve in curves])
states = states[np.isfinite(states).all(axis=1)]
distance = np.array([np.abs(states - point).max(axis=1).min() for point in edge])
print(
    f"{len(edge)} edges between cells lie within {distance.max() / (grid[1] - grid[0]):.2f} "
    "cells of the manifolds"
)
assert distance.max() < grid[1] - grid[0]
