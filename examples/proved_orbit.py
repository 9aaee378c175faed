"""
An orbit that is proved
=======================

A ball bounces once a period on a shaken table. Interval arithmetic proves that this orbit exists, is
alone near its place, meets the table only at its impacts, and is stable. The right picture shows how
narrow the enclosure of its impact is; the closed form lies inside.
"""

import math

import matplotlib.pyplot as plt

import saltus

# In units with g = W = 1 the ball leaves the table with the speed pi, and meets it with the relative
# speed 2 pi / (1 + e), which the table's own speed a cos(t) must make up for.
e, a = 0.5, 1.2
system = saltus.System(
    model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
    load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=a)),
    impact=saltus.VelocityReduction(e),
)
orbit = saltus.find_orbit(system, x=-1.0, velocity=-3.0)
proof = saltus.prove(orbit, step=1.0, order=24)
print(proof.statement)

figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.6), layout="constrained")
saltus.plot(orbit.motion(), ax=left)
(time, dt), (speed, ds) = proof.impact_times[0], proof.impact_speeds[0]
exact = 2 * math.pi - math.acos(-math.pi * (1 - e) / (1 + e) / a), 2 * math.pi / (1 + e)
unit = 1e-13
corner = (-dt / unit, -ds / unit)
right.add_patch(plt.Rectangle(corner, 2 * dt / unit, 2 * ds / unit, alpha=0.3))
right.plot((exact[0] - time) / unit, (exact[1] - speed) / unit, "ko", label="closed form")
right.set(xlabel="time of impact [1e-13]", ylabel="its speed [1e-13]", title="Its enclosure")
right.legend(loc="lower right")

assert proof.stable
assert max(abs(exact[0] - time) / dt, abs(exact[1] - speed) / ds) < 1.0
