"""What a panel of Figs. 14 and 15 amounts to in numbers: areas of the plane, and the onset along V."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots import curves_of

PERIOD_ONE, TWICE = 1, 2  # the first motion: one forcing period, two impacts in it


def cells(panel: Any) -> dict[str, np.ndarray]:
    """The chart's arrays over (vertical, horizontal), with the quasi-static domain where rest is the only equilibrium, `static`.

    The line V = 0, on which there is no such domain, and Hhat = 0, where no load moves anything, are left out.
    """
    chart, static = panel["chart"].to_dataset(), panel["static"].to_dataset()
    inside = chart.isel(vertical=chart["vertical"] < 0, horizontal=chart["horizontal"] > 0)
    border = np.interp(inside["vertical"].values, static["vertical"].values, static["true"].values)
    found = {name: inside[name].values for name in ("amplitude", "count", "unsettled", "motion_amplitude", "motion_period")}
    found["motion_impact_count"] = inside["motion_impact_count"].values
    found["static"] = inside["horizontal"].values[None, :] < border[:, None]
    found["rest_alone"] = (found["count"] == 0) & (found["unsettled"] == 0)
    found["horizontal"], found["vertical"] = inside["horizontal"].values, inside["vertical"].values
    return found


def lost(panel: Any) -> float:
    """The share of the quasi-static monostable domain in which dynamics adds a motion beside rest."""
    here = cells(panel)
    return float((here["static"] & ~here["rest_alone"]).sum() / max(here["static"].sum(), 1))


def gained(panel: Any) -> float:
    """The cells outside of that domain in which nothing but rest is left, as a share of the domain."""
    here = cells(panel)
    return float((~here["static"] & here["rest_alone"]).sum() / max(here["static"].sum(), 1))


def onset(panel: Any, vertical: np.ndarray) -> np.ndarray:
    """The least Hhat at V on the folds of the first motion (one period, two impacts), from the exact curves; NaN without one."""
    least = np.full(len(vertical), np.nan)
    for curve in curves_of(panel):
        if str(curve.attrs["kind"]) != "LP" or (int(curve.attrs["period"]), int(curve.attrs["impact_count"])) != (
            PERIOD_ONE,
            TWICE,
        ):
            continue
        least = np.fmin(least, _least_at(curve, vertical))
    return least


def _least_at(curve: Any, vertical: np.ndarray) -> np.ndarray:
    """The least Hhat at which a curve goes through each V."""
    h, v = curve["horizontal"].values, curve["vertical"].values
    least = np.full(len(vertical), np.nan)
    for a in range(len(v) - 1):
        low, high = sorted((v[a], v[a + 1]))
        between = (vertical >= low) & (vertical <= high) & (high > low)
        share = (vertical[between] - v[a]) / (v[a + 1] - v[a])
        least[between] = np.fmin(least[between], h[a] + share * (h[a + 1] - h[a]))
    return least


def lost_by_curves(panel: Any) -> float:
    """The same share as `lost` by the exact curves: the area between the onset of the first motion and the static border.

    NaN where that onset is not followed all along, or is no border of its own.
    """
    static = panel["static"].to_dataset()
    inside = (static["vertical"].values < 0) & (static["true"].values > 0)
    vertical, border = static["vertical"].values[inside], static["true"].values[inside]
    begins = np.minimum(onset(panel, vertical), border)
    return float(1 - np.trapezoid(begins, vertical) / np.trapezoid(border, vertical))


def others(panel: Any, period: int, impact_count: int) -> np.ndarray:
    """Cells, (vertical, horizontal), with a motion of so many forcing periods and impacts in them."""
    here = cells(panel)
    return np.asarray(((here["motion_period"] == period) & (here["motion_impact_count"] == impact_count)).any(axis=2))
