"""
A response spectrum with a detached loop
========================================

A response spectrum at H = 1: the branch of period 1 and, found by search alone, a detached loop of
period 3."""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import saltus
from saltus import response_spectrum
from saltus.orbits import orbits_of

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=1.0), vertical=-0.5),
)
spectrum = response_spectrum(system, bounds=(2.0, 2.6), max_period=3, values=[2.2, 2.4], starts=16)
for number in range(spectrum["branches"].sizes["branch"]):
    branch = saltus.branch_of(spectrum, number)
    low, high = float(branch.parameter.min()), float(branch.parameter.max())
    print(
        f"branch {number}: period {int(branch.period[0])}, Omega {low:.4f} to {high:.4f}, ends "
        f"{branch.attrs['ends']}"
    )
    for kind, place in zip(branch.kind.values, branch.special_parameter.values, strict=True):
        print(f"  {kind:16} {place:.9f}")
    stable, worst = int(branch.stable.sum()), float(branch.kept.max())
    print(
        f"  {stable} of {branch.sizes['point']} orbits are stable, and after 20 periods off by "
        f"at most {worst:.0e}"
    )
figure, ax = plt.subplots()
for number in range(spectrum["branches"].sizes["branch"]):
    branch = saltus.branch_of(spectrum, number)
    ax.plot(branch.parameter, branch.amplitude, label=f"period {int(branch.period[0])}")
ax.set(xlabel=r"frequency $\Omega$", ylabel="amplitude (rad)", xlim=(1.9, 3.3))
ax.legend()

dots = spectrum["attractors"]
print(
    f"simulation settled at Omega = {dots.parameter.values} on periods {dots.period.values}, "
    f"amplitudes {dots.amplitude.values}"
)

with tempfile.TemporaryDirectory() as folder:  # a file keeps the orbits themselves
    path = Path(folder) / "spectrum.nc"
    spectrum.to_netcdf(path, engine="h5netcdf")
    with xr.open_datatree(path, engine="h5netcdf") as file:
        loop = saltus.branch_of(file.load(), 1)
orbits = orbits_of(loop)
print(f"reloaded: {orbits[0]}")

assert loop.attrs["closed"]
assert all(orbit.admissible for orbit in orbits)
assert float(loop.kept.max()) < 1e-8
folds = np.sort(loop.special_parameter.values[loop.kind.values == "LP"])
assert (
    np.abs(folds - [2.1304272516, 2.3228679307, 3.0430772685, 3.0513452905, 3.1064546343]).max()
    < 1e-9
)
