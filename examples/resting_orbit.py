"""
A motion that rests for a part of each period
=============================================

With a loss at impact a periodic motion may come to rest after infinitely many impacts, until the
load opens the contact again. The instant of release is known: there H sin(Omega tau) reaches Hcr.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

H, frequency = 0.15, 0.2
system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=frequency, horizontal=saltus.Harmonic(amplitude=H), vertical=-0.5),
    impact=saltus.VelocityReduction(0.3),
)
orbit = saltus.find_orbit(system, theta=0.3)
critical = theory.critical_horizontal(np.deg2rad(80), -0.5)
release = np.arcsin(critical / H) / frequency
print(orbit)
print(
    f"at rest for {100 * orbit.rest_share:.2f} % of the time; releases at {orbit.releases}, "
    f"theory {release:.12f}"
)

motion = orbit.motion()
times = np.linspace(motion.time - orbit.duration, motion.time, 4000)
figure, ax = plt.subplots()
ax.plot(times, motion.at(times)[0])
ax.set(xlabel=r"$\tau$", ylabel=r"$\theta$ (rad)", title="one period; the flat parts are rest")

half = np.pi / frequency
assert np.allclose(np.sort(orbit.releases % half), release, atol=1e-12)
