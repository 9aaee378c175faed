"""Where a stability chart and its exact borders do not agree."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.studies.chart.border_curves import explained, unseen_folds
from saltus.studies.chart.borders import Borders
from saltus.studies.chart.changes import changes_of, keys_of, read_chart

if TYPE_CHECKING:
    import xarray


def disagreements(chart: xarray.Dataset, borders: Borders) -> xarray.Dataset:
    """Where chart and curves do not agree, away from the cells through which the curves run.

    Returns:
        A Dataset with the changes along `change` that neither a curve nor a special point between the two cells explains:
        `horizontal` and `vertical` halfway between the cells, `amplitude` and `period` of the motion that ends, `cells` of its
        family, whether the neighbour has rest alone, `beside_rest`, and whether the change was `looked_into`; and along
        `unseen` the places on the curves of folds beside which no cell has the motions that end there. The attributes
        `changes` and `changes_beside_rest` count all that there are, `on_curves` those that a curve explains, `harmless` those
        where the same motion goes on, with another amplitude than expected or too small to count; `chaos_beside_rest` counts
        pairs of neighbouring cells, one with rest alone and one where no start settles, between which no motion ends but chaos.
    """
    import xarray as xr

    cells = read_chart(chart)
    changes = changes_of(cells)
    endings = [borders.endings.get(key) for key in keys_of(cells, changes)]
    on_curves = explained(cells, changes, borders.curves)
    harmless = np.array([e is not None and not e.outcome.is_change for e in endings], dtype=bool) & ~on_curves
    known = on_curves | np.array([e is not None and e.outcome.is_explained for e in endings], dtype=bool)
    left = changes.only(~known)
    middle, unseen = (left.source + left.target) / 2, unseen_folds(cells, borders.curves)
    columns = {
        "amplitude": cells.motions["amplitude"][left.motion],
        "period": cells.motions["period"][left.motion],
        "cells": cells.family_size[left.motion],
        "beside_rest": cells.monostable[tuple(left.target.T)],
        "looked_into": np.array([e is not None for e in endings], dtype=bool)[~known],
    }
    data = {name: ("change", values) for name, values in columns.items()}
    for i, (name, axis) in enumerate((("vertical", cells.vertical), ("horizontal", cells.horizontal))):
        data[name] = ("change", np.interp(middle[:, i], np.arange(len(axis)), axis))
        data[f"unseen_{name}"] = ("unseen", np.interp(unseen[:, i], np.arange(len(axis)), axis))
    number = chart.transpose("vertical", "horizontal", ...)
    chaos = ((number["count"] == 0) & (number["unsettled"] > 0)).values
    attrs = {
        "changes": len(changes),
        "changes_beside_rest": int(cells.monostable[tuple(changes.target.T)].sum()),
        "on_curves": int(on_curves.sum()),
        "harmless": int(harmless.sum()),
        "chaos_beside_rest": _neighbours(chaos, cells.monostable),
    }
    return xr.Dataset(data, attrs=attrs)


def _neighbours(some: np.ndarray, others: np.ndarray) -> int:
    """How many pairs of neighbouring cells there are, one of each kind."""
    pairs = ((some[1:], others[:-1]), (some[:-1], others[1:]), (some[:, 1:], others[:, :-1]), (some[:, :-1], others[:, 1:]))
    return int(sum((a & b).sum() for a, b in pairs))
