"""
A branch through folds and a grazing, and a cusp
================================================

The metainterface at H = 0.5: an orbit, its branch along the frequency through folds and a grazing,
and a fold's own curve."""

import matplotlib.pyplot as plt
import numpy as np

import saltus

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
)
orbit = saltus.find_orbit(system, theta=0.3)
print(orbit)
print(
    f"impacts at {orbit.impact_times} with speeds {orbit.speeds}; multipliers {orbit.multipliers}"
)
print(
    f"after 100 periods of direct simulation theta = {orbit.motion(100).theta:.1e} at the impact "
    "that it started with"
)

branch = saltus.continue_orbit(orbit, "load.frequency", (0.25, 3.0))
for point in branch.special:
    impacts = point.orbit.signature.impact_count
    print(
        f"{point.kind:12} Omega = {point.parameter:.12f} to {point.evidence.bracket:.0e}, "
        f"{impacts} impacts"
    )
for motion in branch.at(0.88):
    print(f"at Omega = 0.88: {motion}")

figure, ax = plt.subplots()
ax.plot(branch.parameters, np.where(branch.stable, branch.amplitudes, np.nan), "k")
ax.plot(branch.parameters, np.where(branch.stable, np.nan, branch.amplitudes), "k:")
for point in branch.special:
    if point.kind == "LP" and point.parameter > 0.5:
        ax.annotate(
            point.kind, (point.parameter, point.orbit.amplitude), fontsize=7, color="tab:red"
        )
ax.set(xlabel=r"frequency $\Omega$", ylabel="amplitude (rad)", title="dotted: unstable")

# Where the orbit touches the contact between its two impacts, four more appear: a pair and its
# mirror image.
grazing = max(
    (point for point in branch.special if point.kind == "GR"), key=lambda point: point.parameter
)
assert abs(grazing.parameter - 0.284630020) < 1e-9
assert {motion.signature.impact_count for motion in branch.orbits} >= {2, 6}

# The folds between which three orbits coexist meet in a cusp: under smaller loads there is one
# orbit only.
fold = next(point for point in branch.special if point.kind == "LP" and point.parameter > 0.5)
curve = saltus.continue_special(fold, "load.horizontal.amplitude", (0.15, 0.6))
cusp = next(point for point in curve.special if point.kind == "CP")
print(f"cusp at Omega = {cusp.parameters[0]:.9f}, H = {cusp.parameters[1]:.9f}")
for change, folds in ((-0.01, 0), (0.01, 2)):
    loaded = system.with_({"load.horizontal.amplitude": cusp.parameters[1] + change})
    beside = saltus.continue_orbit(
        saltus.find_orbit(loaded, theta=0.3), "load.frequency", (0.7, 1.1)
    )
    assert [point.kind for point in beside.special].count("LP") == folds
