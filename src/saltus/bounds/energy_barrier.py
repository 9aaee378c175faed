"""The opening of a gap in a flight, from bounds of the pull: the energy that it takes, and the energy with which it comes
back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.bounds.intervals import SLACK, Interval

Bounds = Callable[[Interval], Interval]
Work = tuple[Any, Any, Any]


@dataclass(frozen=True)
class ClimbSettings:
    """The largest opening of a gap, and the steps in which it is opened."""

    widest: float = 1e6  # The largest opening that is considered.
    tries: int = 30  # The largest number of times that the first step is divided by 4, until it may be taken.
    steps: int = 20  # The largest number of steps over the opening, each at most a third of it.


CLIMB = ClimbSettings()


def climb(pull: Bounds, slope: Bounds, allowed: Any) -> Work:
    """Open a gap from 0 as long as the pull is positive at all times and the ratio of the two works is below `allowed`.

    Parameters
    ----------
    pull
        Bounds of -A(t, w, 0) over all t for w in an interval, arrays (1, n).
    slope
        Bounds of its derivative to w.
    allowed
        The bound of the ratio of the works, (1, n).

    Returns
    -------
    Work
        The opening W that is reached, and lower and upper bounds of the work, int_0^W min_t(-A) dw and int_0^W max_t(-A) dw;
        arrays (1, n), 0 where nothing is proved. The ratio of the works is below `allowed` for all smaller openings too.
    """
    done: Work = (np.zeros_like(allowed), np.zeros_like(allowed), np.zeros_like(allowed))
    step = np.ones_like(allowed)
    for _ in range(CLIMB.tries):  # until the whole of it can be one step
        _, holds = _step(pull, slope, allowed, done, step)
        if holds.all():
            break
        step = np.where(holds, step, step / 4)
    first = step = step / 2
    for _ in range(CLIMB.steps):
        new, holds = _step(pull, slope, allowed, done, step)
        done = tuple(np.where(holds, x, y) for x, y in zip(new, done, strict=True))
        step = np.where(holds, np.minimum(2 * step, np.maximum(done[0] / 3, first)), step / 2)
    return done


def _step(pull: Bounds, slope: Bounds, allowed: Any, done: Work, step: Any) -> tuple[Work, Any]:
    """The works after one more step, and whether it may be taken.

    Over a step h the work is h times the pull in the middle, to within h^2 / 8 times the range of the slope. Anywhere in the
    step, the ratio of the works lies between the ratio before the step and the one with the extreme pulls of the step.
    """
    opening, lo, hi = done
    middle, change = pull(Interval(opening + step / 2)), slope(Interval(opening, opening + step))
    reach, spread = step / 2 * change.magnitude(), step * step / 8 * (change.hi - change.lo)
    low, high = (middle.lo - reach) * (1 - SLACK), (middle.hi + reach) * (1 + SLACK)
    new = (opening + step, lo + (step * middle.lo - spread) * (1 - SLACK), hi + (step * middle.hi + spread) * (1 + SLACK))
    return new, (low > 0) & (hi + high * step < allowed * (lo + low * step)) & (new[0] <= CLIMB.widest)
