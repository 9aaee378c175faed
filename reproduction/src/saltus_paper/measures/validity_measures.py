"""For which share of the motions in Figs. 9 to 13 the reduced model is valid (errata 20, 21)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus import branches_of
from saltus.plots import ModelValidity, smooth_lines
from saltus_paper.claims.claim import Measured, measured

# The least reactions by two equations agree within this, relative above 1: one of them is taken at
# instants.
AGREED = 0.01


def validity(figure: str, panels: Mapping[str, Any]) -> Measured:
    """As the reduction assumes: no stable motion opens the closed layer. Errata 20 and 21: which
    share of them does, and how far.

    `panels` has the label of each panel as key. The second kind of evidence are the rows of `eomnl`
    along simulated motions.
    """
    found = {label: shares(tree) for label, tree in panels.items()}
    violated, beyond = ([one[name] for one in found.values()] for name in ("violated", "beyond"))
    checks = [tree["closed_layer"] for tree in panels.values()]
    stored, simulated = (
        np.concatenate([one[name].values for one in checks]) for name in ("stored", "simulated")
    )
    longest = np.concatenate([one["share"].values for one in checks])[simulated < 0]
    off = np.abs(stored - simulated) / np.maximum(1.0, np.abs(stored))
    return measured(
        max(violated) == 0.0,
        max(violated) > 0.0,
        second=bool(stored.size) and bool((off < AGREED).all()) and bool((longest > 0.0).any()),
        figure=figure,
        panels=[{"panel": label, **one} for label, one in found.items()],
        least=min(violated),
        most=max(violated),
        farthest=max(beyond),
        motions=stored.size,
        wrong=longest.size,
        longest=longest.max(initial=0.0),
        off=off.max(initial=0.0),
    )


def shares(spectrum: Any) -> dict[str, float]:
    """Shares of the stable parts of all branches, by length in the parameter within the range of
    the study:

    `violated`, where an assumption of the model fails or a limit is passed, and `beyond`, where a
    limit is passed.
    """
    low, high = spectrum.attrs["bounds"]
    length = dict.fromkeys(ModelValidity, 0.0)
    for _, branch in branches_of(spectrum):
        for line in smooth_lines(branch):
            if line.stable:
                length[line.validity] += float(
                    np.abs(np.diff(np.clip(line.places[:, 0], low, high))).sum()
                )
    total = sum(length.values()) or 1.0
    beyond = length[ModelValidity.LIMIT] / total
    return {"violated": length[ModelValidity.ASSUMPTION] / total + beyond, "beyond": beyond}
