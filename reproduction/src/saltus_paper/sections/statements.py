"""The numbers and statements of sections 2 to 5 that no figure bears on."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from saltus_paper.claims.claim import Measured
from saltus_paper.figure_data import tree
from saltus_paper.figures.figure import paper_figure
from saltus_paper.sections import (
    equations_of_motion,
    impacts,
    kinematics,
    large_amplitude,
    misalignment,
    small_vibrations,
)

SECTIONS: dict[str, ModuleType] = {
    "kinematics": kinematics,
    "misalignment": misalignment,
    "dynamics": equations_of_motion,
    "impacts": impacts,
    "vibrations": small_vibrations,
    "amplitudes": large_amplitude,
}


def compute() -> Any:
    """The evidence of every section."""
    groups = {name: section.compute() for name, section in SECTIONS.items()}
    return tree(groups, what="evidence for the statements of sections 2 to 5")


def measure(data: Any) -> dict[str, Measured]:
    """What every section measured."""
    return {
        id: one
        for name, section in SECTIONS.items()
        for id, one in section.measure(data[name]).items()
    }


FIGURE = paper_figure("claims", compute=compute, measure=measure)
