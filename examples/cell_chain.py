"""
A chain of four cells
=====================

Four cells in a row, of which the first is let go: how its motion reaches the last one through the
springs between them."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

model = saltus.CellChain(beta0=np.deg2rad(80), cells=4, coupling=0.5, mass_ratio=0.2, damping=0.05)
system = saltus.System(
    model=model, load=saltus.Load(vertical=-0.1), impact=saltus.NewtonImpact(e=0.3)
)
start = dict.fromkeys(model.coordinates, 0.0) | {"lower_1": 0.5}
motion = saltus.simulate(system, **start, velocity=(0.0,) * 8, duration=60)

times = np.linspace(0.0, motion.time, 6001)
# of the layer that is open wider
opening = np.abs(motion.at(times)[0]).reshape(4, 2, -1).max(axis=1)
for cell, theta in enumerate(opening, 1):
    first, widest = times[np.argmax(theta > 1e-9)], times[theta.argmax()]
    print(f"cell {cell}: opens first at {first:.2f}, widest by {theta.max():.3f} at {widest:.2f}")
print(f"{len(motion.impacts)} impacts; {motion.stop} from {motion.rest_time:.3f}")

figure, ax = plt.subplots()
for cell in range(4):
    theta = np.abs(motion.at(times)[0]).reshape(4, 2, -1)[cell].max(axis=0)
    ax.plot(times, theta + 0.6 * cell, label=f"cell {cell + 1}")
ax.set(xlabel="time", ylabel="opening of the cells, one above another")
ax.legend(loc="center right")

# each cell is widest open after the one before it
assert (np.diff(opening.argmax(axis=1)) > 0).all()
assert len(motion.closed) == 8
