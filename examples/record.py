"""
A measured load
===============

A record of samples as the load of an oscillator: between its samples it is linear, so that the
exact motion of a linear oscillator follows from SciPy's `lsim`, whose matrix exponential is exact
for such inputs.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import lsim

import saltus

step, damping = 0.05, 0.1
time = np.arange(0.0, 20.0, step)
force = np.random.default_rng(1).normal(size=time.size) * np.exp(-(((time - 6) / 3) ** 2))
system = saltus.System(
    model=saltus.WallOscillator(damping=damping, wall=100.0),  # a wall that it never reaches
    load=saltus.Load(force=saltus.Record(time, force)),
)
motion = saltus.simulate(system, x=0.0, duration=float(time[-1]))
x, velocity = motion.at(np.minimum(time, motion.time))

matrices = ([[0.0, 1.0], [-1.0, -damping]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
_, reference, _ = lsim(matrices, force, time)
print(f"largest difference from the matrix exponential: {np.abs(x - reference).max():.0e}")

figure, (above, below) = plt.subplots(2, sharex=True)
above.plot(time, force, linewidth=0.8)
above.set(ylabel="record")
below.plot(time, x)
below.set(xlabel="time", ylabel="$x$")

assert np.abs(x - reference).max() < 1e-11
