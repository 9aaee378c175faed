"""
Which pulses overturn a block, and the exact borders
====================================================

A marble block 0.8 m wide and 3.2 m high under one sine of ground acceleration: it overturns at
once, or on the other side after an impact, and between the two it may stand. The borders are the
motions that end on the unstable equilibrium, here followed exactly. Below, the share of a sample of
records that overturns it, with its interval.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

block = saltus.PhysicalBlock(half_width=0.4, half_height=1.6)
pulse = saltus.OneSine(amplitude=5.0, frequency=6.0, quantity="acceleration")  # m/s^2, rad/s
system = block.system(saltus.Load(ground_horizontal=pulse))
spectrum = saltus.overturning_spectrum(
    system, amplitude=np.linspace(0.2, 2.4, 23), frequency=np.linspace(1.0, 4.0, 16)
)
saltus.plot(spectrum, ax=plt.gca()).set(
    xlabel=r"frequency $\omega / p$", ylabel="acceleration over g"
)

# The motion on the border without an impact ends on the unstable equilibrium, theta = -alpha: half
# a part in a million beside it, the one motion overturns and the other one does not.
alone = np.flatnonzero(spectrum.border_impacts.values == 0)
k = alone[len(alone) // 2]
size, rate = float(spectrum.border_amplitude[k]), float(spectrum.border_frequency[k])
path = "load.ground_horizontal."
beside = [
    system.with_({path + "amplitude": size * (1 + shift), path + "frequency": rate})
    for shift in (-5e-7, 0.0, 5e-7)
]
motions = [saltus.simulate(each, theta=0.0, duration=2 * np.pi / rate + 30.0) for each in beside]
near = min(
    abs(float(theta) + block.alpha)
    for theta in motions[1].at(np.linspace(0, motions[1].time, 2000))[0]
)
print(f"{[m.limit for m in motions]}, at least {near:.0e} rad from the unstable equilibrium")
assert motions[0].limit is None or motions[0].side > 0
assert motions[2].limit == "overturned"
assert near < 1e-4

records = []  # a sample of records: noise of the same spectrum, 8 s long
for seed in range(24):
    time = np.arange(0.0, 8.0, 0.02)
    noise = np.convolve(
        np.random.default_rng(seed).normal(size=time.size), np.hanning(25), mode="same"
    ) * np.sin(np.pi * time / 8)
    records.append(saltus.Record(time, noise / np.abs(noise).max(), quantity="acceleration"))
shaken = [block.system(saltus.Load(ground_horizontal=record)) for record in records]
share = saltus.fragility(shaken, np.linspace(1.0, 12.0, 23))  # peak accelerations in m/s^2
plt.figure()
saltus.plot(share, ax=plt.gca()).set(xlabel="peak acceleration of the record (m/s$^2$)")
assert float(share.share[0]) == 0.0 < float(share.lower[-1])
