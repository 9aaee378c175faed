"""
A picture of basins to zoom into
================================

One pixel is one exact motion. A card follows the 16 million of 4000 x 4000 pixels in seconds, two
cores in minutes, so this picture has a hundredth of them: set ``SIDE`` to 4000 with a card."""

import time

import matplotlib.pyplot as plt
import numpy as np

import saltus

SIDE = 400  # pixels, a multiple of 10

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=2.4, horizontal=saltus.Harmonic(amplitude=1.0), vertical=-0.5),
)
found = saltus.find_attractors(system, window=((-2.0, 2.0), (-2.0, 2.0)))

grid = np.linspace(-2.0, 2.0, SIDE)
begun = time.perf_counter()
basins = saltus.basins_of_attraction(
    system, theta=grid, velocity=grid, found=found, tol=1e-9, device="auto"
)
taken = time.perf_counter() - begun
labels = basins.label.values
where = basins.attrs.get("device", "this processor")
print(f"{labels.size} motions in {taken:.1f} s on {where}: {labels.size / taken:.0f} a second")

# A motion does not depend on its neighbours: each tenth pixel alone gives the same picture.
coarse = saltus.basins_of_attraction(
    system, theta=grid[::10], velocity=grid[::10], found=found, tol=1e-9
)
assert (coarse.label.values == labels[::10, ::10]).all()

# One pixel a motion, to zoom: plt.imsave("basins.png", labels, cmap="viridis", origin="lower")
plt.imshow(labels, cmap="viridis", origin="lower", extent=(-2.0, 2.0, -2.0, 2.0))
for attractor in found:
    place = (attractor.label - labels.min()) / max(np.ptp(labels), 1)
    amplitude = f"amplitude {attractor.amplitude:.3f}"
    plt.plot([], [], "s", color=plt.colormaps["viridis"](place), label=amplitude)
plt.legend(loc="lower left", fontsize="small")
plt.gca().set(xlabel=r"$\theta$", ylabel=r"$\theta'$", title=f"{SIDE} x {SIDE} exact motions")
