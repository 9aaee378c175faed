"""Where border curves are begun: ends of similar motions that lie beside one another are taken as points of one border."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.studies.chart.changes import Changes, ChartMotions
from saltus.studies.chart.endings import ENDS, is_symmetric
from saltus.studies.chart.motions import ALIKE


@dataclass(frozen=True)
class BorderStartSettings:
    """Which borders are worth a curve."""

    reach: float = 1.5  # Ends no farther than this from one another, in cells, may lie on one border.
    fewest: int = 3  # The least number of ends on a border that is followed.
    beside_rest: int = 10  # An end beside cells with rest alone counts this many times, as designers ask for the border of rest.
    tries: int = 8  # The largest number of ends of a border from which its curve is tried to be begun.
    beyond: float = 0.5  # Orbits are followed this far beyond the end of their motion, in cells.


SETTINGS = BorderStartSettings()


def border_starts(chart: ChartMotions, changes: Changes, endings: np.ndarray) -> list[list[dict[str, Any]]]:
    """For each border, the most important ones first, the motions from whose ends its curve may be begun."""
    rows = np.flatnonzero(np.isin(endings["outcome"], ENDS))
    number, weight = _borders(chart, changes.only(rows), endings[rows])
    size = np.bincount(number)
    total = np.bincount(number, weights=weight)
    chosen = sorted(np.flatnonzero(size >= SETTINGS.fewest), key=lambda border: -total[border])
    return [list(_from(chart, changes, endings, rows[number == border])) for border in chosen]


def places(changes: Changes, endings: np.ndarray) -> np.ndarray:
    """Where motions end, row and column in cells, (n, 2): halfway between the last place where a motion has settled and the first
    place where it is lost."""
    share = 0.5 * (endings["settled"] + endings["next"]["share"])
    return np.asarray(changes.source + share[:, None] * (changes.target - changes.source))


def _borders(chart: ChartMotions, changes: Changes, endings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The number of the border on which each end lies, and the weight of each end."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    last, spot = endings["last"], places(changes, endings)
    if not len(last):
        return np.zeros(0, dtype=int), np.zeros(0)
    one, other = cKDTree(spot).query_pairs(SETTINGS.reach, output_type="ndarray").T
    amplitude = last["amplitude"]
    like = np.abs(amplitude[one] - amplitude[other]) <= ALIKE.family * np.maximum(amplitude[one], amplitude[other])
    for values in (last["period"], is_symmetric(last), endings["outcome"]):
        like &= values[one] == values[other]
    graph = coo_array((np.ones(like.sum()), (one[like], other[like])), shape=(len(last), len(last)))
    number = connected_components(graph, directed=False)[1]
    return number, np.where(chart.monostable[tuple(changes.target.T)], SETTINGS.beside_rest, 1)


def _from(chart: ChartMotions, changes: Changes, endings: np.ndarray, rows: np.ndarray) -> Iterator[dict[str, Any]]:
    """The motions nearest to the middle of a border, as the starts of its curve."""
    spot = places(changes, endings)[rows]
    middle = np.median(spot, axis=0)
    axes = (chart.horizontal, chart.vertical)
    for i in rows[np.argsort(np.abs(spot - middle).sum(axis=1), kind="stable")[: SETTINGS.tries]]:
        source, target, last = changes.source[i], changes.target[i], endings["last"][i]
        along = 0 if source[0] == target[0] else 1
        shares = (last["share"], max(endings["next"]["share"][i] + SETTINGS.beyond, 1.0))
        here, beyond = ([_at(axes[k], source[1 - k] + share * (target - source)[1 - k]) for k in (0, 1)] for share in shares)
        state = [float(value) for value in last["state"]]
        yield {"state": state, "period": int(last["period"]), "place": here, "along": along, "goal": beyond[along]}


def _at(axis: np.ndarray, place: float) -> float:
    """The value of a parameter at a place in cells, within the chart."""
    return float(np.interp(place, np.arange(len(axis)), axis))
