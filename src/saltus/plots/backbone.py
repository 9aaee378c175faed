"""A backbone: the amplitude over the frequency of free orbits, drawn as responses to a load are."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from saltus.plots.axis_names import symbol, unit_in_brackets
from saltus.plots.conventions import INK, SINGLE_COLUMN, axes_or_new
from saltus.plots.drawing import drawing

BACKBONE_LINE: dict[str, Any] = {"color": INK, "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.1}


@drawing
def draw_backbone(dataset: Any, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw the dataset of `backbone`: amplitudes over the frequencies of the free orbits; returns the axes."""
    ax = axes_or_new(ax, width, 0.75 * width)
    ax.plot(dataset["frequency"].values, dataset["amplitude"].values, **BACKBONE_LINE)
    ax.set_xlabel(r"frequency $2\pi/T$ of free motions")
    ax.set_ylabel(f"${symbol(dataset.attrs['coordinate'])}$ at the turning point{unit_in_brackets(dataset['amplitude'])}")
    return ax
