"""
A finite-element beam of 606 rows with a stop
=============================================

A cantilever of 303 elements, its sparse matrices reduced to its tip and eight modes
(`Structure.reduced`), meets a rigid stop. Its branch goes over the whole resonance, beside sweeps
up and down. Where it begins to touch, the amplitude without the stop is the gap.
"""

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

import saltus

n, gap, force, first = 303, 0.02, 0.01, 1.8751040687**2
h = 1.0 / n
mass, stiffness = sp.lil_array((2 * n + 2, 2 * n + 2)), sp.lil_array((2 * n + 2, 2 * n + 2))
bend, spin = (
    np.array([[12, 6 * h], [6 * h, 4 * h**2]]),
    np.array([[156, 22 * h], [22 * h, 4 * h**2]]),
)
far = np.array([[-12, 6 * h], [-6 * h, 2 * h**2]])
side = np.array([[54, -13 * h], [13 * h, -3 * h**2]])
flip = np.array([[1, -1], [-1, 1]])
for i in range(0, 2 * n, 2):
    stiffness[i : i + 4, i : i + 4] += np.block([[bend, far], [far.T, bend * flip]]) / h**3
    mass[i : i + 4, i : i + 4] += np.block([[spin, side], [side.T, spin * flip]]) * h / 420
mass, stiffness = sp.csc_array(mass)[2:, 2:], sp.csc_array(stiffness)[2:, 2:]  # clamped
damping = 0.02 * first * mass + 0.02 / first * stiffness
tip = 2 * n - 2
stop = saltus.Contact(name="stop", coordinate="tip", position=gap, sign=-1)
beam = saltus.Structure.reduced(
    mass, stiffness, damping, modes=8, points={"tip": tip}, contacts=[stop], forces={"f": tip}
)
load = saltus.Load(frequency=0.9 * first, f=saltus.Harmonic(force))
system = saltus.System(model=beam, load=load, impact=saltus.NewtonImpact(e=0.0))
orbit = saltus.find_orbit(system, **beam.start())
branch = saltus.continue_orbit(orbit, "load.frequency", (0.8 * first, 1.3 * first))
frequencies = first * np.linspace(0.8, 1.3, 26)
sweep = saltus.frequency_sweep(system, frequencies, periods=100, **beam.start())


# the amplitude of all 606 rows without the stop, less the gap
def above(x):
    right = np.eye(1, 2 * n, tip)[0] * force
    return abs(spsolve(stiffness + 1j * x * damping - x**2 * mass, right)[tip]) - gap


touched = brentq(above, 0.8 * first, first, xtol=1e-12)
grazings = [point.parameter for point in branch.special if point.kind == "GR"]
assert min(abs(np.array(grazings) - touched)) < 1e-5
assert [str(end)[:5] for end in branch.ends] == ["bound", "bound"]
ax = plt.subplots(layout="constrained")[1]
saltus.plot(branch, ax=ax, legend=False)
saltus.plot(sweep, ax=ax, legend="right")
