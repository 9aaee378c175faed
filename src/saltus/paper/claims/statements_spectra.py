"""What section 6 says of Figs. 9 to 13, judged by their data: knots, superharmonics, loops, jumps, onsets, coexistence, symmetry.

Its statements on chaotic and quasi-periodic bands are judged in `statements_chaos.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.claims.features import (
    PROMINENT,
    amplitudes_at,
    count,
    detached,
    first_fold,
    main_branch,
    named_branches,
    passing,
    stable_motions,
    superharmonic,
)
from saltus.plots import pieces

CONFIRMED = 1e-8  # distance of a stable motion from itself, by direct simulation
BESIDE = 1e-9  # relative
ON_BRANCH = 2e-2  # rad between a simulated attractor and the line drawn between the points of its branch
EQUAL = 1e-10  # rad between amplitudes that are equal
RESONANCE = 0.9  # Omega of the primary one, about (Fig. 9)
SAMPLES = 600  # values at which motions are counted
APART = 0.1  # rad: motions or amplitudes that plainly differ


def confirmed(name: str, where: str, data: Any) -> Claim:
    """The paper's own check, made of everything drawn: stable motions are those of the non-smooth equation."""
    kept, off, number, dots = 0.0, 0.0, 0, 0
    for spectrum in data.children.values():
        for _, branch in named_branches(spectrum):
            stable = branch["stable"].values.astype(bool)
            kept = max(kept, float(np.max(branch["kept"].values[stable], initial=0.0)))
            number += int(stable.sum())
        places, lines = spectrum["attractors"], [line for _, branch in named_branches(spectrum) for line in pieces(branch)]
        for value, amplitude in zip(places["parameter"].values, places["amplitude"].values, strict=True):
            # on both sides: a branch found at this very value may begin, or close, exactly there
            known = np.concatenate([passing(lines, float(value) * (1 + side), stable=True) for side in (-BESIDE, BESIDE)])
            off, dots = max(off, float(np.abs(known - amplitude).min(initial=np.inf))), dots + 1
    return check(
        f"{name}-confirmed",
        where,
        "The stable motions are confirmed by direct integration of the equation without smoothing",
        printed=number > 0 and dots > 0 and kept < CONFIRMED and off < ON_BRANCH,
        evidence=f"{number} stable orbits return to within {kept:.1e} after 20 of their periods; {dots} attractors simulated "
        f"from many starts lie within {off:.1e} rad of a stable branch",
    )


def force_spectra(data: Any, amplitudes: dict[str, float]) -> list[Claim]:
    """Fig. 9; `amplitudes` by panel."""
    return [
        _knots_appear(data, amplitudes),
        _knots_differ(data, amplitudes),
        _superharmonics(data, amplitudes),
        _loops("fig09-loops", "Fig. 9, third bullet", {p: h for p, h in amplitudes.items() if h >= 0.5}, data),
        _jumps(data, amplitudes),
        confirmed("fig09", "Fig. 9", data),
    ]


def _knots_appear(data: Any, amplitudes: dict[str, float]) -> Claim:
    """Knots and unstable motions of the primary resonance: above two thirds of its frequency."""
    found, unstable = {}, {}
    for panel, h in amplitudes.items():
        spectrum, branch = data[panel], main_branch(data[panel])
        start = 2 / 3 * float(branch["parameter"][int(np.argmax(branch["amplitude"].values))])
        primary = branch["parameter"].values > start
        found[h] = int((spectrum["knots"]["parameter"].values > start).sum())
        unstable[h] = int((branch["stable"].values[primary] == 0).sum())
    low, middle = [h for h in found if h <= 0.2], [h for h in found if 0.5 <= h <= 1.5]
    return check(
        "fig09-knots-appear",
        "Fig. 9, first bullet",
        "The primary resonance is a classical one at Ĥ = 0.2; at Ĥ = 0.5, 1, 1.5 it has unstable branches and knots",
        printed=not any(found[h] + unstable[h] for h in low) and all(found[h] and unstable[h] for h in middle),
        evidence="knots at "
        + ", ".join(f"Ĥ = {h:g}: {n} ({unstable[h]} unstable points)" for h, n in found.items() if h in (*low, *middle)),
    )


