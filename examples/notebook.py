"""
Results in a notebook
=====================

Each cell ends in a result, which shows itself as a table. The link at the end of the page downloads
it as a notebook.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(0.9),
)
system

# %% A motion, and whether what it assumes holds
motion = saltus.simulate(system, theta=0.3, periods=200)
motion.validity

# %% The orbit on which it settles
orbit = saltus.find_orbit(system, theta=0.3)
orbit

# %% Its branch: folds and other special points
branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.2), progress=saltus.show_progress)
branch.special

# %% And as a picture
axes = saltus.plot(branch, ax=plt.gca())

# %%
distance = np.abs(motion.final_state - orbit.state).max()
print(f"after 200 periods the motion is {distance:.0e} beside the orbit")
assert distance < 1e-9
