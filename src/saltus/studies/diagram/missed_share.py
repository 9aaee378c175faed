"""The share of states that end on something which a diagram does not have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.attractors import share_interval


@dataclass(frozen=True)
class MissedShare:
    """The share of states that end on something which is not in the diagram, estimated by a sample of them."""

    missed: int = 0  # motions of the sample that end on such a thing
    sample: int = 0
    samples: int = 0  # how many samples were tried; this is the last one
    ended: int = 0  # motions of the sample that a limit of the model ends, so that it is not known where they would have gone

    @property
    def share(self) -> float:
        """The estimate; nan without a sample."""
        return self.missed / self.sample if self.sample else np.nan

    @property
    def ended_share(self) -> float:
        """The share of the sample that a limit of the model ends; nan without a sample."""
        return self.ended / self.sample if self.sample else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of a binomial share (Wilson's)."""
        return share_interval(self.missed, self.sample)
