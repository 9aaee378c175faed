"""A sample of the ends of a chart's motions, solved for by continuation: an independent check of the ends found by simulation."""

from __future__ import annotations

import numpy as np

from saltus.studies.chart.border_work import special_point
from saltus.studies.chart.borders import Borders
from saltus.studies.chart.changes import ChartMotions, changes_of
from saltus.studies.chart.endings import ENDS
from saltus.systems import System

SAMPLE = 60  # ends that are solved for
MARGIN = 0.02  # cells by which an end may lie outside its enclosure, as motions near their end settle slowly


def sampled_ends(
    system: System, paths: tuple[str, str], chart: ChartMotions, borders: Borders, count: int = SAMPLE
) -> np.ndarray:
    """For a sample of the motions that end between two cells, (n,): 1 if continuation of the orbit from the middle of its cell
    finds the special point where simulation has enclosed the end, 0 if elsewhere, nan if it finds none."""
    changes = changes_of(chart)
    found = borders.of(chart, changes)
    rows = np.flatnonzero(np.isin(found["outcome"], ENDS))
    chosen = rows[np.unique(np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int))] if len(rows) else rows
    result = np.full(len(chosen), np.nan)
    axes = (chart.horizontal, chart.vertical)
    for i, k in enumerate(chosen):
        source, target, motion = changes.source[k], changes.target[k], chart.motions[changes.motion[k]]
        along = 0 if source[0] == target[0] else 1
        axis, here, there = axes[along], source[1 - along], target[1 - along]
        place = [float(axes[n][source[1 - n]]) for n in (0, 1)]
        start = {"state": motion["state"], "period": motion["period"], "place": place, "along": along, "goal": axis[there]}
        special = special_point(system, paths, start)
        if special is not None:
            share = (special.parameter - axis[here]) / (axis[there] - axis[here])
            low, high = found["settled"][k] - MARGIN, found["next"]["share"][k] + MARGIN
            result[i] = low <= share <= high
    return result
