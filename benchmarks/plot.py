"""The picture: time against error on one core, and throughput on all of them."""

from __future__ import annotations

import io
from typing import Any

from saltus.plots.conventions import LOOK, new_figure, panel_label, style

# Okabe and Ito's colours, near ones for one package; and a marker for each code, for greyscale and
# the colour-blind
LOOKS = {
    "saltus lanes": ("#0072B2", "o", "-"),
    "saltus scalar": ("#56B4E9", "s", "-"),
    "heyoka.py batch": ("#D55E00", "^", (0, (6, 1.5))),
    "heyoka.py scalar": ("#E69F00", "v", (0, (6, 1.5))),
    "diffrax Dopri8": ("#009E73", "D", (0, (3, 1.2))),
    "diffrax Tsit5": ("#009E73", "P", (0, (1, 1.2))),
    "SciPy DOP853": ("#CC79A7", "X", (0, (5, 1.2, 1, 1.2))),
    "SciPy LSODA": ("#CC79A7", "*", (0, (1, 1.2))),
    "prototype lanes": ("#000000", "h", (0, (1, 1.2))),
}


def draw(results: dict[str, Any]) -> bytes:
    """Both panels, as a PNG file."""
    with style():
        figure = new_figure(width=LOOK.double_column, height=95.0)
        left, right = figure.subplots(1, 2)
        for name in dict.fromkeys(row["peer"] for row in results["work"]):
            _work_precision(left, name, [row for row in results["work"] if row["peer"] == name])
            _throughput(right, name, [row for row in results["throughput"] if row["peer"] == name])
        left.set(
            xscale="log",
            yscale="log",
            xlabel="largest error over 16 motions (rad, rad per unit time)",
        )
        left.set_ylabel(r"processor time a trajectory-period ($\mu$s)")
        left.invert_xaxis()
        right.set(
            xscale="log",
            yscale="log",
            xlabel="tolerance asked for",
            ylabel="trajectory-periods a second, all cores",
        )
        right.invert_xaxis()
        for ax, label in ((left, "a"), (right, "b")):
            ax.grid(True, color=LOOK.faint, linewidth=0.4)
            panel_label(ax, label)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        picture = io.BytesIO()
        figure.savefig(picture, format="png")
    return picture.getvalue()


def _look(name: str) -> dict[str, Any]:
    color, marker, dashes = LOOKS.get(name, ("#000000", "o", ":"))
    return {
        "color": color,
        "marker": marker,
        "linestyle": dashes,
        "markersize": 4.5,
        "markerfacecolor": "white",
    }


def _work_precision(ax: Any, name: str, rows: list[dict[str, Any]]) -> None:
    spread = [[r["median"] - r["low"] for r in rows], [r["high"] - r["median"] for r in rows]]
    ax.errorbar(
        [r["error"] for r in rows],
        [r["median"] for r in rows],
        yerr=spread,
        label=name,
        capsize=1.5,
        **_look(name),
    )


def _throughput(ax: Any, name: str, rows: list[dict[str, Any]]) -> None:
    look = _look(name)
    if rows and rows[0]["measured"]:
        # filled: measured on all cores; hollow: extrapolated from one
        look["markerfacecolor"] = look["color"]
    ax.plot([r["tol"] for r in rows], [r["rate"] for r in rows], **look)
