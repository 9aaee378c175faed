"""The interval of a share that is estimated from a sample."""

from __future__ import annotations

import math

DEVIATIONS = 1.96  # standard deviations to each side of a 95 % interval


def share_interval(number: int, sample: int) -> tuple[float, float]:
    """The 95 % interval (Wilson's) of a share, of which `number` out of `sample` were found; nan without a sample."""
    if not sample:
        return (math.nan, math.nan)
    share, spread = number / sample, DEVIATIONS**2 / sample
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = math.sqrt(spread * (share * (1.0 - share) + 0.25 * spread)) / (1.0 + spread)
    return (max(0.0, middle - half), min(1.0, middle + half))