def _knots_differ(data: Any, amplitudes: dict[str, float]) -> Claim:
    apart, equal, parts = [], [], []
    for panel, h in amplitudes.items():
        knots = data[panel]["knots"]
        apart += knots["apart"].values.tolist()
        equal += np.ptp(knots["amplitude"].values, axis=1).tolist()
        if knots.sizes["knot"]:
            k = int(np.argmax(knots["parameter"].values))
            one, two = np.rad2deg(knots["peak"].values[k])
            parts.append(
                f"Ĥ = {h:g}: Ω = {float(knots['parameter'][k]):.6f}, max|θ| = {float(knots['amplitude'][k, 0]):.6f}, "
                f"peaks at phases {one:.0f}° and {two:.0f}°"
            )
    return check(
        "fig09-knots",
        "Fig. 9, first bullet",
        "At a self-intersection two stable motions share amplitude and frequency and differ in phase",
        printed=bool(apart) and min(apart) > APART and max(equal) < EQUAL,
        evidence=f"{len(apart)} knots, amplitudes equal to {max(equal, default=np.nan):.0e}; " + "; ".join(parts),
    )


def _superharmonics(data: Any, amplitudes: dict[str, float]) -> Claim:
    number, unstable, parts = {}, {}, []
    for panel, h in amplitudes.items():
        branch = main_branch(data[panel])
        top = superharmonic(branch)
        number[h] = len(top)
        low = branch["parameter"].values < (float(top[-1, 0]) * 1.2 if len(top) else 0.0)
        unstable[h] = int((branch["stable"].values[low] == 0).sum())
        parts.append(f"Ĥ = {h:g}: Ω = " + (", ".join(f"{x:.3f}" for x in top[::-1, 0]) or "none"))
    return check(
        "fig09-superharmonic",
        "Fig. 9, second bullet",
        "There are superharmonic resonances at every amplitude, with unstable branches at Ĥ = 0.2 and 0.5",
        printed=all(number.values()) and all(unstable[h] > 0 for h in amplitudes.values() if h <= 0.5),
        evidence="peaks below two thirds of the primary one's frequency, " + "; ".join(parts),
    )


def _loops(id: str, where: str, amplitudes: dict[str, float], data: Any) -> Claim:
    """In each panel a detached branch that somewhere is larger than all of the main one is there."""
    larger, parts = {}, []
    for panel, size in amplitudes.items():
        spectrum, low_high = data[panel], data[panel].attrs["bounds"]
        found = detached(spectrum)
        main = main_branch(spectrum)
        above = [branch for _, branch in found if _rises_above(branch, main, low_high)]
        larger[size] = len(above)
        spans = [
            f"period {int(b['period'][0])}, Ω {float(b['parameter'].min()):.3f} to {float(b['parameter'].max()):.3f}"
            for b in above
        ]
        parts.append(f"{size:g}: " + (", ".join(spans[:3]) or "none"))
    return check(
        id,
        where,
        "A part of the spectrum is detached from the main one and has larger rotations",
        printed=bool(larger) and all(larger.values()),
        evidence="families that no bifurcation ties to the main branch, by load amplitude: " + "; ".join(parts),
    )


def _rises_above(branch: Any, main: Any, bounds: Any) -> bool:
    """Whether somewhere within the bounds a branch is plainly larger than all of the main one there."""
    lines = list(pieces(main))
    return any(
        amplitude - np.max(passing(lines, value), initial=0.0) >= APART
        for value, amplitude in zip(branch["parameter"].values, branch["amplitude"].values, strict=True)
        if bounds[0] <= value <= bounds[1]
    )


def _jumps(data: Any, amplitudes: dict[str, float]) -> Claim:
    """In every panel with loops; where other motions of about the same size lie by, a jump need not show in the amplitude."""
    jumps = {h: np.abs(data[p]["jumps"]["after"].values - data[p]["jumps"]["before"].values) for p, h in amplitudes.items()}
    jumps = {h: sizes for h, sizes in jumps.items() if sizes.size}
    return check(
        "fig09-jumps",
        "Fig. 9, third bullet",
        "Motions jump at the folds of the detached loops",
        printed=bool(jumps) and all((sizes > APART).sum() * 2 > sizes.size for sizes in jumps.values()),
        evidence=f"simulated just past the folds where a loop's stability ends, max|θ| settles more than {APART} rad away: "
        + ", ".join(f"Ĥ = {h:g}: {int((x > APART).sum())} of {x.size} (up to {x.max():.2f} rad)" for h, x in jumps.items()),
    )


def ground_spectra(data: Any, amplitudes: dict[str, float]) -> list[Claim]:
    """Fig. 10; `amplitudes` by panel."""
    mains = {z: main_branch(data[panel]) for panel, z in amplitudes.items()}
    rises = {z: superharmonic(main, share=0.0)[:, 2].max(initial=0.0) for z, main in mains.items()}
    return [
        check(
            "fig10-superharmonic",
            "Fig. 10, first bullet",
            "Under a ground motion there are no superharmonic resonances",
            printed=bool(mains) and not any(len(superharmonic(main)) for main in mains.values()),
            evidence=f"no peak below two thirds of the primary one's frequency rises by {PROMINENT:.0%} of it: "
            + "; ".join(
                f"ζ̂ = {z:g}: the largest ripple, where motion begins at Ω = {float(main['parameter'].min()):.4f}, rises by "
                f"{rises[z] / float(main['amplitude'].max()):.1%}"
                for z, main in mains.items()
            ),
        ),
        _loops("fig10-loops", "Fig. 10, first bullet", amplitudes, data),
        confirmed("fig10", "Fig. 10", data),
    ]


