"""The picture: AUTO's branches over the exact one near the folds and near the grazing, and the
folds' errors against B.
"""

from __future__ import annotations

import io
from typing import Any

from auto.case import KNOWN
from saltus.plots.conventions import LOOK, new_figure, panel_label, style

COLORS = ("#E69F00", "#56B4E9", "#009E73", "#D55E00")  # Okabe and Ito
MARKERS = ("v", "s", "D", "^")
SHOWN = 0.5  # the amplitude whose branch grazes
NEAR_FOLDS = ((0.84, 0.912), (1.9, 2.8))
NEAR_GRAZING = ((0.2842, 0.2854), (1.025, 1.065))


def draw(results: dict[str, Any]) -> bytes:
    """Three panels, as a PNG file: the finest mesh of each B in the first two."""
    with style():
        figure = new_figure(width=LOOK.double_column, height=80.0)
        folds, grazing, errors = figure.subplots(1, 3)
        _branches(folds, results, NEAR_FOLDS)
        _branches(grazing, results, NEAR_GRAZING)
        _marks(folds, grazing)
        _errors(errors, results)
        for ax, label in zip((folds, grazing, errors), "abc", strict=True):
            panel_label(ax, label)
        handles, labels = folds.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
        picture = io.BytesIO()
        figure.savefig(picture, format="png")
    return picture.getvalue()


def _branches(
    ax: Any, results: dict[str, Any], window: tuple[tuple[float, float], tuple[float, float]]
) -> None:
    exact = results["curve"]
    ax.plot(
        exact["omega"], exact["amplitude"], color=LOOK.ink, linewidth=1.6, label="saltus, exact"
    )
    # the last mesh of each
    finest = {row["sharpness"]: row for row in results["auto"] if row["amplitude"] == SHOWN}
    for (sharpness, row), color, marker in zip(finest.items(), COLORS, MARKERS, strict=False):
        curve = row["curve"]
        ax.plot(curve["omega"], curve["amplitude"], color=color, marker=marker, markersize=3, linewidth=0.6,
                markerfacecolor="none", markeredgewidth=0.6, label=("AUTO, B = "
                                                                   f"{sharpness:g}"))  # fmt: skip
    ax.set(xlim=window[0], ylim=window[1], xlabel=r"$\Omega$", ylabel=r"$\max\,|\theta|$")


def _marks(folds: Any, grazing: Any) -> None:
    known = KNOWN[SHOWN]
    for omega in known.folds:
        folds.axvline(omega, color=LOOK.faint, linewidth=0.6, zorder=0)
    grazing.set_xticks([0.2844, 0.2848, 0.2852])
    grazing.plot(known.grazing, known.grazing_amplitude, "*", color=LOOK.ink, markersize=8)
    grazing.annotate(
        "grazing",
        (known.grazing, known.grazing_amplitude),
        (-5, -2),
        textcoords="offset points",
        ha="right",
        va="top",
    )


def _errors(ax: Any, results: dict[str, Any]) -> None:
    """The larger error of the two folds against B, a line for each mesh, hollow where H = 1."""
    rows = results["auto"]
    for mesh, color, marker in zip(
        dict.fromkeys(row["mesh"] for row in rows),
        (*COLORS, LOOK.ink),
        (*MARKERS, "o"),
        strict=False,
    ):
        for amplitude in KNOWN:
            points = [(r["sharpness"], max(r["fold_errors"])) for r in rows
                      if r["mesh"] == mesh and r["amplitude"] == amplitude and None not in r["fold_errors"]]  # fmt: skip
            if points:
                filled, name = (color, mesh) if amplitude == SHOWN else ("white", None)
                look = {
                    "color": color,
                    "marker": marker,
                    "markerfacecolor": filled,
                    "markersize": 4,
                    "linewidth": 0.7,
                }
                ax.plot(*zip(*points, strict=True), label=name, **look)
    ax.set(
        xscale="log",
        yscale="log",
        xlabel=r"$B$",
        ylabel=r"larger error of the two folds in $\Omega$",
    )
    ax.grid(True, color=LOOK.faint, linewidth=0.4)
    ax.legend(title="mesh", title_fontsize=8, loc="lower left", handlelength=1.4)
    ax.set_ylim(bottom=1e-9)
