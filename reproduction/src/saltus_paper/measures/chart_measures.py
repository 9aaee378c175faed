"""Measures for the statements of the text on Figs. 14 and 15, a number for each trend.

The panels of a figure are given in a mapping by the value in which they differ, in rising order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.attractors import share_interval
from saltus.theory import high_frequency_onset
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.measures.chart_areas import (
    chart_cells,
    gained,
    lost,
    lost_by_curves,
    onset,
    outside,
)

Panels = Mapping[float, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartCriteria:
    """The numbers by which the statements on Figs. 14 and 15 are judged."""

    # Between these frequencies of Fig. 14 amplitudes are largest on average.
    primary: tuple[float, float] = (0.75, 1.0)
    # Below this Omega, far below resonance, motions follow the loads and nothing is anticipated.
    slow: float = 0.25
    narrow: float = 0.15  # A region is narrow below this share of the quasi-static domain.
    # For at most this share of the changes may it be unknown what becomes of the motion.
    few: float = 0.02
    # At most this share of the ends that were solved for may lie outside of their enclosures by
    # simulation.
    apart: float = 0.1
    # The upper end of the 95 % interval of the share of wrong cells must be below this.
    wrong: float = 0.05
    slight: float = 0.15  # Relative differences below this are slight.


CRITERIA = ChartCriteria()
ROWS = np.linspace(-1.2, -0.2, 41)  # V at which the onset is compared
REFERENCE_V = np.array([-0.5])  # V at which the onset is given in the evidence


def over_frequency(data: Any) -> dict[str, Measured]:
    """Fig. 14."""
    panels = dict(sorted((float(tree.attrs["frequency"]), tree) for tree in data.children.values()))
    return {
        "fig14-anticipates": _anticipates(panels),
        "fig14-frequency": _grows_with_frequency(panels),
        "fig14-amplitude": _largest_amplitude(panels),
        "fig14-second": _second_motion(panels),
        "fig14-onset": _onset(panels),
        "fig14-closed-form": _closed_form(panels),
        "fig14-agreement": agreement(data),
        "fig14-cells": right_cells(data),
    }


def _anticipates(panels: Panels) -> Measured:
    """As printed: at every frequency motions appear before the quasi-static border. Erratum 34: not
    far below resonance, where even more cells have rest alone."""
    rows = [
        {"frequency": w, "lost": lost(tree), "gained": gained(tree), "outside": outside(tree)}
        for w, tree in panels.items()
    ]
    always = bool(rows) and all(row["lost"] > row["gained"] for row in rows)
    fast = bool(rows) and all(
        (row["lost"] > row["gained"]) == (row["frequency"] > CRITERIA.slow) for row in rows
    )
    return measured(always, fast, panels=rows)


def _grows_with_frequency(panels: Panels) -> Measured:
    shares = [lost(tree) for tree in panels.values()]
    exact = [{"frequency": w, "share": lost_by_curves(tree)} for w, tree in panels.items()]
    return measured(
        len(shares) > 1 and bool((np.diff(shares) > 0).all()),
        panels=[{"frequency": w, "share": share} for w, share in zip(panels, shares, strict=True)],
        exact=[row for row in exact if math.isfinite(row["share"])],
    )


def _largest_amplitude(panels: Panels) -> Measured:
    """As printed: the largest amplitude of a chart is at the frequency nearest to 1. Erratum 45:
    the mean one is largest between 0.75 and 1, over the loads that every chart shows; the largest
    ones are not."""
    widest = min(float(tree["chart"]["horizontal"].max()) for tree in panels.values())
    rows = []
    for frequency, tree in panels.items():
        cells = chart_cells(tree)
        shared = np.nan_to_num(cells.amplitude[:, cells.horizontal <= widest])
        largest = float(np.nanmax(cells.amplitude, initial=0.0))
        rows.append(
            {
                "frequency": frequency,
                "largest": largest,
                "shared": float(shared.max()),
                "mean": float(shared.mean()),
            }
        )
    tops = {
        name: max(rows, key=lambda row: row[name])["frequency"]
        for name in ("largest", "shared", "mean")
    }
    nearest = min(panels, key=lambda w: abs(w - 1.0))
    printed = len(rows) > 1 and tops["largest"] == tops["shared"] == nearest
    on_average = len(rows) > 1 and CRITERIA.primary[0] <= tops["mean"] <= CRITERIA.primary[1]
    return measured(printed, on_average and not printed, widest=widest, panels=rows)


def _second_motion(panels: Panels) -> Measured:
    """As printed: a second motion exists in a narrow region. Erratum 33: in a strip below Hcr with
    six impacts, and in wide regions with longer periods."""
    fast = max(panels)
    cells = chart_cells(panels[fast])
    domain = cells.static
    period_three = cells.with_motion(3, 2)
    several = (cells.count >= 2) & domain
    share, six, three = (
        float((where & domain).sum() / max(domain.sum(), 1))
        for where in (several, cells.with_motion(1, 6), period_three)
    )
    first = float(cells.horizontal[period_three.any(axis=0)].min(initial=np.inf))
    found = bool(several.any())
    return measured(
        found and share < CRITERIA.narrow,
        found and share >= CRITERIA.narrow and six > 0.0,
        frequency=fast, several=share, six=six, three=three, first=first,
    )  # fmt: skip


def _onset(panels: Panels) -> Measured:
    frequency = min(panels, key=lambda w: abs(w - 1.0))
    value = float(onset(panels[frequency], REFERENCE_V)[0])
    border = panels[frequency]["static"]
    static = float(np.interp(REFERENCE_V, border["vertical"], border["true"])[0])
    return measured(value < 0.5 * static, frequency=frequency, onset=value, static=static)


def _closed_form(panels: Panels) -> Measured:
    fast = max(panels)
    attrs = panels[fast].attrs
    beta0 = math.radians(float(attrs["beta0_degrees"]))
    damping = float(attrs["damping"])
    known = [
        high_frequency_onset(fast, beta0=beta0, vertical=v, damping=damping, order=2) for v in ROWS
    ]
    away = _farthest(onset(panels[fast], ROWS) / np.array(known))
    return measured(away < 0.02, frequency=fast, low=ROWS[0], high=ROWS[-1], difference=away)


def agreement(data: Any) -> Measured:
    """Whether charts from simulation and orbits from continuation agree, for every motion of a cell
    that its neighbour lacks.
    """
    judged = []
    rows = []
    for tree in data.children.values():
        differ = tree["disagreements"].to_dataset()
        added = int(tree["chart"].attrs.get("added_by_continuation", 0))
        names = (
            "changes",
            "located",
            "on_curves",
            "harmless",
            "chaos_beside_rest",
            "sampled",
            "sampled_agree",
        )
        counted = {name: int(differ.attrs[name]) for name in names}
        unknown = differ.sizes["change"]
        judged += [counted["changes"] > 0 and unknown <= CRITERIA.few * counted["changes"]]
        judged += [
            counted["sampled"] > 0
            and counted["sampled_agree"] >= (1 - CRITERIA.apart) * counted["sampled"]
        ]
        rows.append({**_named(tree), "unknown": unknown, "added": added, **counted})
    return measured(bool(judged) and all(judged), panels=rows)


def right_cells(data: Any) -> Measured:
    """Whether cells of the charts agree with the same cells computed with four times as many starts
    on a finer grid.
    """
    names = ("checked_cells", "wrong_cells", "wrong_rest", "wrong_motions", "wrong_chaos")
    panels = list(data.children.values())
    counts = [{name: int(tree["chart"].attrs[name]) for name in names} for tree in panels]
    number, wrong = (sum(one[name] for one in counts) for name in ("checked_cells", "wrong_cells"))
    rows = [{**_named(tree), **one} for tree, one in zip(panels, counts, strict=True)]
    low, high = share_interval(wrong, number)
    share = wrong / number if number else math.nan
    return measured(
        high < CRITERIA.wrong,
        share=share,
        low=low,
        high=high,
        number=number,
        wrong=wrong,
        panels=rows,
    )


def _named(tree: Any) -> dict[str, float]:
    """The numbers by which the evidence names a panel."""
    beta0, damping = _parameters(tree)
    return {"frequency": float(tree.attrs["frequency"]), "beta0": beta0, "damping": damping}


def over_parameters(data: Any) -> dict[str, Measured]:
    """Fig. 15, against the reference."""
    panels = {_parameters(tree): tree for tree in data.children.values()}
    angles = dict(
        sorted((beta0, tree) for (beta0, damping), tree in panels.items() if damping == 0.1)
    )
    dampings = dict(
        sorted((damping, tree) for (beta0, damping), tree in panels.items() if beta0 == 80.0)
    )
    return {
        "fig15-angle-border": _border_and_angle(angles),
        "fig15-angle-place": _place_and_angle(angles),
        "fig15-angle-amplitude": _amplitude_falls(angles),
        "fig15-angle-cells": _some_grow(angles),
        "fig15-damping-amplitude": _amplitude_falls(dampings),
        "fig15-damping-domain": _domain_and_damping(dampings),
        "fig15-agreement": agreement(data),
        "fig15-cells": right_cells(data),
    }


def _parameters(tree: Any) -> tuple[float, float]:
    return round(float(tree.attrs["beta0_degrees"]), 6), round(float(tree.attrs["damping"]), 6)


def _border_and_angle(angles: Panels) -> Measured:
    """The shape of the border: its Hhat in units of the quasi-static border's at the same V."""
    ends = (min(angles), max(angles))
    one, two = (onset(angles[beta0], ROWS) for beta0 in ends)
    static = [np.abs(ROWS / math.tan(math.radians(beta0))) for beta0 in ends]
    place = _farthest(one / two)
    shape = _farthest((one / static[0]) / (two / static[1]))
    return measured(
        shape < CRITERIA.slight,
        low_angle=ends[0], high_angle=ends[1], low=ROWS[0], high=ROWS[-1], place=place, shape=shape,
    )  # fmt: skip


