"""Families of peak ratios over a logarithmic stiffness ratio."""

from __future__ import annotations

from typing import Any

from saltus.plots.conventions import DASHES, shades


def draw_family(ax: Any, family: Any, names: list[str], title: str) -> None:
    """Curves ratio(curve, stiffness_ratio) with dots simulated(curve, dot), which differ in shade and dashes."""
    colours = shades(family.sizes["curve"])
    for i, (name, colour) in enumerate(zip(names, colours, strict=True)):
        ax.plot(family["stiffness_ratio"], family["ratio"][i], color=colour, ls=DASHES[i], lw=1.2, label=name)
        ax.plot(family["dot"], family["simulated"][i], color=colour, ls="none", marker="o", ms=3.2, clip_on=False, zorder=4)
    ax.set_xscale("log")
    ax.set_xlim(1, float(family["stiffness_ratio"][-1]))
    ax.set_ylim(0, 1.03)
    ax.set_xlabel("stiffness ratio $k$")
    ax.legend(title=title, loc="upper right")
