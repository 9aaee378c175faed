"""
A beam of ten modes on a soft stop
==================================

A cantilever shaken at its tip meets a spring at 1. The branch has two folds, to which those of
harmonic balance tend, and sweeps up and down jump there. The same tip at a rigid stop is in the
next example.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq, minimize_scalar, root

import saltus

roots = np.array(
    [brentq(lambda b: np.cos(b) + 1 / np.cosh(b), np.pi * i, np.pi * (i + 1)) for i in range(10)]
)
# in units of the first; modes of mass 1
w, tip = (roots / roots[0]) ** 2, 2 * (-1.0) ** np.arange(10)
force, stiffness, damping, angles = (
    0.03,
    0.5,
    0.04 * w,
    np.linspace(0, 2 * np.pi, 1024, endpoint=False),
)
beam = {
    "mass": np.eye(10),
    "damping": np.diag(damping),
    "stiffness": np.diag(w**2),
    "points": {"tip": tip},
    "forces": {"f": tip},
}
load = saltus.Load(frequency=1.0, f=saltus.Harmonic(force, phase=np.pi / 2))
spring = saltus.Surface(name="stop", coordinate="tip", position=1.0, stiffness=stiffness)
system = saltus.System(model=saltus.Structure(**beam, surfaces=[spring]), load=load)


def linear(frequency):
    return force * np.sum(tip**2 / (w**2 - frequency**2 + 1j * frequency * damping), axis=-1)


# z: the harmonics of the tip, real parts before imaginary ones, and the frequency
def unbalanced(z, size):
    k = np.arange(len(z) // 2)
    x = z[: len(k)] + 1j * np.append(0.0, z[len(k) : -1])
    pressed = stiffness / force * np.maximum((x @ np.exp(1j * np.outer(k, angles))).real - 1.0, 0.0)
    error = x - linear(z[-1] * k[:, None]) * (
        (k == 1) - np.where(k, 2, 1) * np.fft.rfft(pressed, norm="forward")[: len(k)]
    )
    return np.append(np.append(error.real, error.imag[1:]), abs(x[1]) - size)


def fold(harmonics, sign, sizes):
    z = np.zeros((harmonics + 1) * 2)
    z[[1, harmonics + 1, -1]] = linear(touched).real, linear(touched).imag, touched
    for size in np.linspace(1.0, sizes[0], 5):  # from the motion that touches the stop on
        z = root(unbalanced, z, args=(size,)).x
    return (
        sign
        * minimize_scalar(
            lambda size: sign * root(unbalanced, z, args=(size,)).x[-1], bounds=sizes
        ).fun
    )


touched = brentq(lambda frequency: abs(linear(frequency)) - 1.0, 1.0, 1.2, xtol=1e-14)
branch = saltus.continue_orbit(
    saltus.find_orbit(system, **system.model.start()), "load.frequency", (0.93, 1.18)
)
folds = [point.parameter for point in branch.special if point.kind == "LP"]
errors = np.abs(
    [
        np.subtract([fold(n, -1.0, (2.3, 2.6)), fold(n, 1.0, (1.001, 1.1))], folds)
        for n in (3, 7, 15)
    ]
)
values, (_, ax) = np.linspace(0.96, 1.18, 12), plt.subplots(layout="constrained")
saltus.plot(branch, ax=ax)
sweep = saltus.frequency_sweep(
    system, values, periods=80, stop_early=False, max_period=1, **system.model.start()
)
for row, way in enumerate(("up", "down")):
    ax.plot(
        sweep.value,
        sweep.amplitude[row],
        "^v"[row],
        color="0.2",
        fillstyle="none",
        label=f"swept {way}",
    )
    # of all coordinates the tip goes furthest
    assert np.array_equal(sweep.amplitude[row] > 1.0, sweep.value < folds[row])
ax.set(xlabel="frequency / first of the beam", ylabel="amplitude of the tip")
ax.legend()
assert np.all(errors < [[1e-3], [1e-4], [1e-5]])