def _place_and_angle(angles: Panels) -> Measured:
    """The border's Hhat at the least angle over that at the largest one, beside the ratio of their
    Hcr.
    """
    ends = (min(angles), max(angles))
    ratio = onset(angles[ends[0]], ROWS) / onset(angles[ends[1]], ROWS)
    ratio = ratio[np.isfinite(ratio)]
    least, most = (float(ratio.min()), float(ratio.max())) if ratio.size else (np.inf, np.inf)
    static = math.tan(math.radians(ends[1])) / math.tan(math.radians(ends[0]))
    return measured(
        max(abs(least / static - 1), abs(most / static - 1)) < CRITERIA.slight,
        low_angle=ends[0], high_angle=ends[1], low=ROWS[0], high=ROWS[-1], least=least, most=most, static=static,
    )  # fmt: skip


def _farthest(ratio: np.ndarray) -> float:
    """By how much ratios differ from 1 at most; infinite where there are none."""
    known = ratio[np.isfinite(ratio)]
    return float(np.abs(known - 1).max()) if known.size else np.inf


def _amplitude_falls(panels: Panels) -> Measured:
    """Whether the largest amplitude in a chart falls from chart to chart."""
    rows = [
        {"value": value, "size": float(np.nanmax(chart_cells(tree).amplitude))}
        for value, tree in panels.items()
    ]
    return measured(
        len(rows) > 1 and bool((np.diff([row["size"] for row in rows]) < 0).all()), panels=rows
    )


def _some_grow(panels: Panels) -> Measured:
    """Whether in a part of the cells that have motions in two charts, more than can be wrong, the
    largest one grows.
    """
    shares = []
    for one, two in pairwise(chart_cells(tree).amplitude for tree in panels.values()):
        both = np.isfinite(one) & np.isfinite(two)
        shares.append({"share": float((two > one)[both].mean()) if both.any() else 0.0})
    return measured(
        bool(shares) and all(row["share"] > CRITERIA.wrong for row in shares), shares=shares
    )


def _domain_and_damping(dampings: Panels) -> Measured:
    filled = [float((~chart_cells(tree).only_rest).mean()) for tree in dampings.values()]
    begins = [float(onset(tree, REFERENCE_V)[0]) for tree in dampings.values()]
    holds = (
        len(filled) > 1 and bool((np.diff(filled) < 0).all()) and bool((np.diff(begins) > 0).all())
    )
    cases = zip(dampings, filled, begins, strict=True)
    return measured(
        holds, panels=[{"damping": c, "share": share, "onset": h} for c, share, h in cases]
    )
