"""How much is tried for a diagram: one record of numbers for each level of effort."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from saltus.errors import ParameterError, near
from saltus.studies.diagram.chaos_settings import SETTINGS as CHAOS
from saltus.studies.diagram.chaos_settings import ChaosSettings


class Effort(StrEnum):
    """How much is tried for a diagram."""

    QUICK = "quick"  # a first picture
    STANDARD = "standard"  # the paper's figures
    THOROUGH = "thorough"  # motions that attract one state in a thousand


@dataclass(frozen=True)
class EffortSettings:
    """What is simulated and followed for a diagram."""

    values: int  # Values of the parameter, evenly from bound to bound: the least width of what is surely met.
    starts: int  # Initial states at each of them: what attracts less than 1 of these many states may be missed there.
    periods: int  # Forcing periods that a motion is given to settle; slow ones have 8 times as many.
    repelling_values: int  # Values at which repelling orbits are searched for: they are followed from one to the others.
    # With this number of branches, no more are followed that are born on others; and so many at most of orbits that repel.
    branches: int
    narrow: int  # Branches at most of motions that are stable in a small part of the range alone, as in windows of chaos.
    jumps: int  # Rounds in which motions are started beyond the ends of stable parts of branches, to see where they fall to.
    sample: int  # Motions of the sample that tells what share of the states ends on something that the diagram has not.
    # Samples at most: what one shows to be missing is followed, and the next one begins anew, until one shows nothing missing.
    samples: int
    # Forcing periods that random motions are given which have not settled where there is no chaos: transients of three times the
    # mean life that is excluded for chaos, 6600 or, with one judgement, 660, leave one in twenty.
    lasting: int = 20_000
    chaos: ChaosSettings = CHAOS  # How finely bands of chaos are resolved, and how surely they are none of transients.


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
        # Exponents of less than about 0.004 per unit of time are left undecided, as those of motions about tori are, and so are
        # multipliers above about 0.97: such motions would take most of the time.
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
        values=201, starts=24, periods=400, repelling_values=25, branches=30, narrow=1000, jumps=2, sample=1000, samples=3
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
        chaos=replace(CHAOS, step=5e-4, fine_step=1.5e-4, edge=5e-5, judgements=CHAOS.judgements[1:]),
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
        raise ParameterError(f"effort knows no {effort!r}; {near(str(effort), list(Effort))}", "effort") from None
