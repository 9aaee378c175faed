"""Features that the exact treatment adds to the paper's figures, counted in their data: grazings,
loops, bands, curves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

DIAGRAMS = ("fig09", "fig10", "fig11", "fig12", "fig13")
CHARTS = ("fig14", "fig15")
KINDS = ("LP", "PD", "BPC", "GR")
Table = list[tuple[str, ...]]  # the first row are the headings

DIAGRAM_HEADINGS = (
    *("panel", "branches", "loops", *KINDS, "bands of chaos", "their width", "edges explained"),
    "random states missed",
)
CHART_HEADINGS = (
    "panel",
    *(f"curves of {kind}" for kind in KINDS),
    "points on them",
    "changes between cells",
    "of them on a curve",
)


def diagram_features(folder: Path, present: Mapping[str, str]) -> Table:
    """A row for each panel of Figs.

    9 to 13 that is there; `present` has the figures' short titles by name.
    """
    rows = [
        row
        for name in DIAGRAMS
        if name in present
        for row in _rows(folder / f"{name}.nc", present[name], "special", _diagram)
    ]
    return [DIAGRAM_HEADINGS, *rows] if rows else []


def chart_features(folder: Path, present: Mapping[str, str]) -> Table:
    """A row for each panel of Figs. 14 and 15 that is there."""
    rows = [
        row
        for name in CHARTS
        if name in present
        for row in _rows(folder / f"{name}.nc", present[name], "borders", _chart)
    ]
    return [CHART_HEADINGS, *rows] if rows else []


def _rows(path: Path, title: str, mark: str, counted: Callable[[Any], tuple[str, ...]]) -> Table:
    """A row of counts for each panel: each group that has a child `mark`."""
    import h5netcdf

    with h5netcdf.File(path, "r") as file:
        return [
            (f"{title} ({name})", *counted(panel))
            for name, panel in file.groups.items()
            if mark in panel.groups
        ]


def _diagram(panel: Any) -> tuple[str, ...]:
    kinds = Counter(_names(panel["special"]["kind"]))
    bands = panel["bands"]
    closed = panel["branches"]["closed"][:]
    edges = [*_names(bands["low_edge"]), *_names(bands["high_edge"])]
    explained = sum(edge not in ("unknown", "undecided", "") for edge in edges)
    width = float((bands["high"][:] - bands["low"][:]).sum())
    return (
        *map(
            str,
            (
                len(closed),
                int(closed.sum()),
                *(kinds[kind] for kind in KINDS),
                bands.dimensions["band"].size,
            ),
        ),
        f"{width:.3f}",
        f"{explained} of {len(edges)}",
        f"{int(panel.attrs['missed'].item())} of {int(panel.attrs['sample'].item())}",
    )


def _chart(panel: Any) -> tuple[str, ...]:
    curves = [group for name, group in panel["borders"].groups.items() if name.startswith("curve")]
    kinds = Counter(str(curve.attrs["kind"]) for curve in curves)
    changes, on_curves = (
        int(panel["disagreements"].attrs[name].item()) for name in ("changes", "on_curves")
    )
    points = sum(len(curve["amplitude"]) for curve in curves)
    return (*(str(kinds[kind]) for kind in KINDS), str(points), str(changes), str(on_curves))


def _names(variable: Any) -> list[str]:
    return [value.decode() if isinstance(value, bytes) else str(value) for value in variable[:]]
