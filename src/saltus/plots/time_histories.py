"""Time histories of several cases, scaled by the start and by the period."""

from __future__ import annotations

from typing import Any

from saltus.plots.conventions import DASHES, FAINT, shades


def draw_histories(ax: Any, data: Any, names: list[str], theta0: float) -> None:
    """theta(case, phase) / abs(theta0) over tau / T0, which differ in shade and dashes."""
    ax.axhline(0.0, color=FAINT, lw=1.2, zorder=0)
    for i, (name, colour) in enumerate(zip(names, shades(len(names)), strict=True)):
        ax.plot(data["phase"], data["theta"][i] / abs(theta0), color=colour, ls=DASHES[i], lw=1.1, label=name)
    ax.set_xlim(0, float(data["phase"][-1]))
    ax.set_ylim(-1.25, 3.9)
    ax.set_xlabel(r"$\tau\,/\,T_0$")
    ax.legend(loc="upper center", ncols=2, columnspacing=1.2)
