"""Bands of chaos along a parameter: stroboscopic states of simulated motions, and the exponents by which chaos is judged."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from saltus.plots.axis_names import parameter_name, symbol, unit_in_brackets
from saltus.plots.conventions import DOUBLE_COLUMN, INK, new_figure, outside_legend
from saltus.plots.diagram import draw_stroboscopic_states
from saltus.plots.drawing import drawing
from saltus.plots.exponents import NAME, ZERO
from saltus.plots.response import BAND_NAMES, BANDS, draw_bands

VERDICTS = {"undecided": "x", "chaotic": "o", "transient": "^", "periodic": "s", "quasi_periodic": "D"}


@drawing
def draw_chaotic_bands(tree: Any, *, ax: Axes | None = None, figure: Figure | None = None) -> Any:
    """Draw the tree of `chaotic_bands`: states at phase 0 above, exponents of unsettled motions below; returns both axes.

    Into given axes only the states at phase 0 are drawn.
    """
    if ax is not None:
        return _draw_states(ax, tree)
    figure = new_figure(DOUBLE_COLUMN, 120.0) if figure is None else figure
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    _draw_states(above, tree).set_xlabel("")
    handles: list[Any] = [Patch(color=BANDS["CH"], label=BAND_NAMES["CH"])] if tree["bands"].sizes["band"] else []
    handles += _draw_deciding_exponents(below, tree)
    if handles:
        outside_legend(figure, handles=handles, ncols=4)
    return np.array([above, below])


def _draw_states(ax: Axes, tree: Any) -> Axes:
    ax.set_xlim(*(float(x) for x in tree.attrs["bounds"]))
    draw_stroboscopic_states(ax, tree)
    states, name = tree["stroboscopic"], symbol(tree.attrs["coordinate"])
    ax.set_ylabel(f"${name}$ at phase 0{unit_in_brackets(states['position'])}")
    ax.set_xlabel(parameter_name(tree.attrs["path"]))
    return ax


def _draw_deciding_exponents(below: Axes, tree: Any) -> list[Any]:
    """The exponents of unsettled motions, with a mark for each verdict; returns the handles of the marks for a legend."""
    below.axhline(0.0, **ZERO)
    draw_bands(below, tree)
    handles = []
    table = tree["exponents"]
    verdict, marked = table["verdict"].values, table["verdict"].attrs
    for number, meaning in zip(marked["flag_values"], marked["flag_meanings"].split(), strict=True):
        here = (verdict == number) & np.isfinite(table["exponent"].values)
        if here.any():
            columns = (table[column].values[here] for column in ("value", "exponent", "error"))
            marks: dict[str, Any] = {"color": INK, "fmt": VERDICTS[meaning], "ms": 3.0, "mfc": "white", "lw": 0.6, "mew": 0.6}
            handles.append(below.errorbar(*columns, capsize=1.5, label=f"exponent, 95 %: {meaning.replace('_', '-')}", **marks))
    if not np.isfinite(table["exponent"].values).any():
        below.text(0.5, 0.5, "all motions settle", transform=below.transAxes, ha="center", va="bottom")
        below.set_yticks([0.0])
    below.set_ylabel(NAME)
    below.set_xlabel(parameter_name(tree.attrs["path"]))
    return handles
