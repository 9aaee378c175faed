"""What section 6 says of chaotic and quasi-periodic motions in Figs. 9 to 13, judged by the bands of their diagrams."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.claims.features import count, named_branches, stable_motions

INNER = 200  # values within a band at which stable motions are counted
HIGH = 1.0  # Omega: frequencies beyond the primary resonance
DIAGRAM = "section 6, bullets on the diagrams"


def bands(spectrum: Any) -> list[tuple[float, float, float]]:
    """(low, high, largest exponent) of every band of chaos."""
    table = spectrum["bands"]
    return [tuple(float(table[name][i]) for name in ("low", "high", "exponent")) for i in range(table.sizes["band"])]  # type: ignore[misc]


def _width(spectrum: Any) -> float:
    return sum(high - low for low, high, _ in bands(spectrum))


def _listed(spectrum: Any) -> str:
    return ", ".join(f"{low:.4f} to {high:.4f} (λ = {rate:.3f})" for low, high, rate in bands(spectrum)) or "none"


def _quasi_periodic(id: str, where: str, statement: str, spectrum: Any, below: float) -> Claim:
    """Erratum 22: no tori; what is there instead is chaos, at frequencies below a given one."""
    from saltus.attractors import excludes_tori
    from saltus.systems import System

    reason = excludes_tori(System.from_json(str(spectrum.attrs["system"])))
    low = [band for band in bands(spectrum) if band[1] < below]
    return check(
        id,
        where,
        statement,
        printed=reason is None,
        corrected=reason is not None and bool(low),
        erratum=22,
        evidence=f"{reason}; in its place chaos, with a largest Lyapunov exponent λ per unit of time: Ω = {_listed(spectrum)}",
    )


def force_spectra(data: Any, amplitudes: dict[str, float]) -> list[Claim]:
    """Fig. 9; `amplitudes` by panel."""
    panels = sorted(amplitudes, key=lambda panel: amplitudes[panel])
    return [
        _quasi_periodic(
            "fig09-quasi-periodic",
            "Fig. 9, second bullet",
            f"Superharmonic resonances lead to quasi-periodic motions (Ĥ = {amplitudes[panels[0]]:g})",
            data[panels[0]],
            below=0.5,
        ),
        _widening(data, {panel: amplitudes[panel] for panel in panels}),
        _around_resonance(data[panels[-1]], amplitudes[panels[-1]]),
        pierced("fig09-pierced", "Fig. 9, last bullet", data[panels[-1]], f"Ĥ = {amplitudes[panels[-1]]:g}, Ω"),
    ]


def _widening(data: Any, amplitudes: dict[str, float]) -> Claim:
    widths = {h: _width(data[panel]) for panel, h in amplitudes.items()}
    large, small = [w for h, w in widths.items() if h >= 2.0], [w for h, w in widths.items() if h < 2.0]
    grows = bool(large) and min(large) > max(small, default=0.0) and bool((np.diff(large) > 0).all())
    return check(
        "fig09-chaos",
        "Fig. 9, last bullet",
        "Chaos appears for large load amplitudes (Ĥ = 2, 3) over a range of frequencies that widens with Ĥ",
        printed=grows,
        evidence="total width of the bands of chaos, " + ", ".join(f"Ĥ = {h:g}: {w:.3f}" for h, w in widths.items()),
    )


def _around_resonance(spectrum: Any, amplitude: float) -> Claim:
    inside = sum(max(0.0, min(high, 2.0) - max(low, 1.0)) for low, high, _ in bands(spectrum))
    whole = _width(spectrum)
    return check(
        "fig09-chaos-range",
        "Fig. 9, last bullet",
        "Chaos lies approximately within Ω = 1 to 2",
        printed=whole > 0.0 and inside > 0.75 * whole,
        evidence=f"Ĥ = {amplitude:g}: {inside:.3f} of the bands' {whole:.3f} lie there; Ω = {_listed(spectrum)}",
    )


def pierced(id: str, where: str, spectrum: Any, words: str) -> Claim:
    """A stable periodic motion goes through a band of chaos."""
    stable, parts = 0, []
    for low, high, _ in bands(spectrum):
        values = np.linspace(low, high, INNER + 2)[1:-1]
        share = float((stable_motions(spectrum, values) > 0).mean())
        stable += share > 0.0
        parts.append(f"{low:.3f} to {high:.3f}: over {share:.0%} of it")
    return check(
        id,
        where,
        "A stable periodic motion passes through a chaotic region",
        printed=stable > 0,
        evidence=f"beside the chaos at {words} = "
        + ("; ".join(parts) or "none")
        + f"; {count(spectrum, 'GR')} grazings in the range",
    )


def ground_spectra(data: Any, amplitudes: dict[str, float]) -> list[Claim]:
    """Fig. 10; `amplitudes` by panel."""
    panels = sorted(amplitudes, key=lambda panel: amplitudes[panel])
    return [
        _quasi_periodic(
            "fig10-quasi-periodic",
            "Fig. 10, second bullet",
            "Quasi-periodic motions at low frequencies, between the undeformed state and the steady one "
            f"(ζ̂ = {amplitudes[panels[-1]]:g})",
            data[panels[-1]],
            below=HIGH,
        ),
        _at_high_frequency(data, {panel: amplitudes[panel] for panel in panels}),
    ]


def _wandering(spectrum: Any) -> np.ndarray:
    """The values of the grid at which motions wander with a positive exponent: chaos, lasting or not."""
    table = spectrum["exponents"]
    positive = (table["exponent"].values - table["error"].values > 0.0) & (
        table["chaotic"].values + table["undecided"].values > 0
    )
    return np.asarray(table["value"].values[positive.any(axis=1)])


def _at_high_frequency(data: Any, amplitudes: dict[str, float]) -> Claim:
    """Erratum 31: what looks like chaos there is a transient."""
    lasting = {z: sum(h - low for low, h, _ in bands(data[p]) if low > HIGH) for p, z in amplitudes.items()}
    seen = {z: int((_wandering(data[p]) > HIGH).sum()) for p, z in amplitudes.items()}
    widths, numbers = list(lasting.values()), list(seen.values())
    return check(
        "fig10-chaos",
        "Fig. 10, last bullet",
        "Chaos is found at high frequencies, too, as ζ̂ increases",
        printed=widths[-1] > 0.0 and bool((np.diff(widths) > 0).all()),
        corrected=numbers[-1] > 0 and bool((np.diff(numbers) > 0).all()),
        erratum=31,
        evidence="values of Ω above 1 at which motions still wander after 400 periods, with a positive exponent, "
        + ", ".join(f"ζ̂ = {z:g}: {n}" for z, n in seen.items())
        + "; bands, in which at no value tried one of the companions settles, have a total width of "
        + ", ".join(f"{w:.3f}" for w in widths),
    )


def force_diagrams(name: str, data: Any, frequencies: dict[str, float]) -> list[Claim]:
    """Figs. 11 and 12; `frequencies` by panel."""
    panels = sorted(frequencies, key=lambda panel: frequencies[panel])
    made = [_shifts(name, data, {panel: frequencies[panel] for panel in panels})] if len(panels) > 1 else []
    if name == "fig11":
        made += [_route(name, data, frequencies), _two_regions(name, data, frequencies)]
        made.append(pierced("fig11-pierced", DIAGRAM, data[panels[-1]], f"Ω = {frequencies[panels[-1]]:g}, Ĥ"))
    return made


def _route(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    doubled, grazed, parts = [], [], []
    for panel, w in frequencies.items():
        spectrum = data[panel]
        periods = sorted({int(b["period"][0]) for _, b in named_branches(spectrum) if "PD" in " ".join(b.attrs["ends"])})
        marks = [str(mark) for edge in ("low_mark", "high_mark") for mark in spectrum["bands"][edge].values]
        doubled.append(count(spectrum, "PD") > 0 and any(q % 2 == 0 for q in periods))
        grazed.append(count(spectrum, "GR") > 0)
        parts.append(
            f"Ω = {w:g}: {count(spectrum, 'PD')} period doublings (families born there have periods "
            f"{', '.join(map(str, periods))}), {count(spectrum, 'GR')} grazings; at the edges of the bands: "
            f"{', '.join(marks) or 'no band'}"
        )
    return check(
        f"{name}-route",
        DIAGRAM,
        "Grazing and cascades of period doublings are the route to chaos for large Ĥ",
        printed=bool(doubled) and all(doubled) and all(grazed),
        evidence="; ".join(parts),
    )


def _two_regions(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    two, parts = [], []
    for panel, w in frequencies.items():
        found = bands(data[panel])
        gaps = [(a[1], b[0]) for a, b in pairwise(found)]
        between = [gap for gap in gaps if (stable_motions(data[panel], np.linspace(*gap, INNER + 2)[1:-1]) > 0).mean() > 0.5]
        two.append(bool(between))
        parts.append(f"Ω = {w:g}: Ĥ = {_listed(data[panel])}")
    return check(
        f"{name}-two-regions",
        DIAGRAM,
        "Chaos appears for disconnected sets of Ĥ, with stable motions of large amplitude between them",
        printed=bool(two) and all(two),
        evidence="; ".join(parts),
    )


def _first(spectrum: Any) -> float:
    """The least value at which motions wander with a positive exponent, inf where none do."""
    return float(_wandering(spectrum).min(initial=np.inf))


def _shifts(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    """As printed: for all frequencies. Erratum 32: above the primary resonance."""
    first = {w: _first(data[panel]) for panel, w in frequencies.items()}
    least = np.array(list(first.values()))
    return check(
        f"{name}-shift",
        DIAGRAM,
        "An increase of Ω shifts chaos to larger Ĥ",
        printed=bool((np.diff(least) > 0).all()),
        corrected=min(first) < HIGH and bool(np.isfinite(least).all()) and bool((np.diff(least) < 0).all()),
        erratum=32,
        evidence="least Ĥ at which motions wander with a positive exponent, "
        + ", ".join(f"Ω = {w:g}: {value:.3f}" for w, value in first.items()),
    )
