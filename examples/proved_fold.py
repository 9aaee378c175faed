"""
A branch that is proved
=======================

A ball on a shaken table bounces once a period if the table moves far enough. Interval arithmetic
proves the branch of these orbits, through its fold: every orbit exists, is alone near its place on
the curve, and meets the table only at its impacts. The fold and the period doubling are enclosed.
"""

import math

import matplotlib.pyplot as plt

import saltus

# The ball leaves the table with the speed pi (g = W = 1) and meets it with the relative speed
# 2 pi / (1 + e), which the table's own speed must make up for.
e = 0.5
system = saltus.System(
    model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
    load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=1.2)),
    impact=saltus.VelocityReduction(e),
)
orbit = saltus.find_orbit(system, x=-1.0, velocity=-3.0)
branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(0.9, 1.7))
proof = saltus.prove(branch, step=1.0, order=24, most_boxes=250)
print(proof.statement)
figure, ax = plt.subplots()
saltus.plot(proof, ax=ax)

enclosed = {point.kind: point.evidence.proof.parameter for point in proof.branch.special[:2]}
born = math.pi * (1 - e) / (1 + e)
doubles = math.hypot(born, 2 * (1 + e**2) / (1 + e) ** 2)
for kind, exact in (("LP", born), ("PD", doubles)):
    middle, radius = enclosed[kind]
    print(f"{kind}: {middle:.15f} +- {radius:.1e}")
    assert abs(middle - exact) <= radius + 4e-16  # what rounding leaves in the closed form
assert proof.proved_share > 0.9
