"""
Damping, restitution and angle from a noisy record
==================================================

Three seconds of the angle of a metainterface, with noise, give its damping, its restitution and its
geometry with their errors; a random walk with the likelihood, as emcee or PyMC would do it, finds
the same distribution."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

cell = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(0.9),
)
times = np.linspace(0.0, 3.0, 300) / 0.25  # 3 s by the unit of time of this cell (see PhysicalCell)
rng = np.random.default_rng(1)
clean = saltus.simulate(cell, theta=0.3, duration=times[-1]).at(times)[0]
record = saltus.Measurement(
    start={"theta": 0.3},
    time=times,
    values={"theta": clean + rng.normal(0.0, 0.02, 300)},
    sigma=0.02,
)

# with it there are fewer impacts
guess = cell.with_({"model.damping": 0.3, "impact.e": 0.7, "model.beta0": 1.2})
found = saltus.fit(
    guess, record, {"model.damping": (0.0, 0.5), "impact.e": (0.6, 1.0), "model.beta0": (1.1, 1.56)}
)
print(found)
# A random walk on the likelihood (flat priors within the bounds), with steps as the errors say.
names, x = list(found.values), np.array(list(found.values.values()))
root, (size, _), walk = np.linalg.cholesky(found.covariance), found.log_likelihood(x), []
for _ in range(1500):
    there = x + 1.4 * root @ rng.normal(size=3)
    larger = found.log_likelihood(there)[0]
    if np.log(rng.uniform()) < larger - size:
        x, size = there, larger
    walk.append(x)
saltus.plot(found, ax=plt.gca())
errors = np.array(list(found.errors.values()))
deviations = (np.array(list(found.values.values())) - [0.1, 0.9, np.deg2rad(80)]) / errors
print(
    "off by",
    deviations.round(2),
    "standard errors;",
    "walk / fit errors:",
    (np.std(walk, axis=0) / errors).round(2),
)
assert np.abs(deviations).max() < 3
assert np.abs(np.std(walk, axis=0) / errors - 1).max() < 0.35
