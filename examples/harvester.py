"""
Power of a harvester on a shaker
================================

A mass between two stops on a shaken base; its dashpot stands for the coil that takes power. Swept up and down, the mean power
c v^2 between the jumps is that of the upper or of the lower motion, and without an impact that of the linear oscillator.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

damping, shake = 0.05, 0.06
system = saltus.System(
    model=saltus.TwoStops(damping=damping, left=-1.0, right=1.0),
    load=saltus.Load(frequency=0.9, ground=saltus.Harmonic(amplitude=shake)),
    impact=saltus.NewtonImpact(e=0.7),
)


def power(motion):
    """The mean of c v^2 over one forcing period."""
    times = np.linspace(motion.time - 2 * np.pi / motion.system.load.frequency, motion.time, 2001)
    return damping * np.trapezoid(motion.at(times)[1] ** 2, times) / (times[-1] - times[0])


values = np.linspace(0.85, 1.5, 40)
sweep = saltus.frequency_sweep(system, values, x=0.0, functions={"power": power})
up, down = sweep.power.values
_, ax = plt.subplots()
ax.plot(values, up, label="up")
ax.plot(values, down, "--", label="down")
ax.set(xlabel=r"frequency $\Omega$", ylabel="mean power in the dashpot")
ax.legend()
amplitude = shake * values**2 / np.hypot(1 - values**2, damping * values)  # of the linear motion relative to the base
linear = sweep.impact_count.values[0] == 0
print(f"{linear.sum()} values without impacts; power up to {np.nanmax(up):.4f} upward, {np.nanmax(down):.4f} downward")
assert np.abs(up - damping * (values * amplitude) ** 2 / 2)[linear].max() < 1e-6
assert np.nanmax(up) > 1.2 * np.nanmax(down)
