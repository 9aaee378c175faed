"""How finely bands of chaos are looked for, and how surely they are none of transients."""

from __future__ import annotations

from dataclasses import dataclass, replace

from saltus.attractors import JUDGEMENT, JudgementSettings


@dataclass(frozen=True)
class ChaosSettings:
    """How chaos is looked for along a parameter."""

    settling: int = 300  # Forcing periods that a motion is given to come to rest or to repeat itself.
    step: float = 1e-3  # Share of the range to which intervals are halved in which something changes, or with chaos at an end.
    # The same where motions have longer periods than this: cascades and narrow bands are near.
    fine_step: float = 3e-4
    long_period: int = 6
    undecided: float = 1.0  # Factor by which these are longer between two values that are both undecided, as where tori are.
    edge: float = 1e-4  # Share of the range to which the bracket of an edge is halved.
    seeds: int = 2  # States of the chaos at each end of an interval from which motions are begun within.
    neighbours: int = 4  # Motions that have settled at each end, from which others are begun within.
    # With several contacts: impacts that are slower than this die away, and how many are followed is no property of the motion.
    dying: float = 1e-5
    states: int = 8  # Last states of each unsettled motion that are given to the judgement.
    # Shares of the range beside a special point at which motions from its orbit are begun: narrow bands begin there.
    beside: tuple[float, ...] = (-4e-4, -1.5e-4, 1.5e-4, 4e-4)
    spacing: float = 0.0  # Share of the range: of special points that are nearer to one another only the first one is taken.
    same: float = 1e-7  # Special points are one that differ by less than this in their states and, as a share, in the parameter.
    # Judgements of rising care. The first one is made at all values, and excludes lives below 660 forcing periods; the second one
    # at edges and at some values between them (6600). The third one is made at those of them beside which companions settled,
    # and at edges beside which transients are long (33 000). With the time in which none has settled before, one round is enough
    # for the second one and three are for the third one, where none settles.
    judgements: tuple[JudgementSettings, ...] = (
        replace(JUDGEMENT, companions=8, exposure=2000, round_periods=500, rounds=2),
        replace(JUDGEMENT, companions=16, exposure=20_000, round_periods=1125),
        replace(JUDGEMENT, exposure=100_000, round_periods=1125, rounds=8),
    )
    every: float = 0.02  # Share of the range in which each band has a value that is judged with care.
    # Number of values with chaos on each side of one that fails a careful judgement that are judged so then, and twice as many on
    # each side of those that fail, and so on.
    near: int = 3
    lasting: float = 1000.0  # Mean life, in forcing periods, from which transients beyond an edge are long.
    confirmations: int = 20  # The largest number of rounds in which edges are located and confirmed.


SETTINGS = ChaosSettings()
