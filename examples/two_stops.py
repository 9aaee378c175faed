"""
A mass between two stops
========================

A mass between two stops: period-1 motions that hit each stop once, against their closed form.

With x'' = A cos(tau) between the stops at -1 and 1, and impacts at tau = phi + n pi, half a period
takes the mass from one stop to the other with the speed v after each impact: sin(phi) = -v (1 - e)
/ (2 e A) and cos(phi) = (1 - v pi (1 + e) / (4 e)) / A.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import saltus

A, E = 0.8, 0.7
SINE, COSINE = -(1 - E) / (2 * E * A), -math.pi * (1 + E) / (4 * E * A)

# the faster one of two such motions
speed = max(np.roots([SINE**2 + COSINE**2, 2 * COSINE / A, 1 / A**2 - 1]))
phase = math.atan2(SINE * speed, 1 / A + COSINE * speed) % (2 * math.pi)

system = saltus.System(
    model=saltus.TwoStops(stiffness=0.0),
    load=saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=A, phase=math.pi / 2)),
    impact=saltus.NewtonImpact(e=E),
)
motion = saltus.simulate(
    system, x=-1.0, velocity=speed, time=phase, duration=4.5 * math.pi, tol=1e-14
)
for event in motion.events:
    print(
        f"{event.kind} {event.contact:>5} at {event.time - phase:.12f}, speed after it "
        f"{abs(event.velocity_after[0]):.12f}"
    )

times = np.linspace(phase, motion.time, 1000)
figure, ax = plt.subplots()
ax.plot(times, motion.at(times)[0])
ax.plot(
    [event.time for event in motion.events],
    [1.0, -1.0, 1.0, -1.0],
    "ko",
    label="impacts, half a period apart",
)
ax.set(xlabel="time", ylabel="$x$", ylim=(-1.1, 1.5))
ax.legend()

assert [event.contact for event in motion.events] == ["right", "left", "right", "left"]
assert all(
    abs(event.time - phase - n * math.pi) < 1e-10 for n, event in enumerate(motion.events, 1)
)
