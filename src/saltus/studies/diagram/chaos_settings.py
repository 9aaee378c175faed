"""How finely bands of chaos are looked for, and how surely transients are excluded."""

from __future__ import annotations

from dataclasses import dataclass, replace

from saltus.attractors import JUDGEMENT, JudgementSettings


@dataclass(frozen=True)
class ChaosSettings:
    """How chaos is looked for along a parameter."""

    settling: int = 300  # Forcing periods that a motion is given to come to rest or to repeat itself.
    # Intervals in which something changes, or with chaos at an end, are halved down to this share of the range, ...
    step: float = 1e-3
    # ... or to this one where motions have longer periods than `long_period`: cascades and narrow bands are near.
    fine_step: float = 3e-4
    long_period: int = 6
    undecided: float = 1.0  # Factor by which both are larger between two values that are undecided, as where motions are on tori.
    edge: float = 1e-4  # The bracket of an edge is halved down to this share of the range.
    seeds: int = 2  # States of the chaos at each end of an interval from which motions are begun within it.
    neighbours: int = 4  # Settled motions at each end of an interval from which motions are begun within it.
    # With several contacts, impacts slower than this belong to an accumulation. How many of them were followed is no property of
    # the motion, whose number of impacts is then taken as 0.
    dying: float = 1e-5
    states: int = 8  # Last states of each unsettled motion that are given to the judgement.
    # Distances from a special point, as shares of the range, at which motions are begun from its orbit: narrow bands begin there.
    beside: tuple[float, ...] = (-4e-4, -1.5e-4, 1.5e-4, 4e-4)
    spacing: float = 0.0  # Of special points that are nearer to one another than this share of the range, only one is taken.
    # Special points are the same if their states differ by less than this, and their parameters by less than this share of the
    # range.
    same: float = 1e-7
    # Judgements of rising care, which exclude transients of mean lives below 660, 6600 and 33 000 forcing periods. The first one
    # is made at all values, the others where `BandSearch.confirm` finds the chaos doubtful. They count the time without settling
    # of the judgement before; if none settles, the second one then takes one round, and the third one three.
    judgements: tuple[JudgementSettings, ...] = (
        replace(JUDGEMENT, companions=8, exposure=2000, round_periods=500, rounds=2),
        replace(JUDGEMENT, companions=12, exposure=20_000, round_periods=1500),
        JUDGEMENT,
    )
    # The values of a band within this share of the range are judged together, by the sum of the forcing periods in which none of
    # their motions has settled.
    every: float = 0.02
    # Where chaos turns out to be a transient, this many values with chaos on each side are judged next with as much care; if
    # these fail too, twice as many, and so on.
    near: int = 1
    # Chaos next to transients must exclude mean lives this many times as long as theirs. Towards a crisis, lives grow like a
    # power between -1/2 and about -3/2 of the distance, so that the edge is wrong by no more than the width of its bracket.
    longer: float = 3.0
    confirmations: int = 20  # The largest number of rounds in which edges are located and confirmed.


SETTINGS = ChaosSettings()
