"""Systems that several tests of verdicts and exponents share; those of the metainterface have one
structure, compiled once.
"""

import numpy as np


def spread(count, width=2.0, seed=0):
    """Random states, (count, 2)."""
    return np.random.default_rng(seed).uniform(-width, width, (count, 2))
