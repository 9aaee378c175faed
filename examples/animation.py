"""
A mechanism that moves
======================

A motion of the metainterface as a film, its phase portrait beside it. A GIF and a page are written
without other programs, an MP4 where ffmpeg is installed. The bars of the cell stay rigid: their
lengths in all states of the motion are the same to rounding.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus.systems import drawing_of

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
)
motion = saltus.simulate(system, theta=0.3, periods=3)
saltus.animate(motion, "metainterface.gif", seconds=1.0, fps=8)

figure, axes = plt.subplots(2, 2, layout="constrained")  # four pictures of it
lengths = []
for ax, time in zip(axes.flat, (0.0, 5.0, 10.0, 15.0), strict=True):
    theta = motion.at(time)[0]
    for shape in drawing_of(system, [theta]):
        if shape.kind == "line":
            ax.plot(*shape.points.T, color="k" if shape.role == "bar" else "C0")
    bars = [shape.points for shape in drawing_of(system, [theta]) if shape.role == "bar"]
    lengths.append([np.hypot(*(end - start)) for start, end in bars])
    ax.set(
        title=rf"$\tau={time:g}$, $\theta={theta:.2f}$ rad",
        aspect="equal",
        xlim=(-1.4, 2.8),
        ylim=(-0.8, 2.6),
    )
    ax.axis("off")
print(f"the lengths of the bars differ by {np.ptp(lengths, axis=0).max():.0e}")
assert np.ptp(lengths, axis=0).max() < 1e-14
