"""
A motion of the metainterface
=============================

The metainterface of the paper under load (i): a motion, its impacts, and what the mechanism says to
it."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(1.0),
)
motion = saltus.simulate(system, theta=0.3, periods=20)
theta, velocity = motion.at(np.linspace(0.0, motion.time, 1000))

print(motion)
print(
    f"{len(motion.impacts)} impacts, the fastest at "
    f"{np.abs(motion.impacts.velocity_before).max():.4f}"
)
print(f"limits of the mechanism: {motion.validity}")

figure, ax = plt.subplots()
ax.plot(theta, velocity, linewidth=0.8)
ax.set(xlabel=r"$\theta$ (rad)", ylabel=r"$\theta'$", title="20 forcing periods")

slower = system.with_({"load.frequency": 0.9})  # any number of a system, by its path
print(
    f"at Omega = 0.9 the end is theta = {saltus.simulate(slower, theta=0.3, periods=20).theta:.6f}"
)

# 40 digits of this end are known; tol=1e-12 gives more than twelve of them
assert abs(motion.theta + 0.235680595299311781821932031456) < 1e-12
