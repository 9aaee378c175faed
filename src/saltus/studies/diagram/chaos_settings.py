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
    # Judgements of rising care, which exclude transients of mean lives below 660, 6600 and 33 000 forcing periods. The first one
    # is made at all values, the others where `BandSearch.confirm` finds the chaos doubtful. With the time in which none has
    # settled before, one round is enough for the second one and three are for the third one, where none settles.
    judgements: tuple[JudgementSettings, ...] = (
        replace(JUDGEMENT, companions=8, exposure=2000, round_periods=500, rounds=2),
        replace(JUDGEMENT, companions=16, exposure=20_000, round_periods=1125),
        replace(JUDGEMENT, exposure=100_000, round_periods=1125),
    )
    # Share of the range: the values of a band that lie so near to one another are judged together, by the sum of the forcing
    # periods in which none of their motions has settled.
    every: float = 0.02
    # Number of values with chaos, on each side of one that turns out to have none, that are judged next with as much care; where
    # these fail too it is twice as many, and so on.
    near: int = 1
    # Chaos beside transients is to exclude mean lives so many times as long as theirs. Towards a crisis lives grow like a power
    # between -1/2 and about -3/2 of the distance: the edge is then off by no more than the width of its bracket.
    longer: float = 3.0
    confirmations: int = 20  # The largest number of rounds in which edges are located and confirmed.


SETTINGS = ChaosSettings()
