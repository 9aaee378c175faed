"""Systems of the attractor tests: few structures, each compiled once; and states at phase 0, one simulation after another."""

import math

import numpy as np

from saltus import Harmonic, Load, Metainterface, System, VelocityReduction, WallOscillator, simulate

BETA80 = math.radians(80)
FOLDS = (0.848485265597, 0.908810732539)  # of the period-1 motions at H = 0.5, in the frequency
ONSET = 0.0219879514  # of the motion at V = -0.5, Omega = 1, in the amplitude
HELD = 0.5 / math.tan(BETA80)  # Hcr: below it the undeformed state can be held


def loaded(H: float = 0.5, W: float = 1.0, V: float = -0.5, C: float = 0.1, e: float = 1.0) -> System:
    """Load (i) of the paper on the symmetric metainterface."""
    return System(
        model=Metainterface(beta0=BETA80, damping=C),
        load=Load(frequency=W, horizontal=Harmonic(amplitude=H), vertical=V),
        impact=VelocityReduction(e),
    )


def steady(V: float = -1.5, C: float = 0.1, e: float = 1.0) -> System:
    """The metainterface under a constant vertical load."""
    return System(
        model=Metainterface(beta0=BETA80, damping=C), load=Load(horizontal=0.0, vertical=V), impact=VelocityReduction(e)
    )


def walled(A: float = 0.2, W: float = 1.3, wall: float = 1.0, e: float = 0.8) -> System:
    """The impact oscillator under A cos(W t)."""
    return System(
        model=WallOscillator(stiffness=1.0, damping=0.1, wall=wall),
        load=Load(frequency=W, force=Harmonic(amplitude=A, phase=math.pi / 2)),
        impact=VelocityReduction(e),
    )


def strobes(system: System, state: np.ndarray, periods: int) -> np.ndarray:
    """The states at phase 0 after 0, 1, ... periods, one scalar simulation after another, (periods + 1, 2)."""
    name = system.model.coordinates[0]
    states = [np.asarray(state, dtype=float)]
    for _ in range(periods):
        theta, velocity = states[-1]
        motion = simulate(system, **{name: float(theta)}, velocity=float(velocity), periods=1, dense=False)
        states.append(np.array([getattr(motion, name), motion.velocity]))
    return np.array(states)
