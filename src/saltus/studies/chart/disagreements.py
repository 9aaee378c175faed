"""Where a stability chart and its exact borders do not agree."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.checks import check_dataset
from saltus.public_functions import answered
from saltus.studies.chart.border_curves import explained, unseen_folds
from saltus.studies.chart.borders import Borders
from saltus.studies.chart.cell_outcomes import CellOutcome
from saltus.studies.chart.changes import changes_of, read_chart
from saltus.studies.chart.endings import ChangeOutcome
from saltus.studies.chart.sampled_ends import sampled_ends
from saltus.systems import System

if TYPE_CHECKING:
    import xarray


@answered
def disagreements(chart: xarray.Dataset, borders: Borders) -> xarray.Dataset:
    """Where chart and curves do not agree, away from the cells through which the curves run.

    Parameters
    ----------
    chart
        A chart as `stability_chart` or `with_borders` returns it.
    borders
        Its borders, as `with_borders` returns them.

    Returns
    -------
    xarray.Dataset
        A Dataset. Along `change` it has the changes for which it is not known what becomes of the motion, and which no curve
        explains: `horizontal` and `vertical` halfway between the cells, `amplitude` and `period` of the motion that ends, `cells`
        (the number of motions in its family), and `beside_rest`, whether the neighbour has rest alone. Along `unseen` it has the
        places on curves of folds beside which no cell has the motions that end there. Attributes: `changes` and
        `changes_beside_rest` count all changes; `located` counts those with an enclosed end of the motion, `on_curves` those that
        a curve explains, `harmless` those where the same motion goes on, with another amplitude than expected or too small to
        count. `sampled` is the number of located ends that were also solved for by continuation, `sampled_agree` the number of
        these that lie where simulation has enclosed them. `chaos_beside_rest` counts pairs of neighbouring cells, one with rest
        alone and one with chaos alone, between which chaos ends but no stable motion.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4)
    >>> chart, borders = saltus.studies.with_borders(system, chart)
    >>> saltus.studies.disagreements(chart, borders).attrs["located"]
    0
    """
    import xarray as xr

    check_dataset(chart, "stability_chart", ("vertical", "horizontal", "count", "amplitude"), ("least",), name="chart")
    cells = read_chart(chart)
    changes = changes_of(cells)
    found = borders.of(cells, changes)
    kinds = [ChangeOutcome(outcome) for outcome in found["outcome"]]
    ends, harmless = (np.array([getattr(k, name) for k in kinds], dtype=bool) for name in ("is_end", "is_harmless"))
    on_curves = explained(cells, changes, borders.curves) & ~harmless
    left = changes.only(~(on_curves | ends | harmless))
    middle, unseen = (left.source + left.target) / 2, unseen_folds(cells, borders.curves)
    columns = {
        "amplitude": cells.motions["amplitude"][left.motion],
        "period": cells.motions["period"][left.motion],
        "cells": cells.family_size[left.motion],
        "beside_rest": cells.monostable[tuple(left.target.T)],
    }
    data = {name: ("change", values) for name, values in columns.items()}
    for i, (name, axis) in enumerate((("vertical", cells.vertical), ("horizontal", cells.horizontal))):
        data[name] = ("change", np.interp(middle[:, i], np.arange(len(axis)), axis))
        data[f"unseen_{name}"] = ("unseen", np.interp(unseen[:, i], np.arange(len(axis)), axis))
    chaos = (chart["outcome"] == CellOutcome.CHAOS).transpose("vertical", "horizontal").values
    path = chart.attrs["path"]
    sample = sampled_ends(System.from_json(chart.attrs["system"]), (str(path[0]), str(path[1])), cells, borders)
    attrs = {
        "changes": len(changes),
        "changes_beside_rest": int(cells.monostable[tuple(changes.target.T)].sum()),
        "located": int(ends.sum()),
        "on_curves": int(on_curves.sum()),
        "sampled": int(np.isfinite(sample).sum()),
        "sampled_agree": int(np.nansum(sample)),
        "harmless": int(harmless.sum()),
        "chaos_beside_rest": _neighbours(chaos, cells.monostable),
    }
    return xr.Dataset(data, attrs=attrs)


def _neighbours(some: np.ndarray, others: np.ndarray) -> int:
    """The number of pairs of neighbouring cells of which one is among `some` and the other among `others`."""
    pairs = ((some[1:], others[:-1]), (some[:-1], others[1:]), (some[:, 1:], others[:, :-1]), (some[:, :-1], others[:, 1:]))
    return int(sum((a & b).sum() for a, b in pairs))
