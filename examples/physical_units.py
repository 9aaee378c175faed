"""
From SI units and back
======================

A cell with bars of 10 cm, a mass of 0.5 kg and hinges of 2 N m / rad: what is its natural frequency
in hertz, and how large is the critical load in newtons?
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

length, mass, stiffness, beta0 = 0.1, 0.5, 2.0, np.deg2rad(80)
cell = saltus.PhysicalCell(
    length=length, upper_mass=mass, upper_stiffness=stiffness, upper_damping=0.01
)
model = cell.metainterface(beta0=beta0)
second = np.sqrt(mass * length**2 / stiffness)  # the unit of time, by hand
print(f"damping C = {model.damping:.6f}; one unit of time is {1000 * second:.3f} ms")

vertical = -10.0  # N, a weight of about 1 kg on the cell
V = vertical * length / stiffness
critical = float(theory.critical_horizontal(beta0, V)) * stiffness / length
print(f"V = {V:.3f}; a static force of {critical:.4f} N opens the cell")

load = cell.load(
    saltus.Load(
        frequency=2 * np.pi * 8.0, horizontal=saltus.Harmonic(1.2 * critical), vertical=vertical
    )
)
motion = saltus.simulate(saltus.System(model=model, load=load), theta=0.0, periods=40)
tau = np.linspace(0.0, motion.time, 4000)
figure, ax = plt.subplots()
ax.plot(tau * second, np.rad2deg(motion.at(tau)[0]))
ax.set(
    xlabel="time (s)", ylabel=r"$\theta$ (degrees)", title="8 Hz, a fifth above the critical force"
)

assert np.isclose(model.damping, 0.01 * second / (mass * length**2))
assert np.isclose(critical, abs(vertical) / np.tan(beta0))
assert np.isclose(load.frequency, 2 * np.pi * 8.0 * second)
