"""The numbers and statements of sections 2 to 5 that no figure bears on."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from saltus.paper.claims import statements_dynamics, statements_impacts, statements_kinematics, statements_vibrations
from saltus.paper.claims.claim import Claim
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.provenance import tree

SECTIONS: dict[str, ModuleType] = {
    "kinematics": statements_kinematics,
    "dynamics": statements_dynamics,
    "impacts": statements_impacts,
    "vibrations": statements_vibrations,
}


def compute() -> Any:
    """The evidence of every section."""
    return tree(
        {name: section.compute() for name, section in SECTIONS.items()}, what="evidence for the statements of sections 2 to 5"
    )


def claims(data: Any) -> list[Claim]:
    """The claims of every section, in the order of the paper."""
    return [claim for name, section in SECTIONS.items() for claim in section.claims(data[name])]


FIGURE = PaperFigure(
    name="claims",
    title="Statements of sections 2 to 5",
    caption="Formulas and statements of sections 2 to 5 that no figure bears on, each with what was computed to judge it.",
    compute=compute,
    claims=claims,
)
