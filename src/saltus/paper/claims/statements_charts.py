"""What the text says of Figs. 14 and 15, judged by their data: each trend answered by a number."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.paper.claims.chart_measures import cells, gained, lost, lost_by_curves, onset, others
from saltus.paper.claims.claim import Claim, check

WHERE = "section 6, text on the stability charts"
SHALLOW = -1.0  # V above which no deformed equilibrium is there without a horizontal load, for any of the charts
PRIMARY = (0.7, 1.6)  # Omega about 1: the frequencies of Fig. 14 beside it
NARROW = 0.15  # of the quasi-static domain
FEW = 0.02  # of the changes looked into: at no special point that could be located
SLIGHT = 0.15  # relative
ROWS = np.linspace(-1.2, -0.2, 41)  # V at which the onset is compared


SLOW = 0.25  # Omega: far below resonance motions follow the loads, and nothing is anticipated


def over_frequency(data: Any) -> list[Claim]:
    """Fig. 14."""
    panels = {float(tree.attrs["frequency"]): tree for tree in data.children.values()}
    return [
        _anticipates(panels),
        _grows_with_frequency(panels),
        _largest_amplitude(panels),
        _second_motion(panels),
        _onset(panels),
        _closed_form(panels),
        agreement("fig14", data),
    ]


def _anticipates(panels: dict[float, Any]) -> Claim:
    """As printed: at every frequency. Erratum 34: not far below resonance, where rest alone even gains cells."""
    shares = {w: (lost(tree), gained(tree)) for w, tree in panels.items()}
    return check(
        "fig14-anticipates",
        WHERE,
        "Dynamics reduces the region where rest is the only stable motion",
        printed=bool(shares) and all(less > more for less, more in shares.values()),
        corrected=bool(shares) and all((less > more) == (w > SLOW) for w, (less, more) in shares.items()),
        erratum=34,
        evidence="share of the quasi-static monostable domain (erratum 23) in which there is a motion beside rest, and cells "
        "outside of it with rest alone: " + "; ".join(f"Ω = {w:g}: {a:.1%}, {b:.1%}" for w, (a, b) in shares.items()),
    )


def _grows_with_frequency(panels: dict[float, Any]) -> Claim:
    shares = [lost(panels[w]) for w in sorted(panels)]
    exact = {w: lost_by_curves(panels[w]) for w in sorted(panels)}
    return check(
        "fig14-frequency",
        WHERE,
        "The higher the frequency, the larger the region with several stable motions",
        printed=len(shares) > 1 and bool((np.diff(shares) > 0).all()),
        evidence="share of the quasi-static monostable domain lost, "
        + ", ".join(f"Ω = {w:g}: {share:.1%}" for w, share in zip(sorted(panels), shares, strict=True))
        + "; by the exact onset of the first motion alone "
        + ", ".join(f"{w:g}: {share:.2%}" for w, share in exact.items() if math.isfinite(share)),
    )


def _largest_amplitude(panels: dict[float, Any]) -> Claim:
    """Over the loads that every chart shows and under which rest is the only state without a horizontal load."""
    widest = min(float(tree["chart"]["horizontal"].max()) for tree in panels.values())
    largest, mean = {}, {}
    for w, tree in panels.items():
        here = cells(tree)
        chosen = np.ix_(here["vertical"] > SHALLOW, here["horizontal"] <= widest)
        size = here["amplitude"][chosen]
        largest[w] = float(np.nanmax(size, initial=0.0))
        mean[w] = float(np.nan_to_num(size).mean())
    return check(
        "fig14-amplitude",
        WHERE,
        "The amplitudes are largest for Ω about 1",
        printed=len(largest) > 1 and all(PRIMARY[0] <= max(of, key=lambda w: of[w]) <= PRIMARY[1] for of in (largest, mean)),
        evidence=f"largest and mean amplitude in rad over V̄ > {SHALLOW:g}, Ĥ ≤ {widest:g}: "
        + "; ".join(f"Ω = {w:g}: {largest[w]:.3f}, {mean[w]:.3f}" for w in sorted(largest)),
    )


def _second_motion(panels: dict[float, Any]) -> Claim:
    """As printed: in a narrow region. Erratum 33: in a strip of six impacts below Hcr, and wide ones of longer periods."""
    fast = max(panels)
    here = cells(panels[fast])
    domain = here["static"]
    several = (here["count"] >= 2) & domain
    period_three = others(panels[fast], 3, 2)
    share, six, three = (
        float((where & domain).sum() / max(domain.sum(), 1)) for where in (several, others(panels[fast], 1, 6), period_three)
    )
    first = float(here["horizontal"][period_three.any(axis=0)].min(initial=np.inf))
    return check(
        "fig14-second",
        WHERE,
        "At Ω = 4 a second motion beside rest appears in a narrow region of the loads",
        printed=bool(several.any()) and share < NARROW,
        corrected=bool(several.any()) and share >= NARROW and six > 0.0,
        erratum=33,
        evidence=f"at Ω = {fast:g} {share:.1%} of the quasi-static monostable domain has several motions: with six impacts "
        f"a period {six:.1%}, of three periods {three:.1%}; the latter, "
        f"from Ĥ = {first:.3f} on, goes on far beyond the domain",
    )


def _onset(panels: dict[float, Any]) -> Claim:
    at_one = min(panels, key=lambda w: abs(w - 1.0))
    value = float(onset(panels[at_one], np.array([-0.5]))[0])
    static = float(np.interp(-0.5, panels[at_one]["static"]["vertical"], panels[at_one]["static"]["true"]))
    return check(
        "fig14-onset",
        WHERE,
        "At V̄ = −0.5 a stable motion exists beside rest from far below the quasi-static border",
        printed=value < 0.5 * static,
        evidence=f"Ω = {at_one:g}: from Ĥ = {value:.6f}, on the exact curve of folds; quasi-static border {static:.6f}",
    )


def _closed_form(panels: dict[float, Any]) -> Claim:
    from saltus.theory import high_frequency_onset

    fast = max(panels)
    attrs = panels[fast].attrs
    known = [
        high_frequency_onset(
            fast, beta0=math.radians(float(attrs["beta0_degrees"])), vertical=v, damping=float(attrs["damping"]), order=2
        )
        for v in ROWS
    ]
    away = _farthest(onset(panels[fast], ROWS) / np.array(known))
    return check(
        "fig14-closed-form",
        WHERE,
        "The border at high frequency, for which the paper has no formula, follows the closed form of its onset",
        printed=False,
        corrected=away < 0.02,
        erratum=28,
        evidence=f"Ω = {fast:g}, V̄ from {ROWS[0]:g} to {ROWS[-1]:g}: curve and closed form differ by at most {away:.2%}",
    )


def agreement(name: str, data: Any) -> Claim:
    """Charts from simulation against orbits from continuation: every motion of a cell that its neighbour lacks."""
    judged, parts = [], []
    for tree in data.children.values():
        differ, frequency = tree["disagreements"].to_dataset(), float(tree.attrs["frequency"])
        total, border, curves, chaos = (
            int(differ.attrs[key]) for key in ("changes", "changes_beside_rest", "on_curves", "chaos_beside_rest")
        )
        looked, beside = differ["looked_into"].values.astype(bool), differ["beside_rest"].values.astype(bool)
        added, harmless = int(tree["chart"].attrs.get("added_by_continuation", 0)), int(differ.attrs["harmless"])
        known, known_border = total - int((~looked).sum()), border - int((beside & ~looked).sum())
        judged += [known > 0 and looked.sum() <= FEW * known]
        judged += [known_border > 0 and (looked & beside).sum() <= FEW * known_border]
        parts.append(
            f"Ω = {frequency:g}: {total - len(looked) - harmless} of {known - harmless} ({curves} on curves; beside rest alone "
            f"{border - beside.sum()} of {known_border}, and {chaos} of chaos; {(~looked).sum()} not looked into; {harmless} are "
            f"none, as the same motion goes on; {added} motions of cells from continuation alone)"
        )
    return check(
        f"{name}-agreement",
        WHERE,
        "Where a motion is in a cell of a chart and not in its neighbour it is born or loses its stability between them",
        printed=bool(judged) and all(judged),
        evidence="changes between neighbouring cells at a fold, period doubling, symmetry breaking or grazing that was located "
        "between them, " + "; ".join(parts),
    )


def over_parameters(data: Any) -> list[Claim]:
    """Fig. 15, against the reference."""
    panels = {
        (round(float(tree.attrs["beta0_degrees"]), 6), round(float(tree.attrs["damping"]), 6)): tree
        for tree in data.children.values()
    }
    angles = {beta0: tree for (beta0, damping), tree in panels.items() if damping == 0.1}
    dampings = {damping: tree for (beta0, damping), tree in panels.items() if beta0 == 80.0}
    return [_border_and_angle(angles), *_amplitudes(angles, dampings), _domain_and_damping(dampings), agreement("fig15", data)]


def _border_and_angle(angles: dict[float, Any]) -> Claim:
    low, high = min(angles), max(angles)
    one, two = onset(angles[low], ROWS), onset(angles[high], ROWS)
    scaled = [x / np.abs(ROWS / math.tan(math.radians(b))) for x, b in ((one, low), (two, high))]
    shape = _farthest(scaled[0] / scaled[1])
    place = _farthest(one / two)
    return check(
        "fig15-angle-border",
        WHERE,
        "β₀ has only a slight influence on the shape of the border",
        printed=min(shape, place) < SLIGHT,
        evidence=f"onset of the first motion at β₀ = {low:g}° against {high:g}°, V̄ from {ROWS[0]:g} to {ROWS[-1]:g}: Ĥ differs "
        f"by up to {place:.0%}, in units of the quasi-static Hcr by up to {shape:.0%}",
    )


def _farthest(ratio: np.ndarray) -> float:
    """By how much ratios differ from 1 at most; infinite where there are none."""
    return float(np.max(np.abs(ratio[np.isfinite(ratio)] - 1), initial=-np.inf)) if np.isfinite(ratio).any() else np.inf


def _amplitudes(angles: dict[float, Any], dampings: dict[float, Any]) -> list[Claim]:
    return [
        _falls("fig15-angle-amplitude", "The largest amplitude decreases as β₀ increases", angles, "β₀ = {:g}°"),
        _falls("fig15-damping-amplitude", "The more damping, the smaller the largest amplitude", dampings, "C = {:g}"),
    ]


def _falls(id: str, statement: str, panels: dict[float, Any], words: str) -> Claim:
    """The largest amplitude of a chart, and where both have motions the share of cells in which it is smaller."""
    order = sorted(panels)
    sizes = {value: cells(panels[value])["amplitude"] for value in order}
    largest = [float(np.nanmax(sizes[value])) for value in order]
    shares = []
    for a, b in pairwise(order):
        both = np.isfinite(sizes[a]) & np.isfinite(sizes[b])
        shares.append(float((sizes[b] < sizes[a])[both].mean()))
    return check(
        id,
        WHERE,
        statement,
        printed=len(order) > 1 and bool((np.diff(largest) < 0).all()),
        evidence="largest amplitude in the chart, "
        + ", ".join(f"{words.format(value)}: {size:.4f} rad" for value, size in zip(order, largest, strict=True))
        + "; it is smaller than the one before in "
        + ", ".join(f"{share:.0%}" for share in shares)
        + " of the cells that have motions in both",
    )


def _domain_and_damping(dampings: dict[float, Any]) -> Claim:
    order = sorted(dampings)
    filled = [float((~cells(dampings[c])["rest_alone"]).mean()) for c in order]
    begins = [float(onset(dampings[c], np.array([-0.5]))[0]) for c in order]
    return check(
        "fig15-damping-domain",
        WHERE,
        "The less damping, the farther the region with motions beside rest extends",
        printed=len(order) > 1 and bool((np.diff(filled) < 0).all()) and bool((np.diff(begins) > 0).all()),
        evidence="share of the chart with motions beside rest, and their onset at V̄ = −0.5: "
        + "; ".join(f"C = {c:g}: {share:.1%}, Ĥ = {h:.6f}" for c, share, h in zip(order, filled, begins, strict=True)),
    )
