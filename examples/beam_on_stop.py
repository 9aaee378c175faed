"""
A beam of ten modes with a soft and with a hard stop
====================================================

A cantilever of ten modes is shaken by a force at its tip, which meets a stop at 1. What comes from below stays in contact where
what comes from above stays clear of it. At the soft stop, a spring, harmonic balance tends to the orbit with more harmonics.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq, fsolve

import saltus

roots = np.array([brentq(lambda b: np.cos(b) + 1 / np.cosh(b), np.pi * i, np.pi * (i + 1)) for i in range(10)])
w, tip = (roots / roots[0]) ** 2, 2 * (-1.0) ** np.arange(10)  # in units of the first; modes of mass 1
force, stiffness, damping, angles = 0.03, 0.5, 0.04 * w, np.linspace(0, 2 * np.pi, 2048, endpoint=False)
beam = {"mass": np.eye(10), "damping": np.diag(damping), "stiffness": np.diag(w**2), "points": {"tip": tip}, "forces": {"f": tip}}
load = saltus.Load(frequency=1.0, f=saltus.Harmonic(force, phase=np.pi / 2))
spring = saltus.Surface(name="stop", coordinate="tip", position=1.0, stiffness=stiffness)
wall = saltus.Contact(name="stop", coordinate="tip", position=1.0, sign=-1)
soft = saltus.System(model=saltus.Structure(**beam, surfaces=[spring]), load=load)
hard = saltus.System(model=saltus.Structure(**beam, contacts=[wall]), load=load, impact=saltus.NewtonImpact(e=0.5))


def receptance(frequency):
    return np.sum(tip**2 / (w**2 - frequency**2 + 1j * frequency * damping), axis=-1)


def displaced(z, angles):
    """The harmonics of which z has the real parts before the imaginary ones, and the tip at these angles of the period."""
    x = z[: len(z) // 2 + 1] + 1j * np.append(0.0, z[len(z) // 2 + 1 :])
    return x, (x @ np.exp(1j * np.outer(np.arange(len(x)), angles))).real


def unbalanced(z, frequency):
    x, tip_at = displaced(z, angles)
    k, pressed = np.arange(len(x)), np.fft.rfft(stiffness * np.maximum(tip_at - 1.0, 0.0), norm="forward")[: len(x)]
    error = x - receptance(frequency * k[:, None]) * (force * (k == 1) - np.where(k, 2, 1) * pressed)  # 0 in balance
    return np.append(error.real, error.imag[1:])


orbit = saltus.find_orbit(soft, **soft.model.start()).motion(1)
times, errors = np.linspace(orbit.start, orbit.time, 2000), []
for count in (3, 7, 15, 31):
    z = fsolve(unbalanced, np.zeros(2 * count + 1), args=(1.0,), xtol=1e-12)
    errors.append(np.abs(displaced(z, times)[1] - orbit.at(times)[0][0]).max())
    print(f"{count} harmonics: error {errors[-1]:.1e} of the tip")
values, (figure, axes) = np.linspace(0.94, 1.24, 11), plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for ax, system, name in zip(axes, (soft, hard), ("soft stop", "hard stop"), strict=True):
    sweep = saltus.frequency_sweep(system, values, periods=40, stop_early=False, **system.model.start())
    up, down = -sweep.smallest_tip.values  # away from the stop; of all coordinates the tip goes furthest
    linear = force * np.abs(receptance(values[:, None]))
    ax.plot(values, linear, "k:", values, up, "C0-o", values, down, "C1--s", markersize=4)
    ax.set(xlabel="frequency / first of the beam", ylabel="away from the stop", title=name)
    two = (up > 1.05) & (down < 0.95)
    assert np.abs(down / linear - 1.0)[two].max() < 0.02  # there are two, and the lower one is that of the linear beam
axes[0].legend(["without a stop", "up", "down"])
assert np.all(np.diff(np.log2(errors)) < -1.5)  # each doubling of the harmonics brings the orbit nearer
assert errors[-1] < 1e-4
