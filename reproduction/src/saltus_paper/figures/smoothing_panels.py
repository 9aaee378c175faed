"""The panels of the figure on the smoothed sign: branches, errors over B, errors over the work."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.plots import LOOK, new_figure, panel_label, smooth_lines, styled

BOUNDS = (0.2, 1.0)  # Omega
REGULAR = 0.6  # Omega of an orbit without a special point nearby
# by B
SHADES = {
    50.0: "#e08a1e",
    200.0: "#8e5ea2",
    1000.0: "#4f8f5b",
    5000.0: "#7a7a7a",
    20000.0: "#1a1a1a",
}
MARKERS = {"LP": "o", "BPC": "s", "GR": "D"}
KIND_NAMES = {"LP": "fold", "BPC": "symmetry breaking", "GR": "grazing"}
SHOWN = (50.0, 200.0, 1000.0)  # B that are drawn
WINDOW = (0.2655, 0.2875)  # Omega of the superharmonic resonance that is drawn, with its grazings
HEIGHTS = (0.985, 1.085)  # max |theta| there


@styled
def draw(data: Any) -> Any:
    """(a) the spectrum, (b) its superharmonic resonance, (c) errors over B, (d) errors over the
    work.
    """
    figure = new_figure(LOOK.double_column, 150.0)
    axes = figure.subplots(2, 2)
    _draw_branches(axes[0, 0], data, SHOWN[:1], apart=True)
    _draw_branches(axes[0, 1], data, SHOWN)
    _draw_settled(axes[0, 1], data["confirmed"])
    _draw_errors(axes[1, 0], data["features"])
    _draw_work(axes[1, 1], data["work"])
    axes[0, 0].set_xlim(*BOUNDS)
    axes[0, 0].set_ylim(bottom=0.0)
    frame = (WINDOW[0], HEIGHTS[0], WINDOW[1] - WINDOW[0], HEIGHTS[1] - HEIGHTS[0])
    axes[0, 0].indicate_inset(bounds=frame, edgecolor=LOOK.ink, alpha=1.0)
    axes[0, 0].annotate(
        "(b)", (WINDOW[0], HEIGHTS[1]), textcoords="offset points", xytext=(-4, 4), ha="center"
    )
    axes[0, 1].set_xlim(*WINDOW)
    axes[0, 1].set_ylim(*HEIGHTS)
    axes[0, 1].set_xticks([0.27, 0.275, 0.28, 0.285])
    for ax, label in zip(axes.flat, "abcd", strict=True):
        panel_label(ax, label)
    return figure


def _draw_branches(ax: Any, data: Any, shown: tuple[float, ...], apart: bool = False) -> None:
    """The exact branch in the conventions of all spectra, and smoothed ones in shades, dashed where
    they are unstable; the special points of the superharmonic resonance, which lie on one another,
    are not drawn where it has a panel `apart`."""
    for name in ("exact", "broken"):
        _draw_branch(
            ax,
            data[name].to_dataset(),
            {"linewidth": 1.6, "zorder": 3},
            "exact" if name == "exact" else None,
        )
    for b in shown:
        look = {"color": SHADES[b], "linewidth": 0.9, "zorder": 4}
        _draw_branch(ax, data[f"B{b:g}"].to_dataset(), look, rf"$\mathcal{{B}}={b:g}$")
    exact = data["exact"].to_dataset()
    for kind, marker in MARKERS.items():
        place = exact["special_parameter"].values
        here = (exact["kind"].values == kind) & ~(apart & (place > WINDOW[0]) & (place < WINDOW[1]))
        if not here.any():
            continue
        ax.plot(
            exact["special_parameter"].values[here], exact["special_amplitude"].values[here],
            linestyle="none", marker=marker, markersize=4.0, markerfacecolor="white", color=LOOK.ink, zorder=5,
            label=KIND_NAMES[kind],
        )  # fmt: skip
    ax.set_xlabel(r"frequency $\Omega$")
    ax.set_ylabel(r"$\max|\theta|$ (rad)")
    ax.legend(loc="upper left")


def _draw_branch(ax: Any, branch: Any, look: dict[str, Any], label: str | None) -> None:
    for i, part in enumerate(smooth_lines(branch)):
        kind = LOOK.stable_line if part.stable else LOOK.unstable_line
        ax.plot(*part.places.T, **kind | look, label=None if i else label)


def _draw_settled(ax: Any, confirmed: Any) -> None:
    """The amplitudes on which exact motions from the states of smoothed orbits settle, as dots."""
    here = confirmed["sharpness"].values == SHOWN[0]
    ax.plot(
        confirmed["frequency"].values[here], confirmed["settled"].values[here],
        linestyle="none", marker="o", markersize=2.6, color=LOOK.stable, zorder=4, label=(r"exact motion from "
                                                                                         r"there"),
    )  # fmt: skip
    ax.legend(loc="upper left", ncols=2, columnspacing=1.0)


def _draw_errors(ax: Any, features: Any) -> None:
    """How far each special point, the knot and an ordinary amplitude are from the exact ones."""
    sharpness = features["sharpness"].values[1:]
    looks = iter(("o-", "s-", "^-", "v-", "D-", "x--", "+--"))
    rows = {
        str(name): features["frequency"].values[:, i]
        for i, name in enumerate(features["feature"].values)
    }
    rows |= {
        "knot of the primary resonance": features["knot"].values,
        rf"$\max|\theta|$ at $\Omega={REGULAR:g}$": features["regular"].values,
    }
    for name, values in rows.items():
        ax.loglog(
            sharpness,
            abs(values[1:] - values[0]),
            next(looks),
            markersize=3.0,
            linewidth=0.8,
            markerfacecolor="white",
            label=name,
        )
    guide = np.array([40.0, 1000.0])
    ax.loglog(guide, 3e-4 / guide**2, color=LOOK.faint, linewidth=0.8, zorder=1)
    ax.annotate(
        r"$\mathcal{B}^{-2}$",
        (guide[0], 3e-4 / guide[0] ** 2),
        textcoords="offset points",
        xytext=(-14, -2),
        color=LOOK.ink,
    )
    ax.set_xlabel(r"$\mathcal{B}$")
    ax.set_ylabel("distance from the exact value")
    ax.set_ylim(1e-15, 0.1)
    ax.legend(loc="lower left", fontsize=7.0)


def _draw_work(ax: Any, work: Any) -> None:
    """Errors over evaluations: one line for each B, and the exact equation from impact to
    impact.
    """
    for sharpness, evaluations, error in zip(
        work["sharpness"].values, work["evaluations"].values, work["error"].values, strict=True
    ):
        exact = math.isinf(sharpness)
        label = "exact, impact by impact" if exact else rf"$\mathcal{{B}}={sharpness:g}$"
        colour = LOOK.stable if exact else SHADES[sharpness]
        ax.loglog(
            evaluations,
            error,
            "o-",
            color=colour,
            markersize=3.0,
            linewidth=1.4 if exact else 0.9,
            label=label,
        )
    ax.set_xlabel("evaluations of the right-hand side in 20 periods")
    ax.set_ylabel("error of the last state")
    ax.set_ylim(top=0.5)
    ax.legend(loc="upper right", ncols=2, columnspacing=1.0)
