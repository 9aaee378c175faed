"""
Proved to stay at rest
======================

Below a certain speed after an impact a motion is proved to stay near the contact under all later
loads: `capture_speed`, from interval bounds alone, without simulation. Here motions are let go
below and above it.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.02), vertical=-0.5),
    impact=saltus.VelocityReduction(0.9),
)
threshold = float(saltus.capture_speed(system))
print(f"captured below {threshold:.6f} rad per unit of time")

speeds = threshold * np.array([0.2, 0.6, 0.999, 20.0, 60.0])
figure, ax = plt.subplots()
for speed in speeds:
    motion = saltus.simulate(system, theta=0.0, velocity=float(speed), side=1, duration=60.0)
    times = np.linspace(0.0, motion.time, 3000)
    ax.semilogy(
        times,
        np.maximum(np.abs(motion.at(times)[0]), 1e-9),
        linewidth=0.8,
        label=f"{speed / threshold:g} x",
    )
    if speed < threshold:
        assert motion.stop is saltus.Stop.REST
        # its impacts only get slower
        assert np.all(np.diff(np.abs(motion.impacts.velocity_after[::2])) < 0)
ax.set(xlabel=r"$\tau$", ylabel=r"$|\theta|$ (rad)", ylim=(1e-8, 1))
ax.legend(title="speed at the start")

H = np.array([0.005, 0.02, 0.05, 0.0881, 0.09])
speeds = saltus.capture_speed(system, {"load.horizontal.amplitude": H})
critical = saltus.theory.critical_horizontal(np.deg2rad(80), -0.5)
# beyond Hcr the load lifts it off, and nothing is proved
assert np.all((speeds > 0) == (critical > H))
