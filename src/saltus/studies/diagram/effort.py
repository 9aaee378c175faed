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
    THOROUGH = "thorough"  # also motions with basins of a thousandth of the window


@dataclass(frozen=True)
class EffortSettings:
    """What is simulated and followed for a diagram."""

    values: int  # Values of the parameter, evenly from bound to bound: what exists between two of them only may be missed.
    starts: int  # Initial states at each value: a basin of a smaller share of the window than 1 / starts may be missed there.
    periods: int  # Forcing periods that a motion is given to settle; slow ones up to 8 times as many.
    repelling_values: int  # Values at which repelling orbits are searched for; elsewhere their branches are followed.
    # Once there are this many branches, those born on others are not followed any more; so many repelling orbits are followed.
    branches: int
    narrow: int  # The most branches of orbits that are stable in a small part of the range only, as in windows of chaos.
    jumps: int  # Rounds in which motions are started beyond the ends of stable parts of branches, to see where they fall to.
    sample: int  # Random motions of the sample by which the share of states is estimated that end on what the diagram lacks.
    # The most samples: what one shows to be missing is followed, then a new one is drawn, until one shows nothing missing.
    samples: int
    # Further forcing periods for random motions that have not settled outside chaos: three times the mean life that is excluded
    # for chaos (6600, with one judgement 660), so that of transients with this life one in twenty is left.
    lasting: int = 20_000
    chaos: ChaosSettings = CHAOS  # How finely bands of chaos are resolved, and how surely transients are excluded.


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
        # Motions with exponents below about 0.004 per unit of time, such as those on tori, are left undecided, and so are orbits
        # with multipliers above about 0.97: they would take most of the time.
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
