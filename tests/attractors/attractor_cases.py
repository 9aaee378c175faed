"""Systems of the attractor tests: few structures, each compiled once; and states at phase 0, one
simulation after another.
"""

import math

import numpy as np

from saltus import System, simulate

BETA80 = math.radians(80)
FOLDS = (0.848485265597, 0.908810732539)  # of the period-1 motions at H = 0.5, in the frequency
ONSET = 0.0219879514  # of the motion at V = -0.5, Omega = 1, in the amplitude
HELD = 0.5 / math.tan(BETA80)  # Hcr: below it the undeformed state can be held


def strobes(system: System, state: np.ndarray, periods: int) -> np.ndarray:
    """The states at phase 0 after 0, 1, ...

    periods, one scalar simulation after another, (periods + 1, 2).
    """
    name = system.model.coordinates[0]
    states = [np.asarray(state, dtype=float)]
    for _ in range(periods):
        theta, velocity = states[-1]
        motion = simulate(
            system, **{name: float(theta)}, velocity=float(velocity), periods=1, dense=False
        )
        states.append(np.array([getattr(motion, name), motion.velocity]))
    return np.array(states)
