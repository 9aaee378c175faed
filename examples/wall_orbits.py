"""
The impact oscillator and its closed form
=========================================

Orbits of a linear oscillator that hits a wall once a period are known in closed form: the amplitude
of the load as a function of the impact's speed. The exact motion that begins on such an orbit knows
nothing of it, and comes back to where it began.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

system = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=2.6, force=saltus.Harmonic(amplitude=8.0)),
    impact=saltus.VelocityReduction(0.8),
)
family = theory.wall_orbits(system)
speed = max(family.speeds(8.0))
orbit = family.orbit(speed)
phase = orbit.impact_time + 0.5
x, velocity = orbit.state(phase)
motion = saltus.simulate(system, x=x, velocity=velocity, time=phase, periods=1, tol=1e-14)
print(f"closed form: one impact a period with the speed {speed:.12f}")
print(
    f"simulation:  {motion.impacts.velocity_before[0]:.12f}, back at its start to "
    f"{abs(motion.x - x):.0e}"
)

speeds = np.linspace(0.0, 2 * speed, 400)
figure, ax = plt.subplots()
ax.plot([family.amplitude(v) for v in speeds], speeds)
ax.plot(8.0, motion.impacts.velocity_before[0], "ko", label="exact motion")
ax.set(xlabel="amplitude $A$ of the load", ylabel="speed of the impact")
ax.legend()

assert len(motion.impacts) == 1
assert abs(motion.impacts.velocity_before[0] - speed) < 1e-11
assert abs(motion.x - x) < 1e-10
