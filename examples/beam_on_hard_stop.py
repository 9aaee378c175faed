"""
A beam of ten modes on a hard stop
==================================

A cantilever with Rayleigh damping, shaken at its tip, meets a rigid stop. Without restitution the
tip rests there until it is pulled off; with one of 0.5 it bounces to rest first, and goes as far to
1e-5. The branch turns at two folds and where impacts appear. Matrix exponentials give the last fold
too, at which a sweep upwards leaves the stop.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar, root

import saltus

roots = np.array(
    [brentq(lambda b: np.cos(b) + 1 / np.cosh(b), np.pi * i, np.pi * (i + 1)) for i in range(10)]
)
# in units of the first; modes of mass 1
w, tip, force = (roots / roots[0]) ** 2, 2 * (-1.0) ** np.arange(10), 0.06
D, K, free = np.diag(0.09 + 0.01 * w**2), np.diag(w**2), np.eye(10)
# what the stop leaves of velocities and accelerations
held = free - np.outer(tip, tip) / (tip @ tip)
stop = saltus.Contact(name="stop", coordinate="tip", position=1.0, sign=-1)
beam = saltus.Structure(
    mass=free, damping=D, stiffness=K, points={"tip": tip}, contacts=[stop], forces={"f": tip}
)
load = saltus.Load(frequency=1.05, f=saltus.Harmonic(force, phase=np.pi / 2))
system = saltus.System(model=beam, load=load, impact=saltus.NewtonImpact(e=0.0))


# the map of displacements, velocities, and the load's cosine and sine
def carried(directions, time, frequency):
    rates = np.zeros((22, 22))
    rates[:10, 10:20], rates[10:20, 20], rates[20, 21], rates[21, 20] = (
        free,
        force * directions @ tip,
        -frequency,
        frequency,
    )
    rates[10:20, :20] = -directions @ np.hstack([K, D])
    return expm(rates * time)


# the gap at the closing, the reaction at the opening of an orbit with these phases
def unbalanced(z, closing):
    opening, frequency = z
    pressed = carried(held, (opening - closing) / frequency, frequency)
    whole = (carried(free, (2 * np.pi + closing - opening) / frequency, frequency) @ pressed)[:20]
    whole[10:] = held @ whole[10:]  # the impact
    phase = np.array([np.cos(closing), np.sin(closing)])
    begin = np.append(np.linalg.solve(np.eye(20) - whole[:, :20], whole[:, 20:] @ phase), phase)
    end = pressed @ begin
    return tip @ begin[:10] - 1.0, tip @ (force * tip * end[20] - D @ end[10:20] - K @ end[:10])


touched = brentq(
    lambda x: abs(force * np.sum(4 / (w**2 - x**2 + 1j * x * np.diag(D)))) - 1.0,
    1.05,
    1.2,
    xtol=1e-14,
)
orbit, bounces = (
    saltus.find_orbit(one, **beam.start()) for one in (system, system.with_({"impact.e": 0.5}))
)
branch = saltus.continue_orbit(orbit, "load.frequency", (1.05, 1.17))
last = max(
    (point for point in branch.special if point.kind == "LP"), key=lambda point: point.parameter
)
closing, opening = (event.time * last.parameter for event in last.orbit.motion().events)
found = minimize_scalar(
    lambda x: -root(unbalanced, (opening, last.parameter), x, tol=1e-13).x[1],
    (closing, closing + 0.01),
)
sweep = saltus.frequency_sweep(
    system,
    np.linspace(1.065, 1.165, 11),
    periods=40,
    stop_early=False,
    max_period=1,
    **beam.start(),
)
saltus.plot(branch, ax=(ax := plt.subplots(layout="constrained")[1]))
for row, way in enumerate(("up", "down")):
    ax.plot(
        sweep.value,
        sweep.amplitude[row],
        "^v"[row],
        color="0.2",
        fillstyle="none",
        label=f"swept {way}",
    )
ax.set(xlabel="frequency / first of the beam", ylabel="amplitude of the tip")
ax.legend()
assert abs(orbit.amplitude - bounces.amplitude) < 1e-5
assert abs(found.fun + last.parameter) < 1e-10
assert np.isclose(
    touched, [point.parameter for point in branch.special], rtol=0.0, atol=1e-10
).any()
assert np.array_equal(sweep.amplitude > 1.0, [sweep.value < last.parameter, sweep.value < touched])
