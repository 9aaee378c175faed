"""What section 6 says of chaotic and quasi-periodic motions in Figs. 9 to 13, measured by the bands of their diagrams.

The panels of a figure are given by the value in which they differ, in rising order.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.attractors import excludes_tori
from saltus.branch_lines import branches_of
from saltus.paper.claims.claim import Measured, measured
from saltus.paper.measures.response_measures import Panels
from saltus.paper.measures.spectrum_features import count, stable_motions
from saltus.systems import System


@dataclass(frozen=True, slots=True, kw_only=True)
class ChaosCriteria:
    """By which numbers the statements on chaos in Figs. 9 to 13 are judged."""

    inner: int = 200  # The number of values within a band at which stable motions are counted.
    high: float = 1.0  # Frequencies above this one are beyond the primary resonance.
    low: float = 0.5  # Superharmonic resonances are below this frequency.
    large_load: float = 2.0  # The paper sees chaos in the panels from this Hhat on.


CRITERIA = ChaosCriteria()


def bands_of(spectrum: Any) -> list[dict[str, float]]:
    """The bands of chaos: `low`, `high` and the largest `exponent` of each."""
    table = spectrum["bands"]
    return [{name: float(table[name][i]) for name in ("low", "high", "exponent")} for i in range(table.sizes["band"])]


def _width(spectrum: Any) -> float:
    return sum(band["high"] - band["low"] for band in bands_of(spectrum))


def _quasi_periodic(spectrum: Any, below: float) -> Measured:
    """Erratum 22: no tori; what is there instead is chaos, at frequencies below a given one."""
    reason, bands = excludes_tori(System.from_json(str(spectrum.attrs["system"]))), bands_of(spectrum)
    chaos = any(band["high"] < below for band in bands)
    return measured(reason is None, reason is not None and chaos, reason=reason, bands=bands)


def force_spectra(panels: Panels) -> dict[str, Measured]:
    """Fig. 9, over the amplitudes of the force."""
    smallest, largest = min(panels), max(panels)
    return {
        "fig09-quasi-periodic": _quasi_periodic(panels[smallest], CRITERIA.low),
        "fig09-chaos": _widening(panels),
        "fig09-chaos-range": _around_resonance(panels[largest], largest),
        "fig09-pierced": pierced(panels[largest], load=largest),
    }


def _widening(panels: Panels) -> Measured:
    rows = [{"load": load, "width": _width(tree)} for load, tree in panels.items()]
    large = [row["width"] for row in rows if row["load"] >= CRITERIA.large_load]
    small = [row["width"] for row in rows if row["load"] < CRITERIA.large_load]
    grows = bool(large) and min(large) > max(small, default=0.0) and bool((np.diff(large) > 0).all())
    return measured(grows, panels=rows)


def _around_resonance(spectrum: Any, load: float) -> Measured:
    bands, width = bands_of(spectrum), _width(spectrum)
    inside = sum(max(0.0, min(band["high"], 2.0) - max(band["low"], 1.0)) for band in bands)
    return measured(width > 0.0 and inside > 0.75 * width, load=load, inside=inside, width=width, bands=bands)


def _stable_share(spectrum: Any, low: float, high: float) -> float:
    """The share of a range over which there is a stable periodic motion."""
    return float((stable_motions(spectrum, np.linspace(low, high, CRITERIA.inner + 2)[1:-1]) > 0).mean())


def pierced(spectrum: Any, **panel: float) -> Measured:
    """Whether a stable periodic motion goes through a band of chaos; `panel` is the load or frequency of the panel."""
    rows = [band | {"share": _stable_share(spectrum, band["low"], band["high"])} for band in bands_of(spectrum)]
    return measured(any(row["share"] > 0.0 for row in rows), bands=rows, grazings=count(spectrum, "GR"), **panel)


def ground_spectra(panels: Panels) -> dict[str, Measured]:
    """Fig. 10, over the amplitudes of the ground motion."""
    return {
        "fig10-quasi-periodic": _quasi_periodic(panels[max(panels)], CRITERIA.high),
        "fig10-chaos": _at_high_frequency(panels),
    }


def _wandering(spectrum: Any) -> np.ndarray:
    """The values of the grid at which motions wander with a positive exponent: chaos, lasting or not."""
    table = spectrum["exponents"]
    positive = table["exponent"].values - table["error"].values > 0.0
    return np.asarray(table["value"].values[positive])


def _at_high_frequency(panels: Panels) -> Measured:
    """Erratum 31: what looks like chaos there is a transient."""
    lasting = [
        sum(band["high"] - band["low"] for band in bands_of(tree) if band["low"] > CRITERIA.high) for tree in panels.values()
    ]
    seen = [int((_wandering(tree) > CRITERIA.high).sum()) for tree in panels.values()]
    return measured(
        lasting[-1] > 0.0 and bool((np.diff(lasting) > 0).all()),
        seen[-1] > 0 and bool((np.diff(seen) > 0).all()),
        panels=[{"load": load, "values": values} for load, values in zip(panels, seen, strict=True)],
        widths=[{"width": width} for width in lasting],
    )


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
    doubled: list[bool] = []
    rows: list[dict[str, Any]] = []
    for frequency, tree in panels.items():
        born = [branch for _, branch in branches_of(tree) if "PD" in branch.attrs["end_kinds"]]
        periods = sorted({int(branch["period"][0]) for branch in born})
        edges = [str(kind) for edge in ("low_edge", "high_edge") for kind in tree["bands"][edge].values]
        doublings, grazings = count(tree, "PD"), count(tree, "GR")
        doubled.append(doublings > 0 and any(period % 2 == 0 for period in periods))
        row = {"frequency": frequency, "doublings": doublings, "grazings": grazings}
        rows.append(row | {"periods": [{"period": q} for q in periods], "edges": [{"edge": edge} for edge in edges]})
    return measured(bool(doubled) and all(doubled) and all(row["grazings"] > 0 for row in rows), panels=rows)


def two_regions(panels: Panels) -> Measured:
    """Whether in every panel two bands of chaos have stable motions between them."""
    two = []
    for tree in panels.values():
        gaps = [(one["high"], next_one["low"]) for one, next_one in pairwise(bands_of(tree))]
        two.append(any(_stable_share(tree, *gap) > 0.5 for gap in gaps))
    return measured(bool(two) and all(two), panels=[{"frequency": w, "bands": bands_of(tree)} for w, tree in panels.items()])


def shifts(panels: Panels) -> Measured | None:
    """As printed: for all frequencies. Erratum 32: above the primary resonance. None where there is only one frequency."""
    if len(panels) < 2:
        return None
    least = np.array([float(_wandering(tree).min(initial=np.inf)) for tree in panels.values()])
    falls = min(panels) < CRITERIA.high and bool(np.isfinite(least).all()) and bool((np.diff(least) < 0).all())
    rows = [{"frequency": frequency, "load": load} for frequency, load in zip(panels, least, strict=True)]
    return measured(bool((np.diff(least) > 0).all()), falls, panels=rows)
