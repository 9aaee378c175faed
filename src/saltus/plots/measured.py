"""Pictures of what is measured of a motion: its energy balance, and the fit of a system to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.plots.conventions import LOOK, axes_or_new, drawing, shades

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@drawing
def draw_energies(dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column) -> Axes:
    """Draw the dataset of `energies`: the mean power of each part as a bar, by its role; returns the axes."""
    parts = [str(name) for name in dataset["part"].values]
    ax = axes_or_new(ax, width, 14.0 + 6.0 * len(parts))
    roles = dataset["role"].values
    for role, colour in zip(("supplied", "dissipated", "stored"), shades(3), strict=True):
        chosen = np.flatnonzero(roles == role)
        ax.barh(chosen, dataset["power"].values[chosen], height=0.6, color=colour, label=role)
    ax.axvline(0.0, color="k", linewidth=0.6)
    ax.set_yticks(range(len(parts)), parts)
    ax.invert_yaxis()
    ax.set_xlabel("mean power")
    ax.set_ylabel("part")
    ax.legend(loc="best")
    return ax


@drawing
def draw_fit(dataset: Any, *, ax: Axes | None = None, width: float = 1.3 * LOOK.single_column) -> Axes:
    """Draw the dataset of a `fit`: what was measured as dots, the motion as lines; of impact times alone by how much the motion
    misses them; returns the axes."""
    ax = axes_or_new(ax, width, 0.62 * width)
    kinds = list(dict.fromkeys(zip(dataset["record"].values.tolist(), dataset["quantity"].values.tolist(), strict=True)))
    sampled = [kind for kind in kinds if kind[1] != "impacts"]
    for (record, quantity), colour in zip(sampled or kinds, shades(len(sampled or kinds)), strict=True):
        chosen = (dataset["record"].values == record) & (dataset["quantity"].values == quantity)
        time, measured, model, sigma = (dataset[n].values[chosen] for n in ("time", "measured", "model", "sigma"))
        label = quantity if len({r for r, _ in kinds}) == 1 else f"{quantity} of record {record}"
        if sampled:
            ax.plot(time, measured, ".", color=colour, markersize=2.5, alpha=0.5, zorder=1)
            ax.plot(time, model, "-", color=colour, linewidth=0.9, label=label, zorder=2)
        else:
            ax.errorbar(time, model - measured, sigma, fmt="o", color=colour, markersize=3, capsize=2, label=label)
            ax.axhline(0.0, color="k", linewidth=0.6)
    ax.set_xlabel(r"$\tau$")
    ax.set_ylabel("measured (dots), motion (lines)" if sampled else "time of the motion less that measured")
    ax.legend(loc="best")
    return ax
