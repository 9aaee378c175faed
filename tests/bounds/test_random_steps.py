"""Random validated steps contain the motion in 200 bits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from exact_motions import duffing

from saltus.bounds import Ball, Tape, coordinate
from saltus.bounds.tape import Steps
from saltus.taylor import Expr, number

Y = coordinate(0)
T = Expr("time")
DUFFING = Tape([number(0.0) - Y - Y * Y * Y + T * T])


def outside(count: int) -> int:
    """How many of random steps end outside their balls; starts lie at random corners of theirs."""
    rng = np.random.default_rng(5)
    times = rng.uniform(-2.0, 2.0, count)
    lengths = rng.uniform(0.05, 0.5, count)
    states = rng.uniform(-1.5, 1.5, (count, 1, 2))
    radii = 10.0 ** rng.uniform(-17.0, -4.0, (count, 4)) * rng.integers(0, 2, (count, 4))
    taken = Steps(
        DUFFING,
        18,
        Ball(np.zeros((count, 0))),
        Ball(times, radii[:, 0]),
        Ball(lengths, radii[:, 1]),
        Ball(states, radii[:, None, 2:]),
    )
    assert taken.proved.mean() > 0.98  # some of these steps are too long
    assert np.isfinite(taken.ends.radius[taken.proved]).all()
    wrong = 0
    signs = rng.choice([-1, 1], (count, 4))
    with mp.workprec(200):
        for i in np.flatnonzero(taken.proved):
            shift = [int(s) * mp.mpf(float(r)) for s, r in zip(signs[i], radii[i], strict=True)]
            begin = mp.mpf(float(times[i])) + shift[0]
            h = mp.mpf(float(lengths[i])) + shift[1]
            y, v = (mp.mpf(float(x)) for x in states[i, 0])
            end = duffing(begin, y + shift[2], v + shift[3], h)
            for d in range(2):
                off = abs(end[d] - mp.mpf(float(taken.ends.middle[i, 0, d])))
                wrong += off > mp.mpf(float(taken.ends.radius[i, 0, d]))
    return int(wrong)


def test_random_steps_contain_the_motion() -> None:
    assert outside(30) == 0


@pytest.mark.thorough
def test_a_thousand_random_steps_contain_the_motion() -> None:
    assert outside(1000) == 0
