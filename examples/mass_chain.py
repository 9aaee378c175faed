"""
Ten masses in a row and a stop
==============================

A chain of ten masses from its matrices M, C, K; the last one may hit a stop. Without the stop the
motion is that of the matrix exponential; with it the forced motion is periodic, with an impact in
each period.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm

import saltus

COUNT = 10
K = 2 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1)


class Chain(saltus.ContactModel):
    coordinates = tuple(f"x{i}" for i in range(1, COUNT + 1))
    channels = ("force",)
    contacts = (saltus.Contact(name="stop", coordinate=f"x{COUNT}", sign=-1, position=0.2),)

    def force(self, t, x, velocity, load):
        push = [load.force(t), *[0.0] * (COUNT - 1)]
        return tuple(push - 0.05 * K @ np.array(velocity) - K @ np.array(x))


rest = dict.fromkeys(Chain.coordinates, 0.0) | {"velocity": (0.0,) * COUNT}
# too short to reach the stop
free = saltus.simulate(saltus.System(model=Chain()), **{**rest, "x1": 0.1}, duration=5.0)
rates = np.block([[np.zeros((COUNT, COUNT)), np.eye(COUNT)], [-K, -0.05 * K]])
error = np.abs(free.final_state - expm(5.0 * rates) @ (0.1 * np.eye(2 * COUNT)[0])).max()
load = saltus.Load(frequency=0.28, force=saltus.Harmonic(amplitude=0.05))
motion = saltus.simulate(
    saltus.System(model=Chain(), load=load, impact=saltus.NewtonImpact(e=0.6)), **rest, periods=100
)
times = np.linspace(motion.time - 60.0, motion.time, 1500)
plt.plot(times, np.transpose(motion.at(times)[0])[:, -1])
plt.gca().set(xlabel=r"time $\tau$", ylabel="$x_{10}$, stop at 0.2")
print(f"error without impacts {error:.0e}; {len(motion.events)} events in 100 periods")
assert error < 1e-12
assert len(motion.events) >= 50
