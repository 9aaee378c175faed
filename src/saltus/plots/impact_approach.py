"""Misalignment and difference angle as an impact is approached."""

from __future__ import annotations

from typing import Any

from saltus.plots.conventions import DASHES, FAINT, STABLE, UNSTABLE
from saltus.plots.marks import arrow_along

PHI: dict[str, Any] = {"color": UNSTABLE, "ls": DASHES[1], "lw": 1.2}
THETA: dict[str, Any] = {"color": STABLE, "ls": "-", "lw": 1.2}


def draw_history(ax: Any, data: Any) -> None:
    """abs(phi) and abs(theta) over tau - tau_*."""
    time = -data["to_go"].values
    ax.plot(time, abs(data["phi"].values), label=r"$|\varphi|$", **PHI)
    ax.plot(time, abs(data["theta"].values), label=r"$|\theta|$", **THETA)
    ax.axvline(0.0, color=FAINT, lw=0.8)
    ax.set_xlim(time[0], 0.08)
    ax.set_ylim(0, None)
    ax.set_xlabel(r"$\tau-\tau_*$")
    ax.set_ylabel(r"$|\varphi|,\ |\theta|$ (rad)")
    ax.legend(loc="lower left")


def draw_phase(ax: Any, data: Any, highest: float = 3.2) -> None:
    """The rates against the angles, cut off at the rate `highest`, which phi' passes on its way to infinity."""
    for name, style, label in (("phi", PHI, r"$|\varphi|$"), ("theta", THETA, r"$|\theta|$")):
        angle, rate = abs(data[name].values), abs(data[f"{name}_velocity"].values)
        ax.plot(angle, rate, label=label, **style)
        arrow_along(ax, angle, rate, 250, style["color"], size=8)
    ax.set_xlim(-0.02, None)
    ax.set_ylim(0, highest)
    ax.set_xlabel(r"$|\varphi|,\ |\theta|$ (rad)")
    ax.set_ylabel(r"$|\dot\varphi|,\ |\dot\theta|$")
    ax.annotate(
        r"$|\dot\varphi|\to\infty$", xy=(0.115, 0.97), xycoords=("data", "axes fraction"), ha="left", va="top", color=UNSTABLE
    )
    ax.legend(loc="center right")
