"""
A measured load
===============

A record of samples as the load of an oscillator: between its samples it is linear, so that the exact motion of a linear
oscillator follows from SciPy's first-order hold, which is exact for such inputs.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import cont2discrete, dlsim

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

matrices = [np.array(m) for m in ([[0.0, 1.0], [-1.0, -damping]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])]
_, reference, _ = dlsim(cont2discrete(matrices, step, method="foh"), force, t=time)
print(f"largest difference from the first-order hold: {np.abs(x - reference[:, 0]).max():.0e}")

figure, (above, below) = plt.subplots(2, sharex=True)
above.plot(time, force, linewidth=0.8)
above.set(ylabel="record")
below.plot(time, x)
below.set(xlabel="time", ylabel="$x$")

assert np.abs(x - reference[:, 0]).max() < 1e-11