def force_diagrams(name: str, data: Any, frequencies: dict[str, float]) -> list[Claim]:
    """Figs. 11 and 12; `frequencies` by panel."""
    return [
        _undeformed(name, data, frequencies),
        _anticipated(name, data, frequencies),
        _grows(name, data, frequencies),
        _flattens(name, data, frequencies),
        coexistence(name, data, {panel: f"Ω = {w:g}" for panel, w in frequencies.items()}),
        confirmed(name, _where(name), data),
    ]


def _where(name: str) -> str:
    return f"Fig. {name.removeprefix('fig')}"


def _undeformed(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    """As printed: past Hcr motions leave for the limit cycle. Erratum 24: rest is left, and closed again, in every period."""
    held, released, gone, parts = [], [], [], []
    for panel, w in frequencies.items():
        row, critical = data[panel]["undeformed"], float(data[panel].attrs["critical"])
        cycle = float(np.max(amplitudes_at(main_branch(data[panel]), critical * 1.001, stable=True), initial=0.0))
        held.append(bool(row["held_below"]))
        released.append(not bool(row["held_above"]))
        gone.append(float(row["later"]) > 0.5 * cycle)
        parts.append(f"Ω = {w:g}: {float(row['later']):.3g} rad beside a cycle of {cycle:.3g} rad")
    return check(
        f"{name}-undeformed",
        "section 6, first bullet on the diagrams",
        "θ = 0 is stable up to Hcr, and for Ĥ > Hcr unstable: motions leave it",
        printed=all(held) and all(released) and all(gone),
        corrected=all(held) and all(released),
        erratum=24,
        evidence="started at rest it stays for ever at Ĥ = 0.999 Hcr; at 1.001 Hcr it is released, and closes again, in every "
        "period; max|θ| after 300 periods, " + ", ".join(parts),
    )


def _anticipated(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    stable, parts = [], []
    for panel, w in frequencies.items():
        branch, critical = main_branch(data[panel]), float(data[panel].attrs["critical"])
        fold, _ = first_fold(branch)
        below = amplitudes_at(branch, (fold + critical) / 2, stable=True)
        stable.append(fold < critical and below.size > 0)
        parts.append(f"Ω = {w:g}: from Ĥ = {fold:.6f}")
    critical = float(next(iter(data.children.values())).attrs["critical"])
    return check(
        f"{name}-anticipated",
        "section 6, first bullet on the diagrams",
        "A stable limit cycle exists for Ĥ < Hcr, beside the undeformed state",
        printed=bool(stable) and all(stable),
        evidence=f"Hcr = {critical:.6f}; it is born at a fold, " + ", ".join(parts),
    )


def _grows(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    """As printed: from its birth on. Erratum 30: from twice Hcr on, past the superharmonics of low frequency."""
    always, later, parts = [], [], []
    for panel, w in frequencies.items():
        main, critical = main_branch(data[panel]), float(data[panel].attrs["critical"])
        near, far = (_largest(main, values) for values in _along_the_first_path(main, critical))
        later.append(_rises(far))
        always.append(_rises(near) and later[-1])
        parts.append(f"Ω = {w:g}: {near[0]:.4f} rad just past its birth, {near[-1]:.4f} at 2 Hcr, {far[-1]:.4f} at 10 Hcr")
        parts[-1] += "" if always[-1] else " (it falls between the first two)"
    return check(
        f"{name}-grows",
        "section 6, second bullet on the diagrams",
        "The amplitude of the first limit cycle increases with Ĥ",
        printed=bool(always) and all(always),
        corrected=bool(later) and all(later),
        erratum=30,
        evidence="largest stable motion of the first branch, " + "; ".join(parts),
    )


def _along_the_first_path(main: Any, critical: float) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes of the load from the first fold to 2 Hcr, and from there to 10 Hcr."""
    fold, shares = first_fold(main)[0], (np.arange(60) + 1) / 60
    return fold + (2 * critical - fold) * shares, critical * (2 + 8 * shares)


def _largest(main: Any, values: np.ndarray) -> np.ndarray:
    lines = list(pieces(main))
    return np.array([np.max(passing(lines, value, stable=True), initial=0.0) for value in values])


def _rises(sizes: np.ndarray) -> bool:
    return bool((sizes > 0).all() and (np.diff(sizes) > 0).all())


def _flattens(name: str, data: Any, frequencies: dict[str, float]) -> Claim:
    """As printed: everywhere. Erratum 30: where both frequencies are above the primary resonance, or the load is large."""
    panels = sorted(frequencies, key=lambda panel: frequencies[panel])
    critical = float(data[panels[0]].attrs["critical"])
    loads = critical * np.array([1.0, 2.0, 5.0, 15.0])
    sizes = np.array([_largest(main_branch(data[panel]), loads) for panel in panels])
    falls = np.diff(sizes, axis=0) < 0
    parts = [f"Ω = {frequencies[p]:g}: " + ", ".join(f"{x:.4f}" for x in row) for p, row in zip(panels, sizes, strict=True)]
    return check(
        f"{name}-flattens",
        "section 6, second bullet on the diagrams",
        "For a given Ĥ the amplitude of the first limit cycle decreases with Ω",
        printed=len(panels) > 1 and bool(falls.all()),
        corrected=len(panels) > 1 and bool(falls[:, -1].all()) and not falls[:, 0].any() and frequencies[panels[0]] < RESONANCE,
        erratum=30,
        evidence="max|θ| in rad at Ĥ = Hcr, 2 Hcr, 5 Hcr and 15 Hcr, " + "; ".join(parts),
    )


def coexistence(name: str, data: Any, panels: dict[str, str]) -> Claim:
    """`panels` by name, each with the words for it."""
    more, parts = [], []
    for panel, words in panels.items():
        spectrum, start = data[panel], 2 * float(data[panel].attrs["critical"])
        values, number = _counts(spectrum)
        early, later = int(stable_motions(spectrum, np.array([start]))[0]), number[values > start]
        most, where = int(later.max()), float(values[values > start][later.argmax()])
        more.append(most > max(early, 1))
        parts.append(f"{words}: {early} at 2 Hcr, {most} at Ĥ = {where:.3f}, {later[-1]} at the end of the range")
    return check(
        f"{name}-coexistence",
        "section 6, last bullet on the diagrams",
        "Several stable motions coexist, and as Ĥ grows there come to be more of them",
        printed=bool(more) and all(more),
        evidence="stable periodic motions beside rest (mirror images counted once; longer periods and chaos not counted), "
        + "; ".join(parts),
    )


def _counts(spectrum: Any) -> tuple[np.ndarray, np.ndarray]:
    """Values spread evenly over the range, an even number, and how many stable motions there are at each."""
    low, high = (float(bound) for bound in spectrum.attrs["bounds"])
    values = low + (high - low) * (np.arange(SAMPLES) + 0.5) / SAMPLES
    return values, stable_motions(spectrum, values)


def both_diagram(data: Any) -> list[Claim]:
    """Fig. 13."""
    spectrum = next(iter(data.children.values()))
    mirror = {
        str(load): float(gap) for load, gap in zip(data["mirror"]["load"].values, data["mirror"]["gap"].values, strict=True)
    }
    own = [int(b["symmetric"].sum()) for _, b in named_branches(spectrum)]
    main = main_branch(spectrum)
    uneven = np.abs(main["highest"].values + main["lowest"].values)
    kinds = {kind: count(spectrum, kind) for kind in ("LP", "PD", "GR")}
    values, number = _counts(spectrum)
    most, where = int(number.max()), float(values[number.argmax()])
    return [
        check(
            "fig13-symmetry",
            "Fig. 13 and the text before it",
            "The response is symmetric under loads (i) and (ii), and not under (iii)",
            printed=max(mirror["(i)"], mirror["(ii)"]) < CONFIRMED and mirror["(iii)"] > APART and not any(own),
            evidence="a motion and the mirror image of the mirrored start half a period later differ after 5 periods by "
            + ", ".join(f"{gap:.1e} under {load}" for load, gap in mirror.items())
            + f"; of the main branch under (iii) max θ and −min θ differ by up to {uneven.max():.3f} rad",
        ),
        check(
            "fig13-features",
            "Fig. 13",
            "Apart from the symmetry the features are the same: several motions coexist and bifurcate",
            printed=most > 1 and all(kinds.values()),
            evidence=f"up to {most} stable motions beside rest (at Ĥ = {where:.3f}); "
            + ", ".join(f"{n} {kind}" for kind, n in kinds.items()),
        ),
        confirmed("fig13", "Fig. 13", spectra_only(data)),
    ]


def spectra_only(data: Any) -> Any:
    """The panels of a figure without its other groups."""
    return data.filter(lambda node: node.name != "mirror")
