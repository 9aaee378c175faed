"""
A frequency swept up and down
=============================

An oscillator beside a wall, swept as on a shaker: the response jumps down at a fold on the way up,
and jumps up where the linear motion grazes the wall on the way down. Between the two there is
hysteresis."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

damping, force = 0.1, 0.2
oscillator = saltus.System(
    model=saltus.WallOscillator(damping=damping),
    load=saltus.Load(frequency=1.0, force=saltus.Harmonic(force)),
    impact=saltus.VelocityReduction(0.8),
)
sweep = saltus.frequency_sweep(oscillator, np.linspace(1.02, 1.5, 49), x=0.1)
for jump in range(sweep.sizes["jump"]):
    way, before, after = (
        sweep[f"jump_{name}"].values[jump] for name in ("direction", "before", "after")
    )
    print(f"{way}: a jump between {before:.6f} and {after:.6f}")

figure, ax = plt.subplots(layout="constrained")
saltus.plot(sweep, ax=ax)
w = np.linspace(1.02, 1.5, 400)
ax.plot(w, force / np.hypot(1 - w**2, damping * w), "k:", lw=1.0, zorder=1, label="linear")
ax.set_ylim(0.0, 1.6)
ax.legend()

# (1 - w^2)^2 + c^2 w^2 = F^2: the frequency at which the linear amplitude is that of the wall
grazing = np.sqrt(max(np.roots([1.0, damping**2 - 2.0, 1.0 - force**2])))
down = float(sweep.jump_after[sweep.jump_direction == "down"][0])
print(f"the linear motion grazes the wall at {grazing:.6f}")
assert abs(down - grazing) < 3e-5
