"""The system of the paper's spectra, and one small diagram that several tests look at, computed
once.
"""

import functools

from shared_systems import forced

from saltus import response_spectrum

FREQUENCY, AMPLITUDE = "load.frequency", "load.horizontal.amplitude"


@functools.cache
def detached():
    """H = 1 around the period-3 loop: a grazing from 2 to 6 impacts, small motions beside it."""
    return response_spectrum(
        forced(1.0), FREQUENCY, (2.0, 2.6), max_period=3, values=[2.2, 2.4], starts=16, seed=3
    )
