"""
A model from SymPy
==================

Lagrange's equations of a pendulum, formed by SymPy, with a stop at which it hangs: it bounces, ever
lower."""

import matplotlib.pyplot as plt
import numpy as np
import sympy
from scipy.special import ellipk
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import saltus

angle, time = dynamicsymbols("angle"), dynamicsymbols._t
mass, length, gravity = sympy.symbols("mass length gravity")
kinetic = mass * (length * angle.diff(time)) ** 2 / 2
method = LagrangesMethod(kinetic + mass * gravity * length * sympy.cos(angle), [angle])
method.form_lagranges_equations()

model = saltus.from_sympy(
    method,
    parameters={mass: 2.0, length: 0.5, gravity: 9.81},
    contacts=[saltus.Contact(name="stop", coordinate="angle")],
    name="PendulumAtStop",
)
system = saltus.System(model=model, impact=saltus.NewtonImpact(e=0.8))
motion = saltus.simulate(system, angle=1.5, velocity=0.0, duration=6.0)
print(
    f"{system.to_json()}\n{len(motion.impacts)} impacts, the first at {motion.impacts.time[0]:.6f}"
)

times = np.linspace(0.0, motion.time, 1201)
figure, ax = plt.subplots()
ax.plot(times, motion.at(times)[0])
ax.set(xlabel="time", ylabel="angle")

rate = np.sqrt(9.81 / 0.5)
# a quarter of the pendulum's period
assert abs(motion.impacts.time[0] - ellipk(np.sin(0.75) ** 2) / rate) < 1e-12
speeds = 2 * rate * np.sin(0.75) * 0.8 ** np.arange(len(motion.impacts))
assert np.allclose(-motion.impacts.velocity_before[:, 0], speeds, rtol=1e-10)
