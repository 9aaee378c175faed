"""
Which record overturns the block
================================

A block of 0.8 m by 4 m under a ground acceleration that is read from an AT2 file, made larger until
the block falls. It must exceed tan(alpha) g to move the block at all.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

time = np.arange(0.0, 6.0, 0.02)
strong = 0.4 * np.sin(2 * np.pi * 1.1 * time) * np.exp(-(((time - 2.0) / 0.8) ** 2))
with open("FOOT.AT2", "w") as file:
    print(
        "PEER",
        "Foot, 90",
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {time.size}, DT= .02 SEC",
        sep="\n",
        file=file,
    )
    print(
        *(" ".join(f"{value:.7E}" for value in strong[i : i + 5]) for i in range(0, time.size, 5)),
        sep="\n",
        file=file,
    )

body = saltus.PhysicalBlock(half_width=0.4, half_height=2.0)  # m
record = saltus.Record.read("FOOT.AT2")
block = body.system(saltus.Load(ground_horizontal=record))
scales = np.linspace(0.5, 4.0, 71)
path = "load.ground_horizontal.scale"
ends = saltus.simulate_many(
    block, theta=0.0, duration=20 * body.frequency, parameters={path: block.get(path) * scales}
)
fallen = saltus.stop_names(ends) == "limit"
print(
    f"the block of {2 * body.half_height:.0f} m falls from {scales[fallen].min():.2f} times the "
    "record on"
)

worst = float(scales[fallen].min())
motion = saltus.simulate(
    block.with_({path: block.get(path) * worst}), theta=0.0, duration=20 * body.frequency
)
saltus.plot(motion, ax=plt.gca())
print(
    f"at that scale it overturns after {motion.time / body.frequency:.2f} s and "
    f"{len(motion.impacts)} impacts"
)
assert motion.stop == "limit"
# below tan(alpha) g it does not move at all
assert worst * np.abs(record.value).max() / 9.81 > np.tan(block.model.alpha)
