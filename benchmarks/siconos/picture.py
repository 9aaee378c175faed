"""The picture: the error of Siconos against its step, and the time of both against the error."""

from __future__ import annotations

import io
from typing import Any

from saltus.plots.conventions import LOOK, new_figure, panel_label, style

COLORS = ("#E69F00", "#56B4E9", "#009E73", "#D55E00", "#0072B2", "#CC79A7")  # Okabe and Ito
MARKERS = ("v", "s", "D", "^", "o", "P")


def draw(cases: list[dict[str, Any]]) -> bytes:
    """Two panels, as a PNG file."""
    with style():
        figure = new_figure(width=LOOK.double_column, height=95.0)
        left, right = figure.subplots(1, 2)
        for case, color, marker in zip(cases, COLORS, MARKERS, strict=True):
            look = {
                "color": color,
                "marker": marker,
                "markersize": 3.5,
                "linewidth": 0.8,
                "markeredgewidth": 0.7,
            }
            step, error, seconds = (
                [row[name] for row in case["siconos"]] for name in ("step", "error", "seconds")
            )
            left.plot(step, error, label=case["about"], **look)
            right.plot(error, seconds, **look)
            ours = [(max(row["error"], 1e-16), row["seconds"]) for row in case["saltus"]]
            right.plot(
                *zip(*ours, strict=True), **look | {"markerfacecolor": "white", "linestyle": "--"}
            )
        _first_order(left, cases)
        left.set(xlabel="step of Siconos", ylabel="error at the end")
        right.set(xlabel="error at the end", ylabel="processor time (s)")
        right.invert_xaxis()
        _kinds(right)
        for ax, label in zip((left, right), "ab", strict=True):
            ax.set(xscale="log", yscale="log")
            ax.grid(True, color=LOOK.faint, linewidth=0.4)
            panel_label(ax, label)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        picture = io.BytesIO()
        figure.savefig(picture, format="png")
    return picture.getvalue()


def _first_order(ax: Any, cases: list[dict[str, Any]]) -> None:
    """A line of slope 1 below all points."""
    step = [cases[0]["siconos"][i]["step"] for i in (-1, 0)]
    lowest = min(row["error"] / row["step"] for case in cases for row in case["siconos"])
    ax.plot(step, [0.5 * lowest * s for s in step], color=LOOK.ink, linewidth=0.8, linestyle=":")
    ax.annotate(
        "first order",
        (step[0] ** 0.5 * step[1] ** 0.5, 0.4 * lowest * (step[0] * step[1]) ** 0.5),
        ha="left",
        va="top",
    )


def _kinds(ax: Any) -> None:
    """Which lines are whose."""
    handles = [
        ax.plot([], [], color=LOOK.ink, marker="o", markersize=3.5, linewidth=0.8, label="Siconos")[
            0
        ]
    ]
    hollow = {"markerfacecolor": "white", "markersize": 3.5, "linewidth": 0.8}
    handles += ax.plot([], [], color=LOOK.ink, marker="o", linestyle="--", label="saltus", **hollow)
    ax.legend(handles=handles, loc="center right")
