"""How much is tried for a diagram: one record of numbers for each level of effort, and the checks
of its arguments.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from saltus.attractors import JUDGEMENT, JudgementSettings
from saltus.checks import check_bounds, check_count, check_starts
from saltus.errors import ParameterError, near
from saltus.systems import System, check_along, check_path, check_system


def check_diagram(
    system: System, path: str, bounds: tuple[float, float], **counts: int
) -> tuple[float, float]:
    """The bounds as two numbers; raises a ParameterError for arguments with which the study would
    fail later.
    """
    check_system(system, "a diagram", several_contacts=True, multipliers=True, switches=True)
    if system.load.frequency is None:
        raise ParameterError(
            "cycles under a load without a frequency are not drawn in diagrams yet; give the Load"
            " one, or follow a cycle with find_orbit and continue_orbit",
            "load.frequency",
        )
    low, high = check_bounds(bounds)
    check_path(system, path)
    check_along(system, path, (low, high), "bounds")
    for name, count in counts.items():
        check_count(name, count, 1 if name in ("max_period", "starts") else 0)
        if name == "starts":
            check_starts(count)
    return low, high


@dataclass(frozen=True)
class ChaosSettings:
    """How chaos is looked for along a parameter."""

    # Forcing periods that a motion is given to come to rest or to repeat itself.
    settling: int = 300
    # Intervals in which something changes, or with chaos at an end, are halved down to this share
    # of the range, ...
    step: float = 1e-3
    # ... or to this one where motions have longer periods than `long_period`: cascades and narrow
    # bands are near.
    fine_step: float = 3e-4
    # Orbits of longer periods are many, and most have small basins: only those on which random
    # motions end are followed.
    long_period: int = 6
    # Factor by which both are larger between two values that are undecided, as where motions are on
    # tori.
    undecided: float = 1.0
    edge: float = 1e-4  # The bracket of an edge is halved down to this share of the range.
    # States of the chaos at each end of an interval from which motions are begun within it.
    seeds: int = 2
    # Settled motions at each end of an interval from which motions are begun within it.
    neighbours: int = 4
    # With several contacts, impacts slower than this belong to an accumulation. How many of them
    # were followed is no property of the motion, whose number of impacts is then taken as 0.
    dying: float = 1e-5
    states: int = 8  # Last states of each unsettled motion that are given to the judgement.
    # Distances from a special point, as shares of the range, at which motions are begun from its
    # orbit: narrow bands begin there.
    beside: tuple[float, ...] = (-4e-4, -1.5e-4, 1.5e-4, 4e-4)
    # Of special points that are nearer to one another than this share of the range, only one is
    # taken.
    spacing: float = 0.0
    # Special points are the same if their states differ by less than this, and their parameters by
    # less than this share of the range.
    same: float = 1e-7
    # Judgements of rising care, which exclude transients of mean lives below 660, 6600 and 33 000
    # forcing periods. The first one is made at all values, the others where `BandSearch.confirm`
    # finds the chaos doubtful. They count the time without settling of the judgement before; if
    # none settles, the second one then takes one round, and the third one three.
    judgements: tuple[JudgementSettings, ...] = (
        replace(JUDGEMENT, companions=8, exposure=2000, round_periods=500, rounds=2),
        replace(JUDGEMENT, companions=12, exposure=20_000, round_periods=1500),
        JUDGEMENT,
    )
    # The values of a band within this share of the range are judged together, by the sum of the
    # forcing periods in which none of their motions has settled.
    every: float = 0.02
    # Chaos next to transients must exclude mean lives this many times as long as theirs. Towards a
    # crisis, lives grow like a power between -1/2 and about -3/2 of the distance, so that the edge
    # is wrong by no more than the width of its bracket.
    longer: float = 3.0
    # The largest number of rounds in which edges are located and confirmed.
    confirmations: int = 20


CHAOS = ChaosSettings()


class Effort(StrEnum):
    """How much is tried for a diagram."""

    QUICK = "quick"  # a first picture
    STANDARD = "standard"  # the paper's figures
    THOROUGH = "thorough"  # also motions with basins of a thousandth of the window


@dataclass(frozen=True)
class EffortSettings:
    """What is simulated and followed for a diagram."""

    # Values of the parameter, evenly from bound to bound: what exists between two of them only may
    # be missed.
    values: int
    # Initial states at each value: a basin of a smaller share of the window than 1 / starts may be
    # missed there.
    starts: int
    # Forcing periods that a motion is given to settle; slow ones up to 8 times as many.
    periods: int
    # Values at which repelling orbits are searched for; elsewhere their branches are followed.
    repelling_values: int
    # Once there are this many branches, those born on others are not followed any more; so many
    # repelling orbits are followed.
    branches: int
    # The most branches of orbits that are stable in a small part of the range only, as in windows
    # of chaos.
    narrow: int
    # Rounds in which motions are started beyond the ends of stable parts of branches, to see where
    # they fall to.
    jumps: int
    # Random motions of the sample by which the share of states is estimated that end on what the
    # diagram lacks.
    sample: int
    # The most samples: what one shows to be missing is followed, then a new one is drawn, until one
    # shows nothing missing.
    samples: int
    # Further forcing periods for random motions that have not settled outside chaos: three times
    # the mean life that is excluded for chaos (6600, with one judgement 660), so that of transients
    # with this life one in twenty is left.
    lasting: int = 20_000
    # How finely bands of chaos are resolved, and how surely transients are excluded.
    chaos: ChaosSettings = CHAOS


EFFORTS = {
    Effort.QUICK: EffortSettings(
        values=61,
        starts=8,
        periods=200,
        repelling_values=13,
        branches=20,
        narrow=8,
        jumps=0,
        sample=300,
        samples=1,
        lasting=2000,
        # Motions with exponents below about 0.004 per unit of time, such as those on tori, are left
        # undecided, and so are orbits with multipliers above about 0.97: they would take most of
        # the time.
        chaos=replace(
            CHAOS,
            step=4e-3,
            fine_step=2e-3,
            undecided=5.0,
            edge=1e-3,
            judgements=(replace(CHAOS.judgements[0], longest_run=400, patience=1000),),
            beside=(-4e-4, 4e-4),
            spacing=1e-2,
        ),
    ),
    Effort.STANDARD: EffortSettings(
        values=201,
        starts=24,
        periods=400,
        repelling_values=25,
        branches=30,
        narrow=1000,
        jumps=2,
        sample=1000,
        samples=3,
    ),
    Effort.THOROUGH: EffortSettings(
        values=801,
        starts=64,
        periods=1000,
        repelling_values=49,
        branches=60,
        narrow=1000,
        jumps=2,
        sample=5000,
        samples=5,
        chaos=replace(
            CHAOS, step=5e-4, fine_step=1.5e-4, edge=5e-5, judgements=CHAOS.judgements[1:]
        ),
    ),
}


def read_effort(effort: Any) -> Effort:
    """The effort of this name.

    Raises
    ------
    ParameterError
        There is none.
    """
    try:
        return Effort(effort)
    except ValueError:
        raise ParameterError(
            f"there is no effort {effort!r}; {near(str(effort), list(Effort))}", "effort"
        ) from None
