"""The numbers of a cell of the metainterface, which its reduced model, its two-layer model and chains of cells share."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from saltus.checks import RADIANS, settle_numbers
from saltus.systems.model import Model


@dataclass(frozen=True, slots=True, kw_only=True)
class LayeredCell(Model):
    """A cell of two layers, the lower one with the index 1 and the upper one with 2, dimensionless (paper, `m_k_ratio`)."""

    beta0: float = field(metadata=RADIANS)  # angle of the undeformed cell, in (0, pi)
    damping: float = 0.0  # C, at least 0
    stiffness_ratio: float = 1.0  # k = K1 / K2, above 0
    mass_ratio: float = 0.0  # m = M1 / M2, at least 0
    dissipation_ratio: float = 1.0  # c = C1 / C2, at least 0

    channels: ClassVar[tuple[str, ...]] = (
        "horizontal",
        "vertical",
        "lower_horizontal",
        "lower_vertical",
        "ground_horizontal",
        "ground_vertical",
    )

    def __post_init__(self) -> None:
        settle_numbers(self, "beta0", above=0.0, below=math.pi)
        settle_numbers(self, "stiffness_ratio", above=0.0)
        settle_numbers(self, "damping", "mass_ratio", "dissipation_ratio", at_least=0.0)

    @property
    def cell_numbers(self) -> dict[str, Any]:
        """The numbers of the cell, from which another model of it can be made."""
        return {each.name: getattr(self, each.name) for each in fields(LayeredCell)}
