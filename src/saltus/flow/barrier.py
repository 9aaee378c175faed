"""How far flights open under bounds of their pull: the energy that it takes, and the energy with which they come back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.flow.intervals import Interval

WIDEST = 1e6  # openings up to this are looked at
STEPS = 32  # of the opening, each at most a fifth of it
TRIES = 30

Work = tuple[Any, Any, Any]


def climb(pull: Callable[[Interval], Interval], allowed: Any) -> Work:
    """Open a gap from 0 while the pull is above 0 at all times, and the ratio of the two works below `allowed`.

    Args:
        pull: bounds lo, hi of -A(t, w, 0) over all t for w in an interval, arrays (1, n).
        allowed: (1, n).

    Returns:
        how far it opens, W, and lower and upper bounds of the work, int_0^W lo dw and int_0^W hi dw; arrays (1, n), 0 where
        nothing is proved. For all smaller openings too, the ratio of the works is below `allowed`.
    """
    done: Work = (np.zeros_like(allowed), np.zeros_like(allowed), np.zeros_like(allowed))
    step = np.ones_like(allowed)
    for _ in range(TRIES):  # until the whole of it can be one step
        _, holds = _step(pull, allowed, done, step)
        if holds.all():
            break
        step = np.where(holds, step, step / 4)
    first = step = step / 8
    for _ in range(STEPS):
        new, holds = _step(pull, allowed, done, step)
        done = tuple(np.where(holds, x, y) for x, y in zip(new, done, strict=True))
        step = np.where(holds, np.minimum(2 * step, np.maximum(done[0] / 5, first)), step / 2)
    return done


def _step(pull: Callable[[Interval], Interval], allowed: Any, done: Work, step: Any) -> tuple[Work, Any]:
    """The works after one more step, and whether it may be taken. Within a step the ratio of two sums lies between its ends."""
    opening, lo, hi = done
    bounds = pull(Interval(opening, opening + step))
    new = (opening + step, lo + bounds.lo * step, hi + bounds.hi * step)
    return new, (bounds.lo > 0) & (new[2] < allowed * new[1]) & (new[0] <= WIDEST)
