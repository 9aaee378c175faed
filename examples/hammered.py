"""
Pulses on an impact oscillator
==============================

A mass before a wall is pushed for a quarter of each forcing period, and pulled back for the rest.
On its branch an impact comes to the jump of the load, where the map over a period gets other
derivatives (SW), and the branch goes on.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

pulses = saltus.Table(times=[0.0, 1.0, 1.0, 4.0], values=[0.8, 0.8, -0.8, -0.8])
system = saltus.System(
    model=saltus.WallOscillator(damping=0.1, wall=0.3),
    load=saltus.Load(frequency=1.55, force=pulses),
    impact=saltus.VelocityReduction(0.7),
)
orbit = saltus.find_orbit(system, x=0.0)
branch = saltus.continue_orbit(orbit, "load.frequency", (1.2, 1.67))
print(branch)
saltus.plot(branch, ax=plt.gca())

(jump,) = [point for point in branch.special if point.kind == "SW"]
(impact,) = jump.orbit.motion().events
share = impact.time * jump.parameter / (2 * np.pi) % 1.0
print(f"at the frequency {jump.parameter:.6f} the impact is at {share:.6f} of the period")
assert abs(share - 0.25) < 1e-9
