"""The parts of the paper by name, in its order."""

from __future__ import annotations

from importlib import import_module

from saltus_paper.figures.figure import PaperFigure

FIGURE_FILES = (
    *("fig01c", "fig02", "fig03", "table1"),
    *("fig04", "fig05", "fig06", "fig07", "smoothing", "fig08"),
    *("fig09", "fig10", "quasi", "fig11", "fig12", "fig13"),
    *("fig14", "fig15", "both_layers", "chain", "proofs", "appendix"),
)
FILES = (
    *(f"saltus_paper.figures.{name}" for name in FIGURE_FILES),
    "saltus_paper.sections.statements",
)
FIGURES: dict[str, PaperFigure] = {
    part.name: part for part in (import_module(file).FIGURE for file in FILES)
}

# The order in which parts are computed: long panels first, so that none of them runs alone at the
# end; after the first of these the parts that take a second each, so that their pictures are drawn
# while others are computed.
_LONG = (
    ("both_layers", "quasi", "chain", "fig14"),
    ("fig09", "fig11", "fig15", "fig12", "fig13", "fig10", "smoothing"),
)
ORDER = (*_LONG[0], *(name for name in FIGURES if name not in _LONG[0] + _LONG[1]), *_LONG[1])
