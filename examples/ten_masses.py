"""
Ten masses over a resonance with one stop
=========================================

A structure of ten masses in a row, given by its matrices, in its first resonance; the last mass may
hit a stop. The branch of periodic orbits, up to six impacts in a period, runs over the whole
resonance, and the sweep of 31 values lies on it. From both sides it touches the stop where the last
mass of the linear chain has the amplitude of the gap.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import saltus

K = 2 * np.eye(10) - np.eye(10, k=1) - np.eye(10, k=-1)
stop = saltus.Contact(name="stop", coordinate=9, position=0.2, sign=-1)
chain = saltus.Structure(
    mass=np.eye(10), damping=0.05 * K, stiffness=K, contacts=[stop], forces={"f": 0}
)
load = saltus.Load(frequency=0.24, f=saltus.Harmonic(0.05))
system = saltus.System(model=chain, load=load, impact=saltus.NewtonImpact(e=0.6))


def beyond(frequency):
    """By how much the last mass of the linear chain would pass the stop."""
    return (
        0.05
        * abs(
            np.linalg.solve(K - frequency**2 * np.eye(10) + 0.05j * frequency * K, np.eye(10)[0])[
                -1
            ]
        )
        - 0.2
    )


touched = [brentq(beyond, 0.25, 0.284, xtol=1e-15), brentq(beyond, 0.285, 0.3, xtol=1e-15)]
branch = saltus.continue_orbit(
    saltus.find_orbit(system, **chain.start()), "load.frequency", (0.22, 0.36)
)
sweep = saltus.frequency_sweep(system, np.linspace(0.22, 0.36, 31), **chain.start())
for point in branch.special:
    print(f"{point.kind} at {point.parameter:.12f}, {point.orbit.signature.impact_count} impacts")
figure, ax = plt.subplots(layout="constrained")
saltus.plot(branch, ax=ax)
ax.plot(sweep.value, sweep.amplitude.T, "o", fillstyle="none", label=["swept up", "swept down"])
ax.set_ylabel("largest of all coordinates of the structure")
ax.legend()

grazings = np.array([point.parameter for point in branch.special if point.kind == "GR"])
assert {str(end) for end in branch.ends} == {"bound 0.22", "bound 0.36"}
assert max(np.abs(grazings - frequency).min() for frequency in touched) < 1e-9
assert sweep.impact_count.max() > 1
