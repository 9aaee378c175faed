"""A verdict: the states on which the motion ends, and the sentence that gives the reason."""

from __future__ import annotations

import textwrap
from typing import Any

from matplotlib.axes import Axes

from saltus.plots.axis_names import plane_of, state_label
from saltus.plots.conventions import INK, SINGLE_COLUMN, STABLE_LINE, axes_or_new
from saltus.plots.drawing import drawing

LINE_LENGTH = 62  # characters of the sentence above a picture of one column


@drawing
def draw_verdict(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the states at phase 0 on which a motion ends, its orbit if there is one, and the verdict's sentence; returns `ax`."""
    own, ax = ax is None, axes_or_new(ax, width, 0.85 * width)
    plane = plane_of(dataset)
    states = [dataset[f"section_{name}"].values for name in plane]
    many = len(states[0]) > 64
    if f"curve_{plane[0]}" in dataset:
        ax.plot(*(dataset[f"curve_{name}"].values for name in plane), label="its orbit", **STABLE_LINE)
    ax.plot(
        *states, ls="none", marker="o", color=INK, ms=1.2 if many else 4.5, mew=0.0, label="states at phase 0", rasterized=many
    )
    ax.set_xlabel(state_label(dataset, f"section_{plane[0]}", plane))
    ax.set_ylabel(state_label(dataset, f"section_{plane[1]}", plane))
    ax.legend(loc="best", markerscale=4.0 if many else 1.0)
    if own:
        sentence = f"{dataset['kind'].values}: {dataset['reason'].values}".replace("+-", "\u00b1")
        ax.set_title("\n".join(textwrap.wrap(sentence, LINE_LENGTH)), loc="left", fontsize=8)
    return ax
