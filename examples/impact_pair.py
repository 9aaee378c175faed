"""
An impact damper
================

An impact damper: a loose mass in a case on a spring takes the case's resonance down by its
impacts."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

LOAD = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=0.05))


def steady(mass_ratio: float, clearance: float) -> float:
    """The largest displacement of the case in the last ten of 200 forcing periods, at its
    resonance.
    """
    model = saltus.ImpactPair(mass_ratio=mass_ratio, clearance=clearance, damping=0.02)
    system = saltus.System(model=model, load=LOAD, impact=saltus.NewtonImpact(e=0.6))
    motion = saltus.simulate(system, z=0.0, x=0.0, velocity=(0.0, 0.1), periods=200)
    last = np.linspace(motion.time - 20 * np.pi, motion.time, 4001)
    return float(np.abs(motion.at(last)[0][0]).max())


alone = 0.05 / 0.02  # the amplitude at resonance without a mass that hits
for clearance in (0.2, 0.5, 1.0):
    print(f"room of {clearance} on both sides: {steady(0.1, clearance):.3f} instead of {alone:.3f}")

clearances = np.linspace(0.1, 2.0, 12)
figure, ax = plt.subplots()
ax.plot(clearances, [steady(0.1, float(room)) for room in clearances], "o-")
ax.axhline(alone, color="k", linestyle=":", label="without the loose mass")
ax.set(xlabel="room on both sides", ylabel="amplitude of the case", ylim=(0, None))
ax.legend()

assert steady(0.1, 1.0) < 0.5 * alone
