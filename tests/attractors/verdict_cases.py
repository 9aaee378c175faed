"""Systems that several tests of verdicts and exponents share; those of the metainterface have one structure, compiled once."""

import math

import numpy as np

import saltus


def under_force(frequency, amplitude, *, damping=0.1, vertical=-0.5, e=1.0, **model):
    """The metainterface of the paper's section on vibrations under load (i)."""
    return saltus.System(
        model=saltus.Metainterface(beta0=math.radians(80), damping=damping, **model),
        load=saltus.Load(frequency=frequency, horizontal=saltus.Harmonic(amplitude=amplitude), vertical=vertical),
        impact=saltus.VelocityReduction(e),
    )


def wall(damping, stiffness=1.0, *, at=20.0, force=0.2, frequency=1.3, e=0.8):
    """A linear oscillator with a wall, so far away by default that it is never reached."""
    return saltus.System(
        model=saltus.WallOscillator(stiffness=stiffness, damping=damping, wall=at),
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=force, phase=math.pi / 2)),
        impact=saltus.VelocityReduction(e),
    )


def spread(count, width=2.0, seed=0):
    """Random states, (count, 2)."""
    return np.random.default_rng(seed).uniform(-width, width, (count, 2))
