"""
Why a smoothed sign misleads
============================

Replacing sgn(theta) by a smooth function with the slope B makes every integrator happy. Where
impacts are fast its error falls as 1 / B^2; beside a grazing no B is right.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

exact = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
)
reference = saltus.simulate(exact, theta=0.3, periods=5, tol=1e-14)
B = np.array([50.0, 100.0, 200.0, 400.0, 800.0])
errors = []
for slope in B:
    motion = saltus.simulate(
        exact.with_({"model.smoothing": float(slope)}), theta=0.3, periods=5, tol=1e-13
    )
    errors.append(np.hypot(motion.theta - reference.theta, motion.velocity - reference.velocity))
order = -np.polyfit(np.log(B[1:]), np.log(errors[1:]), 1)[0]
print(f"error ~ B^-{order:.3f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(6.6, 3.6), layout="constrained")
left.loglog(B, errors, "o-")
left.xaxis.set_minor_formatter(plt.NullFormatter())
left.set(xlabel="slope $B$ of the smoothed sign", ylabel="error after 5 periods")
for system, style in ((exact, "-"), (exact.with_({"model.smoothing": 50.0}), "--")):
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, theta=0.3), "load.frequency", (0.25, 1.1)
    )
    right.plot(
        branch.parameters, branch.amplitudes, style, label="exact" if style == "-" else "B = 50"
    )
    print([(str(point.kind), round(point.parameter, 6)) for point in branch.special])
right.set(xlabel=r"$\Omega$", ylabel="amplitude (rad)", xlim=(0.25, 0.31), ylim=(0.9, 1.1))
right.legend()

assert abs(order - 2) < 0.1
assert not any(
    point.kind in ("LP", "GR") and point.parameter < 0.5 for point in branch.special
)  # the smoothed branch has lost its folds
