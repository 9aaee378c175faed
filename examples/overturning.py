"""
A rigid block under half-sine pulses
====================================

Which half-sine pulses of the ground overturn a slender block, for every frequency and size of the
pulse: each motion has a pulse of its own. The border is the closed form w sin(psi) = cos(psi) +
exp(-(pi - psi) / w), sin(psi) = 1 / A."""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from scipy.optimize import brentq

import saltus

alpha = 0.01  # slenderness: the linear block's formula then holds to some 1e-4
block = saltus.System(
    model=saltus.RockingBlock(alpha=alpha),
    load=saltus.Load(
        ground_horizontal=saltus.HalfSine(amplitude=1.0, frequency=1.0, quantity="acceleration")
    ),
    impact=saltus.VelocityReduction(0.9),
)
w, A = np.linspace(0.5, 6.0, 56), np.linspace(1.0, 8.0, 141)
pulses = {
    "load.ground_horizontal.frequency": xr.DataArray(w, coords=[("w", w)]),
    "load.ground_horizontal.amplitude": xr.DataArray(np.tan(alpha) * A, coords=[("A", A)]),
}
motions = saltus.simulate_many(block, theta=0.0, duration=40.0, parameters=pulses)
overturned = (motions.limit >= 0).transpose("A", "w")


def threshold(rate):
    """The least A that overturns the linear block without an impact."""
    psi = brentq(
        lambda psi: rate * np.sin(psi) - np.cos(psi) - np.exp(-(np.pi - psi) / rate),
        1e-6,
        np.pi / 2,
    )
    return 1 / np.sin(psi)


exact = np.array([threshold(rate) for rate in w])
figure, ax = plt.subplots(layout="constrained")
ax.pcolormesh(w, A, overturned, cmap="Blues", vmax=2, rasterized=True)
ax.plot(w, exact, "k", lw=1.2, label="closed form")
ax.set(
    xlabel="frequency of the pulse over p",
    ylabel=r"acceleration over $g\,\tan\alpha$",
    title="overturned (blue)",
)
ax.legend(loc="upper left")

first = A[overturned.values.argmax(axis=0)]  # the least A of the grid that overturns
print(
    f"largest distance to the closed form: {np.abs(first - exact).max() / (A[1] - A[0]):.3f} "
    "steps of the grid"
)
assert (np.abs(first - exact) <= 1.01 * (A[1] - A[0])).all()
