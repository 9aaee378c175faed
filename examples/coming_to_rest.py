"""
Infinitely many impacts in a finite time
========================================

Infinitely many impacts in a finite time: the free metainterface with impact loss comes to rest,
exactly (Zeno).

The paper's `finaltime` gives the same instant for small amplitudes: (1 + e)/(1 - e)/4 of the
undamped period.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

e, beta0, vertical, start = 0.8, np.deg2rad(80), -0.5, 1e-3
system = saltus.System(
    model=saltus.Metainterface(beta0=beta0),
    load=saltus.Load(vertical=vertical),
    impact=saltus.VelocityReduction(e),
)
motion = saltus.simulate(system, theta=start, duration=20.0)
period = theory.linear_period(start, beta0=beta0, vertical=vertical)
expected = theory.final_time(period=period, e=e)

print(
    f"{len(motion.impacts)} impacts followed one by one, at rest from tau = {motion.rest_time:.12f}"
)
print(f"the paper's closed form for small amplitudes: {expected:.12f}")
figure, (left, right) = plt.subplots(1, 2, figsize=(6.6, 3.6), layout="constrained")
times = np.linspace(0.0, motion.rest_time, 4000)
left.plot(times, motion.at(times)[0])
left.set(xlabel=r"$\tau$", ylabel=r"$\theta$ (rad)")
right.semilogy(motion.rest_time - motion.impacts.time, np.abs(motion.impacts.velocity_before), ".-")
right.set(xlabel="time left to rest", ylabel="speed of the impact")

assert motion.stop is saltus.Stop.REST
assert abs(motion.rest_time / expected - 1) < 0.01
