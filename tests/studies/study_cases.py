"""The system of the paper's spectra, and one small diagram that several tests look at, computed once."""

import functools

import numpy as np

from saltus.studies import response_spectrum
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction

FREQUENCY, AMPLITUDE = "load.frequency", "load.horizontal.amplitude"


def forced(H=1.0, W=1.0, e=1.0):
    """The paper's system under load (i)."""
    return System(
        model=Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=Load(frequency=W, horizontal=Harmonic(amplitude=H), vertical=-0.5),
        impact=VelocityReduction(e),
    )


@functools.cache
def detached():
    """H = 1 around the period-3 loop: a grazing from 2 to 6 impacts, small motions beside it."""
    return response_spectrum(forced(), FREQUENCY, (2.0, 2.6), max_period=3, values=[2.2, 2.4], starts=16, seed=3)
