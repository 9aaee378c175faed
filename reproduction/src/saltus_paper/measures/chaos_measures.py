"""Measures for the statements of section 6 on chaotic and quasi-periodic motions in Figs. 9 to 13,
from the bands of chaos.

The panels of a figure are given in a mapping by the value in which they differ, in rising order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import System, branches_of, excludes_tori
from saltus.attractors import share_interval
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.measures.response_measures import Panels
from saltus_paper.measures.spectrum_features import amplitudes_at, count, stable_motions


@dataclass(frozen=True, slots=True, kw_only=True)
class ChaosCriteria:
    """The numbers by which the statements on chaos in Figs. 9 to 13 are judged."""

    inner: int = 200  # The number of values within a band at which stable motions are counted.
    high: float = 1.0  # Frequencies above this one are beyond the primary resonance.
    # The frequencies at which the paper sees chaos in Fig. 9, approximately.
    resonant: tuple[float, float] = (1.0, 2.0)
    # Chaos arises by collisions if they occur at more than this share of the edges of a known kind.
    collisions: float = 0.5
    # Bands whose gap is a larger share of the range are in different regions of chaos.
    apart: float = 0.05
    # Motions of more than this share of the largest stable amplitude of a diagram are large.
    large_motion: float = 0.5
    low: float = 0.5  # Superharmonic resonances are below this frequency.
    large_load: float = 2.0  # The paper sees chaos in the panels from this Hhat on.


CRITERIA = ChaosCriteria()
# the kinds of edges of bands that are known; the paper names two
EDGES = ("cascade", "grazing", "fold", "crisis", "bound")


def bands_of(spectrum: Any) -> list[dict[str, float]]:
    """The bands of chaos: `low`, `high` and the largest `exponent` of each."""
    table = spectrum["bands"]
    return [
        {name: float(table[name][i]) for name in ("low", "high", "exponent")}
        for i in range(table.sizes["band"])
    ]


def _width(spectrum: Any) -> float:
    return sum(band["high"] - band["low"] for band in bands_of(spectrum))


def _quasi_periodic(spectrum: Any, below: float) -> Measured:
    """Erratum 22: there are no tori but chaos, at frequencies below a given one."""
    reason = excludes_tori(System.from_json(str(spectrum.attrs["system"])))
    bands = bands_of(spectrum)
    chaos = any(band["high"] < below for band in bands)
    return measured(reason is None, reason is not None and chaos, reason=reason, bands=bands)


def force_spectra(panels: Panels) -> dict[str, Measured]:
    """Fig. 9, over the amplitudes of the force."""
    smallest = min(panels)
    largest = max(panels)
    return {
        "fig09-quasi-periodic": _quasi_periodic(panels[smallest], CRITERIA.low),
        "fig09-chaos": _widening(panels),
        "fig09-chaos-range": _around_resonance(panels),
        "fig09-collision": _collision(
            {load: tree for load, tree in panels.items() if load >= CRITERIA.large_load}
        ),
        "fig09-pierced": pierced(panels[largest], load=largest),
    }


def _widening(panels: Panels) -> Measured:
    rows = [{"load": load, "width": _width(tree)} for load, tree in panels.items()]
    large = [row["width"] for row in rows if row["load"] >= CRITERIA.large_load]
    small = [row["width"] for row in rows if row["load"] < CRITERIA.large_load]
    grows = (
        bool(large) and min(large) > max(small, default=0.0) and bool((np.diff(large) > 0).all())
    )
    return measured(grows, panels=rows)


def _around_resonance(panels: Panels) -> Measured:
    """As printed: chaos lies at Omega = 1 to 2.

    Erratum 37: some of it does not, though most of the bands' width does.
    """
    rows = []
    within = []
    most = []
    low, high = CRITERIA.resonant
    for load, tree in panels.items():
        bands = bands_of(tree)
        width = _width(tree)
        if load >= CRITERIA.large_load:
            inside = sum(
                max(0.0, min(band["high"], high) - max(band["low"], low)) for band in bands
            )
            within.append(
                width > 0.0
                and all(0.9 * low <= band["low"] and band["high"] <= 1.05 * high for band in bands)
            )
            most.append(inside > 0.5 * width)
            rows.append({"load": load, "inside": inside, "width": width, "bands": bands})
    return measured(bool(rows) and all(within), bool(rows) and all(most), panels=rows)


def _collision(panels: Panels) -> Measured:
    """Whether motions collide at most of the bands' edges about the resonance whose kind is known:
    a stable orbit with an unstable one at a fold, or the chaotic attractor with an unstable orbit
    at a crisis.

    Narrow windows are found by chance, so the edges are a sample: the 95 % interval of the share
    decides, unless it contains the limit.
    """
    rows = []
    for load, tree in panels.items():
        table = tree["bands"]
        value, kinds = (
            np.concatenate([table[f"{edge}{more}"].values for edge in ("low", "high")])
            for more in ("", "_edge")
        )
        within = (value >= CRITERIA.resonant[0]) & (value <= CRITERIA.resonant[1])
        number = Counter(map(str, kinds[within]))
        known = sum(number[kind] for kind in EDGES if kind != "bound")
        rows.append(
            {
                "load": load,
                "known": known,
                "unknown": number.total() - known,
                **{kind: number[kind] for kind in EDGES},
            }
        )
    shares = [share_interval(int(row["fold"] + row["crisis"]), int(row["known"])) for row in rows]
    most = all(low > CRITERIA.collisions for low, _ in shares)
    few = any(high < CRITERIA.collisions for _, high in shares)
    return measured(most if rows and most != few else None, panels=rows)


def _stable_shares(spectrum: Any, ranges: Sequence[tuple[float, float]]) -> list[float]:
    """The share of each range over which there is a stable periodic motion."""
    low, high = np.reshape(ranges, (-1, 2)).T
    values = np.linspace(low, high, CRITERIA.inner + 2)[1:-1]
    shares = (stable_motions(spectrum, values.ravel()) > 0).reshape(values.shape).mean(axis=0)
    return [float(share) for share in shares]


def pierced(spectrum: Any, **panel: float) -> Measured:
    """Whether a stable periodic motion goes through a band of chaos; `panel` is the load or
    frequency of the panel.
    """
    bands = bands_of(spectrum)
    shares = _stable_shares(spectrum, [(band["low"], band["high"]) for band in bands])
    rows = [band | {"share": share} for band, share in zip(bands, shares, strict=True)]
    return measured(
        any(row["share"] > 0.0 for row in rows), bands=rows, grazings=count(spectrum, "GR"), **panel
    )


def ground_spectra(panels: Panels, transients: Any) -> dict[str, Measured]:
    """Fig.

    10, over the amplitudes of the ground motion; `transients` holds when motions at a high
    frequency have settled.
    """
    largest = max(panels)
    return {
        "fig10-quasi-periodic": _quasi_periodic(panels[largest], CRITERIA.high),
        **_at_high_frequency(panels, transients),
        "fig10-pierced": pierced(panels[largest], load=largest),
    }


def _wandering(spectrum: Any) -> np.ndarray:
    """The values of the grid with unsettled motions of positive exponent: chaos or chaotic
    transients.
    """
    table = spectrum["exponents"]
    positive = table["exponent"].values - table["error"].values > 0.0
    return np.asarray(table["value"].values[positive])


def _at_high_frequency(panels: Panels, transients: Any) -> dict[str, Measured]:
    """Chaos is there, the more the larger the load, as printed; in addition (31), at most values it
    is a transient.
    """
    seen = [_wandering(tree) for tree in panels.values()]
    seen = [values[values > CRITERIA.high] for values in seen]
    bands = [
        [band for band in bands_of(tree) if band["low"] > CRITERIA.high] for tree in panels.values()
    ]
    lasting = [
        int(sum(any(band["low"] <= value <= band["high"] for band in own) for value in values))
        for values, own in zip(seen, bands, strict=True)
    ]
    counts = [values.size for values in seen]
    settled = transients["settled"].values
    grows = counts[-1] > 0 and bool((np.diff(counts) > 0).all())
    falls = bool((np.diff(settled) > 0).all()) and int(transients["returned"]) == 0
    rows = [
        {"load": load, "values": n, "lasting": m}
        for load, n, m in zip(panels, counts, lasting, strict=True)
    ]
    return {
        "fig10-chaos": measured(grows and bool(bands[-1]), panels=rows, bands=bands[-1]),
        "fig10-transients": measured(
            falls and 2 * lasting[-1] < counts[-1],
            panels=rows,
            motions=int(transients["motions"]),
            settled=[
                {"number": int(n), "periods": int(p)}
                for n, p in zip(settled, transients["periods"].values, strict=True)
            ],
        ),
    }


def force_diagrams(panels: Panels) -> dict[str, Measured | None]:
    """Fig. 11, over the frequencies of the force."""
    fastest = max(panels)
    return {
        "fig11-shift": shifts(panels),
        "fig11-route": _route(panels),
        "fig11-two-regions": two_regions(panels),
        "fig11-pierced": pierced(panels[fastest], frequency=fastest),
    }


def _route(panels: Panels) -> Measured:
    """As printed: in every panel chaos is reached by cascades and by grazings. Erratum 39: in one
    of them the first chaos is reached by a cascade alone, as a band that begins at the end of one
    ends before any edge is at a grazing."""
    rows = []
    alone = []
    for frequency, tree in panels.items():
        born = [branch for _, branch in branches_of(tree) if "PD" in branch.attrs["end_kinds"]]
        periods = sorted({int(branch["period"][0]) for branch in born})
        bands = tree["bands"]
        edges = [str(kind) for edge in ("low_edge", "high_edge") for kind in bands[edge].values]
        at = np.concatenate([bands["low"].values, bands["high"].values])
        number = {kind: edges.count(kind) for kind in EDGES}
        first = {
            kind: at[np.array(edges) == kind].min(initial=np.inf) for kind in ("cascade", "grazing")
        }
        alone.append(
            bool(
                np.any(
                    (bands["low_edge"].values == "cascade")
                    & (bands["high"].values < first["grazing"])
                )
            )
        )
        rows.append(
            {
                "frequency": frequency,
                "unknown": len(edges) - sum(number.values()),
                "periods": [{"period": q} for q in periods],
                "grazings": count(tree, "GR"),
                **{
                    f"first_{kind}": [{"load": load}] * bool(number[kind])
                    for kind, load in first.items()
                },
                **number,
            }
        )
    cascades = bool(rows) and all(row["cascade"] for row in rows)
    grazes = [bool(row["grazing"]) for row in rows]
    return measured(
        cascades and all(grazes) and not any(alone),
        cascades and any(grazes) and any(alone),
        panels=rows,
    )


def two_regions(panels: Panels) -> Measured:
    """As printed: two regions of chaos, large stable motions between them.

    Erratum 37: at least two, not everywhere two.
    """
    rows = []
    between = []
    for frequency, tree in panels.items():
        regions = _regions(tree)
        gaps = [(one["high"], another["low"]) for one, another in pairwise(regions)]
        between.append(bool(gaps) and any(_large_between(tree, *gap) for gap in gaps))
        rows.append({"frequency": frequency, "regions": regions, "number": len(regions)})
    holds = bool(between) and all(between)
    return measured(holds and all(row["number"] == 2 for row in rows), holds, panels=rows)


def _regions(spectrum: Any) -> list[dict[str, float]]:
    """The bands of chaos, those that are closer together than `CRITERIA.apart` of the range
    joined.
    """
    low, high = (float(bound) for bound in spectrum.attrs["bounds"])
    regions: list[dict[str, float]] = []
    for band in sorted(bands_of(spectrum), key=lambda band: band["low"]):
        if regions and band["low"] - regions[-1]["high"] <= CRITERIA.apart * (high - low):
            regions[-1] = {
                "low": regions[-1]["low"],
                "high": max(band["high"], regions[-1]["high"]),
            }
        else:
            regions.append({"low": band["low"], "high": band["high"]})
    return regions


def _large_between(spectrum: Any, low: float, high: float) -> bool:
    """Whether there is a stable motion over most of a range, and a large one in its middle."""
    branches = [branch for _, branch in branches_of(spectrum)]
    middle = np.concatenate(
        [amplitudes_at(branch, (low + high) / 2, stable=True) for branch in branches]
    )
    largest = max(
        float(np.max(branch["amplitude"].values[branch["stable"].values == 1], initial=0.0))
        for branch in branches
    )
    large = float(middle.max(initial=0.0)) > CRITERIA.large_motion * largest
    return large and _stable_shares(spectrum, [(low, high)])[0] > 0.5


def shifts(panels: Panels) -> Measured | None:
    """The loads at which chaos begins, over the frequencies; undecided if there is none.

    None for a single frequency.
    """
    if len(panels) < 2:
        return None
    least = {
        frequency: min((band["low"] for band in bands_of(tree)), default=np.inf)
        for frequency, tree in panels.items()
    }
    onsets = np.array(list(least.values()))
    known = bool(np.isfinite(onsets).all())
    return measured(
        bool((np.diff(onsets) > 0).all()) if known else None,
        panels=[
            {"frequency": frequency, "load": load}
            for frequency, load in least.items()
            if np.isfinite(load)
        ],
        missing=[
            {"frequency": frequency} for frequency, load in least.items() if not np.isfinite(load)
        ],
    )
