"""The paper: one file per figure, the claims beside what is computed here, and the report.

`reproduce` makes every figure, table and claim that is not up to date; `FIGURES` holds them by name, in the paper's order.
"""

from saltus.paper.claims import statements
from saltus.paper.claims.claim import Claim, Verdict, tally
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
from saltus.paper.reproduce import Result, reproduce

FIGURES: dict[str, PaperFigure] = {
    part.FIGURE.name: part.FIGURE
    for part in (
        *(fig01c, fig02, fig03, fig04, fig05, fig06, fig07, fig08),
        *(fig09, fig10, fig11, fig12, fig13),
        *(fig14, fig15, quasi),
        *(table1, appendix, statements),
    )
}

__all__ = ["FIGURES", "Claim", "PaperFigure", "Result", "Verdict", "reproduce", "tally"]
