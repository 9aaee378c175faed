"""A mass on a belt: stick-slip, and where dry friction takes the energy of a forced oscillator
============================================================================================

On a belt that moves at w a mass on a spring sticks until the spring pulls with mu_s N, then slips
on a circle about x = mu_k N / k until it has the belt's speed again. On a belt that stands still
friction bounds the resonance of a forced mass; Den Hartog's amplitude (1931) is that of the motion
without sticking.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import saltus

KINETIC, STATIC, SPEED = 0.2, 0.3, 0.1
belt = saltus.System(model=saltus.BeltOscillator(kinetic=KINETIC, static=STATIC, belt_speed=SPEED))
motion = saltus.simulate(belt, x=0.0, velocity=SPEED, duration=30.0, tol=1e-14)
cycle = 2 * (math.pi - math.atan2(STATIC - KINETIC, SPEED)) + 2 * (STATIC - KINETIC) / SPEED
slips = [event.time for event in motion.events.of(saltus.EventKind.SLIP)]
print(f"slips every {slips[1] - slips[0]:.12f}, in closed form {cycle:.12f}")

friction, frequency = 0.2, 0.7
load = saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=1.0))
forced = saltus.System(
    model=saltus.BeltOscillator(kinetic=friction, static=friction, belt_speed=0.0), load=load
)
orbit = saltus.find_orbit(forced, x=0.5, velocity=0.0)
lossy = forced.with_({"model.damping": 0.2})
vee, you = (
    1 / (1 - frequency**2),
    math.sin(math.pi / frequency) / (frequency * (1 + math.cos(math.pi / frequency))),
)
expected = math.sqrt(vee**2 - (you * friction) ** 2)
print(f"{orbit}; Den Hartog's amplitude {expected:.9f}")
branch = saltus.continue_orbit(
    saltus.find_orbit(lossy, x=0.5, velocity=0.0), "load.frequency", (0.6, 1.6)
)

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(8, 3.2), layout="constrained")
times = np.linspace(0.0, motion.time, 1500)
x, v = motion.at(times)
sticks = motion.to_xarray(times)["sliding_belt"].values == 0
left.plot(times, x)
left.plot(times, np.where(sticks, x, np.nan), linewidth=3, label="sticks")
left.set(xlabel="time", ylabel="$x$")
left.legend()
middle.plot(x, v)
middle.set(xlabel="$x$", ylabel="$x'$", aspect="equal", title="on the belt")
right.plot(branch.parameters, [point.amplitude for point in branch.orbits])
right.set(
    xlabel="frequency of the force",
    ylabel="amplitude",
    title=r"on ground, $\mu N = 0.2$, $c = 0.2$",
)

assert abs(slips[1] - slips[0] - cycle) < 1e-12
assert abs(orbit.amplitude - expected) < 1e-9
