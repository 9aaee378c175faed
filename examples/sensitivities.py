"""
Derivatives through impacts
===========================

Derivatives of motions with impacts: to the state at the start, to parameters, and of the times of
events."""

import math

import matplotlib.pyplot as plt
import numpy as np

import saltus

# The metainterface: each impact scales areas of states by e^2, the damping shrinks them by exp(-C
# tau).
C, e = 0.1, 0.9
system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=C),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(e),
)
result = saltus.sensitivities(
    system, theta=0.3, periods=5, parameters=("load.frequency", "impact.e")
)
impacts = len(result.motion.impacts)
expected = e ** (2 * impacts) * math.exp(-C * result.motion.time)
print(f"d(theta, theta')/d(theta, theta') after {impacts} impacts:\n{result.state}")
print(f"its determinant is {result.determinant:.15g}, the law says {expected:.15g}")
for path, (theta, velocity) in zip(result.parameter_paths, result.parameters.T, strict=True):
    print(f"d theta/d {path} = {theta:+.12f}, d theta'/d {path} = {velocity:+.12f}")
assert abs(result.determinant / expected - 1) < 1e-10

figure, ax = plt.subplots()
ax.plot([event.time for event in result.motion.events], result.event_times[:, 2], "o-")
ax.set(xlabel="time of the event", ylabel=r"its derivative to $\Omega$")

# A ball dropped from a height of 1 is at rest at sqrt(2) (1 + e)/(1 - e), after infinitely many
# impacts.
ball = saltus.System(
    model=saltus.WallOscillator(stiffness=0.0, wall=0.0),
    load=saltus.Load(force=1.0),
    impact=saltus.VelocityReduction(e),
)
fall = saltus.sensitivities(ball, x=-1.0, duration=40.0, parameters=("impact.e",))
time, slope = fall.motion.rest_time, fall.event_times[-1, -1]  # columns: x, velocity, impact.e
print(f"the ball rests from {time:.12f} on; with e that moves by {slope:.9f}")
assert abs(time / (math.sqrt(2) * (1 + e) / (1 - e)) - 1) < 1e-10
assert abs(slope / (2 * math.sqrt(2) / (1 - e) ** 2) - 1) < 1e-8
