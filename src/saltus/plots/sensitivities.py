"""The derivatives of a motion's end by its start and by parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm

from saltus.plots.axis_names import parameter_symbol, state_symbol
from saltus.plots.conventions import INK, axes_or_new
from saltus.plots.drawing import drawing

ENTRY_WIDTH = 18.0  # mm, of one derivative
DARKEST = 6.0  # black would stand for this many times the largest derivative, so that numbers on the shades can be read


@drawing
def draw_sensitivities(dataset: Any, *, ax: Axes | None = None, width: float | None = None) -> Axes:
    """Draw the derivatives as a table of numbers, a row for each state variable at the end, darker if larger; returns `ax`."""
    derivative = np.asarray(dataset["derivative"].values, dtype=float)
    names, to = ([str(name) for name in dataset[dim].values] for dim in ("state", "to"))
    size = (ENTRY_WIDTH * len(to) + 34.0 if width is None else width, 12.0 * len(names) + 26.0)
    ax = axes_or_new(ax, *size)
    plane = names[0], names[len(names) // 2]
    largest = float(np.nanmax(np.abs(derivative), initial=0.0)) or 1.0
    ax.imshow(np.abs(derivative), cmap="Greys", norm=PowerNorm(0.5, 0.0, DARKEST * largest), aspect="auto")
    for (row, column), value in np.ndenumerate(derivative):
        text = f"{value:.4g}".replace("-", "\u2212") if np.isfinite(value) else "undefined"
        ax.text(column, row, text, ha="center", va="center", color=INK)
    starts = [name.removeprefix("start_") for name in to]
    symbols = [
        rf"${state_symbol(start, plane)}(\tau_0)$" if start != name else parameter_symbol(name)
        for start, name in zip(starts, to, strict=True)
    ]
    ax.set_xticks(range(len(to)), symbols)
    ax.set_yticks(range(len(names)), [rf"${state_symbol(name, plane)}(\tau)$" for name in names])
    ax.tick_params(length=0.0)
    ax.set_xlabel("with respect to")
    ax.set_ylabel("derivative of")
    ax.set_title(rf"derivatives at the end, $\tau={float(dataset.attrs['end_time']):.6g}$", loc="left")
    return ax
