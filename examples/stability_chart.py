"""
A stability chart and the border of rest
========================================

How large is the largest stable motion beside rest, under each pair of loads? Below the line the
theory says that a static load of this size would leave the cell closed; motions exist there all the
same.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus
from saltus import theory

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.1), vertical=-0.5),
)
H, V = np.linspace(0.0, 0.3, 16), np.linspace(-1.2, -0.1, 12)
chart = saltus.stability_chart(system, horizontal=H, vertical=V)
border = theory.critical_horizontal(np.deg2rad(80), V)

figure, ax = plt.subplots()
mesh = ax.pcolormesh(H, V, chart["amplitude"])
figure.colorbar(mesh, label="largest amplitude (rad)")
ax.plot(border, V, "w--", label=r"$\hat{H}_{cr} = |V| / \tan\beta_0$")
ax.set(xlabel=r"$\hat{H}$", ylabel=r"$V$", xlim=(0, 0.3), ylim=(-1.2, -0.1))
ax.legend(facecolor="0.4", labelcolor="w")

moving = chart["count"].values > 0
beyond = H[None, :] > border[:, None]
print(f"{(moving & ~beyond).sum()} cells have a stable motion although rest is stable too")
assert moving[beyond].all()  # where the load lifts the cell off, it moves
assert not moving[:, 0].any()  # without a load it does not
