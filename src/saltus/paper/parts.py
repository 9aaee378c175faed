"""The parts of the paper by name, in its order."""

from __future__ import annotations

from saltus.paper.figures import (
    appendix,
    fig01c,
    fig02,
    fig03,
    fig04,
    fig05,
    fig06,
    fig07,
    fig08,
    fig09,
    fig10,
    fig11,
    fig12,
    fig13,
    fig14,
    fig15,
    quasi,
    table1,
)
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.sections import statements

FIGURES: dict[str, PaperFigure] = {
    part.FIGURE.name: part.FIGURE
    for part in (
        *(fig01c, fig02, fig03, fig04, fig05, fig06, fig07, fig08),
        *(fig09, fig10, fig11, fig12, fig13),
        *(fig14, fig15, quasi),
        *(table1, appendix, statements),
    )
}
