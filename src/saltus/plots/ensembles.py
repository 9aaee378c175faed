"""An ensemble over its one or two dimensions."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

from saltus.errors import ParameterError
from saltus.plots.axis_names import symbol, unit_in_brackets, varied
from saltus.plots.conventions import SINGLE_COLUMN, STABLE, axes_or_new
from saltus.plots.drawing import drawing
from saltus.plots.marks import cell_edges

OWN = ("period", "state", "column")  # dimensions within one motion, and not of the ensemble


@drawing
def draw_ensemble(dataset: Any, quantity: str | None = None, *, ax: Axes | None = None, width: float = SINGLE_COLUMN) -> Axes:
    """Draw a variable of `simulate_many`, by default the first coordinate at the end, over one dimension or two; returns `ax`.

    Raises
    ------
    ParameterError
        A variable that is not there, or that has no dimensions or more than two.
    """
    quantity = next(iter(dataset.data_vars)) if quantity is None else quantity
    if quantity not in dataset or not 1 <= dataset[quantity].ndim <= 2 or set(dataset[quantity].dims) & set(OWN):
        raise ParameterError(f"the ensemble has no {quantity!r} over one or two dimensions to draw", "quantity")
    values = dataset[quantity]
    axes = dict(varied(dataset, str(dim)) for dim in values.dims)
    ax = axes_or_new(ax, width, 0.75 * width)
    label = f"{symbol_of(quantity)}{unit_in_brackets(values)}"
    names = list(axes)
    ax.set_xlabel(names[0])
    if len(names) == 1:
        ax.plot(axes[names[0]], values.values, color=STABLE, marker=".", ms=3.0, lw=0.6)
        ax.set_ylabel(label)
        return ax
    mesh = ax.pcolormesh(*(cell_edges(axis) for axis in axes.values()), values.values.T, rasterized=True)
    ax.set_ylabel(names[1])
    ax.figure.colorbar(mesh, ax=ax, label=label)
    return ax


def symbol_of(quantity: str) -> str:
    """A coordinate's symbol, or a variable's name in words."""
    if quantity.startswith("theta") or len(quantity) == 1:
        return f"${symbol(quantity)}$ at the end"
    return quantity.replace("_", " ")
