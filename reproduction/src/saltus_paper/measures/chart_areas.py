"""The panels of Figs.

14 and 15 in numbers: areas of the plane of the loads, and the onset of motions over V.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.plots import border_curves

FIRST_MOTION = (1, 2)  # one forcing period, two impacts in it


@dataclass(frozen=True, eq=False)
class ChartCells:
    """A chart's cells over (vertical, horizontal).

    The line V = 0, on which rest is nowhere the only equilibrium, and Hhat = 0, where no load moves
    anything, are left out.
    """

    horizontal: np.ndarray
    vertical: np.ndarray
    amplitude: np.ndarray
    count: np.ndarray  # the number of motions beside rest
    static: np.ndarray  # whether rest is the only equilibrium of the quasi-static loads
    only_rest: np.ndarray  # whether every motion came to rest
    motion_period: np.ndarray  # (vertical, horizontal, motion)
    motion_impact_count: np.ndarray

    def with_motion(self, period: int, impact_count: int) -> np.ndarray:
        """Cells with a motion of so many forcing periods and impacts in them."""
        return np.asarray(
            ((self.motion_period == period) & (self.motion_impact_count == impact_count)).any(
                axis=2
            )
        )


def chart_cells(panel: Any) -> ChartCells:
    """The cells of a panel."""
    chart = panel["chart"].to_dataset()
    static = panel["static"].to_dataset()
    inside = chart.isel(vertical=chart["vertical"] < 0, horizontal=chart["horizontal"] > 0)
    horizontal = inside["horizontal"].values
    vertical = inside["vertical"].values
    border = np.interp(vertical, static["vertical"].values, static["true"].values)
    names = ("amplitude", "count", "motion_period", "motion_impact_count")
    return ChartCells(
        horizontal=horizontal,
        vertical=vertical,
        static=horizontal[None, :] < border[:, None],
        only_rest=(inside["count"].values == 0) & (inside["unsettled"].values == 0),
        **{name: inside[name].values for name in names},
    )


def lost(panel: Any) -> float:
    """The share of the quasi-static monostable domain in which dynamics adds a motion beside
    rest.
    """
    cells = chart_cells(panel)
    return float((cells.static & ~cells.only_rest).sum() / max(cells.static.sum(), 1))


def gained(panel: Any) -> float:
    """The cells outside the quasi-static monostable domain in which there is rest alone, as a share
    of the domain.
    """
    cells = chart_cells(panel)
    return float((~cells.static & cells.only_rest).sum() / max(cells.static.sum(), 1))


def outside(panel: Any) -> float:
    """The cells outside the domain in which there is rest alone, as a share of the cells outside
    the domain.
    """
    cells = chart_cells(panel)
    return float((~cells.static & cells.only_rest).sum() / max((~cells.static).sum(), 1))


def onset(panel: Any, vertical: np.ndarray) -> np.ndarray:
    """The least Hhat at V on the folds of the first motion, from the exact curves; NaN without
    one.
    """
    least = np.full(len(vertical), np.nan)
    for curve in border_curves(panel):
        motion = (int(curve.attrs["period"]), int(curve.attrs["impact_count"]))
        if str(curve.attrs["kind"]) == "LP" and motion == FIRST_MOTION:
            least = np.fmin(least, _least_at(curve, vertical))
    return least


def _least_at(curve: Any, vertical: np.ndarray) -> np.ndarray:
    """The least Hhat at which a curve goes through each V."""
    h = curve["horizontal"].values
    v = curve["vertical"].values
    least = np.full(len(vertical), np.nan)
    for a in range(len(v) - 1):
        low, high = sorted((v[a], v[a + 1]))
        between = (vertical >= low) & (vertical <= high) & (high > low)
        share = (vertical[between] - v[a]) / (v[a + 1] - v[a])
        least[between] = np.fmin(least[between], h[a] + share * (h[a + 1] - h[a]))
    return least


def lost_by_curves(panel: Any) -> float:
    """The share `lost`, from the exact curves: the area between the onset of the first motion and
    the static border.

    NaN if the curve of the onset does not extend over all V, or is no border of rest.
    """
    static = panel["static"].to_dataset()
    inside = (static["vertical"].values < 0) & (static["true"].values > 0)
    vertical = static["vertical"].values[inside]
    border = static["true"].values[inside]
    begins = np.minimum(onset(panel, vertical), border)
    return float(1 - np.trapezoid(begins, vertical) / np.trapezoid(border, vertical))
