"""Measures for section 6 on Figs. 9 to 13: knots, superharmonics, loops, jumps, onsets,
coexistence, symmetry.

The panels of a figure are given by the value in which they differ, such as {0.2: tree, 0.5: tree},
in rising order. The statements on chaotic and quasi-periodic bands are measured in
`chaos_measures.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import System, branches_of
from saltus.plots import smooth_lines
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.measures.spectrum_features import (
    PROMINENT,
    amplitudes_at,
    count,
    detached,
    first_fold,
    main_branch,
    passing,
    range_counts,
    steps_of,
    superharmonic,
)

Panels = Mapping[float, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseCriteria:
    """The numbers by which the statements on Figs. 9 to 13 are judged."""

    # A stable motion returns to within this distance of itself by direct simulation.
    confirmed: float = 1e-8
    # Branches are read at this relative distance on both sides of a value at which one may begin.
    beside: float = 1e-9
    # A simulated attractor lies this near, in rad, to the line drawn between the points of its
    # branch.
    on_branch: float = 2e-2
    equal: float = 1e-10  # Amplitudes that differ by less, in rad, are equal.
    # Folds nearer to one another than this are invisible in a picture: at Hhat = 0.2 the
    # resonance's peak has two, 5e-7 apart.
    invisible: float = 1e-4
    resonance: float = 0.9  # The primary resonance of Fig. 9 is at about this frequency.
    # The number of values, an even one, at which the stable motions of a range are counted.
    samples: int = 600
    apart: float = 0.1  # Motions or amplitudes that differ by more, in rad, plainly differ.
    large_load: float = 0.5  # Detached loops are there from this Hhat on.
    # A disturbance of 1e-5 rad at theta = 0 grows no larger, in rad, where rest is held.
    held: float = 1e-4
    # The disturbance grows larger than this, in rad, where rest is left in every period.
    left: float = 5e-4
    # A cycle that leaves rest begins with less than this share of its amplitude at Hcr.
    supercritical: float = 0.01
    # The relative distance past a fold at which the cycle's unstable companion is looked for.
    past_fold: float = 1e-3
    # The number of parts of a range over which the number of stable motions is averaged.
    quarters: int = 4
    shared: float = 0.25  # Motions coexist over more than this share of a range.
    shown_loops: int = 3  # The number of loops of a panel whose ranges are given in the evidence.


CRITERIA = ResponseCriteria()
# multiples of Hcr at which the amplitudes of two frequencies are compared
LOADS = np.array([1.0, 2.0, 5.0, 15.0])


def confirmed(spectra: Iterable[Any]) -> Measured:
    """The paper's own check, for all motions drawn: stable motions are motions of the non-smooth
    equation.
    """
    kept = 0.0
    off = 0.0
    orbits = 0
    attractors = 0
    unplaced = 0
    for spectrum in spectra:
        for _, branch in branches_of(spectrum):
            stable = branch["stable"].values.astype(bool)
            kept = max(kept, float(np.max(branch["kept"].values[stable], initial=0.0)))
            orbits += int(stable.sum())
        lines = (line for _, branch in branches_of(spectrum) for line in smooth_lines(branch))
        places = spectrum["attractors"]
        steps = steps_of(lines, stable=True)
        placed = places["placed"].values == 1
        unplaced += int((~placed).sum())
        for value, amplitude in zip(
            places["parameter"].values[placed], places["amplitude"].values[placed], strict=True
        ):
            # on both sides: a branch found at this very value may begin, or close, exactly there
            known = np.concatenate(
                [passing(steps, value * (1 + side)) for side in (-CRITERIA.beside, CRITERIA.beside)]
            )
            off, attractors = (
                max(off, float(np.abs(known - amplitude).min(initial=np.inf))),
                attractors + 1,
            )
    holds = orbits > 0 and attractors > 0 and kept < CRITERIA.confirmed and off < CRITERIA.on_branch
    return measured(
        holds, orbits=orbits, kept=kept, attractors=attractors, off=off, unplaced=unplaced
    )


def force_spectra(panels: Panels) -> dict[str, Measured]:
    """Fig. 9, over the amplitudes of the force."""
    return {
        "fig09-knots-appear": _knots_appear(panels),
        "fig09-knots": _knots_differ(panels),
        "fig09-superharmonic": _superharmonics(panels),
        "fig09-loops": loops(
            {load: tree for load, tree in panels.items() if load >= CRITERIA.large_load}
        ),
        "fig09-jumps": _jumps(panels),
        "fig09-confirmed": confirmed(panels.values()),
    }


def _knots_appear(panels: Panels) -> Measured:
    """Knots and unstable motions of the primary resonance: above two thirds of its frequency."""
    rows = [{"load": load, **_primary_resonance(tree)} for load, tree in panels.items()]
    low = [row for row in rows if row["load"] <= 0.2]
    middle = [row for row in rows if 0.5 <= row["load"] <= 1.5]
    holds = not any(row["knots"] + row["unstable"] for row in low) and all(
        row["knots"] and row["unstable"] for row in middle
    )
    return measured(holds, panels=[*low, *middle])


def _primary_resonance(spectrum: Any) -> dict[str, Any]:
    branch = main_branch(spectrum)
    start = 2 / 3 * float(branch["parameter"][int(np.argmax(branch["amplitude"].values))])
    parts = [
        (points, width)
        for points, width in _unstable_parts(branch)
        if branch["parameter"].values[points].max() > start
    ]
    seen = [points for points, width in parts if width >= CRITERIA.invisible]
    return {
        "knots": int((spectrum["knots"]["parameter"].values > start).sum()),
        "unstable": int(sum((branch["parameter"].values[points] > start).sum() for points in seen)),
        "hidden": [{"width": width} for _, width in parts if width < CRITERIA.invisible],
    }


def _unstable_parts(branch: Any) -> list[tuple[np.ndarray, float]]:
    """The points of each unstable part of a branch, and the range of the parameter between the
    stable points about it.
    """
    place = branch["parameter"].values
    unstable = branch["stable"].values == 0
    runs = np.split(np.arange(len(place)), np.flatnonzero(np.diff(unstable)) + 1)
    return [
        (run, float(np.ptp(place[max(run[0] - 1, 0) : run[-1] + 2])))
        for run in runs
        if unstable[run[0]]
    ]


def _knots_differ(panels: Panels) -> Measured:
    knots = {load: tree["knots"] for load, tree in panels.items()}
    apart = np.concatenate([[], *(one["apart"].values for one in knots.values())])
    equal = np.concatenate(
        [[], *(np.ptp(one["amplitude"].values, axis=1) for one in knots.values())]
    )
    rows = [_last_knot(load, one) for load, one in knots.items() if one.sizes["knot"]]
    holds = apart.size > 0 and apart.min() > CRITERIA.apart and equal.max() < CRITERIA.equal
    return measured(
        bool(holds), knots=apart.size, difference=equal.max() if equal.size else np.nan, panels=rows
    )


def _last_knot(load: float, knots: Any) -> dict[str, float]:
    k = int(np.argmax(knots["parameter"].values))
    one, two = np.rad2deg(knots["peak"].values[k])
    frequency = float(knots["parameter"][k])
    amplitude = float(knots["amplitude"][k, 0])
    return {
        "load": load,
        "frequency": frequency,
        "amplitude": amplitude,
        "first_peak": one,
        "second_peak": two,
    }


def _superharmonics(panels: Panels) -> Measured:
    unstable = {}
    rows = []
    for load, tree in panels.items():
        branch = main_branch(tree)
        top = superharmonic(branch)
        low = branch["parameter"].values < (float(top[-1, 0]) * 1.2 if len(top) else 0.0)
        unstable[load] = int((branch["stable"].values[low] == 0).sum())
        rows.append({"load": load, "peaks": [{"frequency": x} for x in top[::-1, 0]]})
    holds = all(row["peaks"] for row in rows) and all(
        unstable[load] > 0 for load in panels if load <= 0.5
    )
    return measured(holds, panels=rows)


def loops(panels: Panels) -> Measured:
    """Whether each panel has a detached branch that is somewhere larger than all of the main
    branch.
    """
    rows = []
    for load, tree in panels.items():
        main = main_branch(tree)
        bounds = tree.attrs["bounds"]
        above = [branch for _, branch in detached(tree) if _rises_above(branch, main, bounds)]
        spans = [
            (int(b["period"][0]), float(b["parameter"].min()), float(b["parameter"].max()))
            for b in above[: CRITERIA.shown_loops]
        ]
        rows.append(
            {
                "load": load,
                "loops": [
                    {"period": period, "low": low, "high": high} for period, low, high in spans
                ],
            }
        )
    return measured(bool(rows) and all(row["loops"] for row in rows), panels=rows)


def _rises_above(branch: Any, main: Any, bounds: Any) -> bool:
    """Whether somewhere within the bounds a branch is plainly larger than all of the main one
    there.
    """
    steps = steps_of(smooth_lines(main))
    return any(
        amplitude - np.max(passing(steps, value), initial=0.0) >= CRITERIA.apart
        for value, amplitude in zip(
            branch["parameter"].values, branch["amplitude"].values, strict=True
        )
        if bounds[0] <= value <= bounds[1]
    )


def _jumps(panels: Panels) -> Measured:
    """Whether motions jump in every panel with loops; with other motions of about the same size
    nearby a jump may be small.
    """
    rows = []
    for load, tree in panels.items():
        sizes = np.abs(tree["jumps"]["after"].values - tree["jumps"]["before"].values)
        if sizes.size:
            rows.append(
                {
                    "load": load,
                    "jumps": int((sizes > CRITERIA.apart).sum()),
                    "folds": sizes.size,
                    "largest": sizes.max(),
                }
            )
    return measured(
        bool(rows) and all(row["jumps"] * 2 > row["folds"] for row in rows),
        apart=CRITERIA.apart,
        panels=rows,
    )


def ground_spectra(panels: Panels) -> dict[str, Measured]:
    """Fig. 10, over the amplitudes of the ground motion."""
    return {
        "fig10-superharmonic": _no_superharmonics(
            {load: main_branch(tree) for load, tree in panels.items()}
        ),
        "fig10-loops": loops(panels),
        "fig10-confirmed": confirmed(panels.values()),
    }


def equivalent_rotation(panels: Panels) -> Measured:
    """The horizontal way of the mass up to theta_eq, the integral of sin(beta0 + theta), compared
    with zetahat.
    """
    from scipy.integrate import quad

    rows = []
    for amplitude, tree in panels.items():
        beta0 = float(System.from_json(str(tree.attrs["system"])).get("model.beta0"))
        way, _ = quad(
            lambda theta, beta0=beta0: np.sin(beta0 + theta),
            0.0,
            float(tree.attrs["scale"]),
            epsabs=1e-14,
        )
        rows.append(
            {"load": amplitude, "angle": np.rad2deg(float(tree.attrs["scale"])), "way": way}
        )
    return measured(max(abs(row["way"] - row["load"]) for row in rows), panels=rows)


def _no_superharmonics(mains: Panels) -> Measured:
    rows = []
    for load, main in mains.items():
        rise = superharmonic(main, share=0.0)[:, 2].max(initial=0.0) / float(
            main["amplitude"].max()
        )
        rows.append({"load": load, "begin": float(main["parameter"].min()), "rise": rise})
    holds = bool(rows) and not any(len(superharmonic(main)) for main in mains.values())
    return measured(holds, prominent=PROMINENT, panels=rows)


def force_diagrams(name: str, panels: Panels) -> dict[str, Measured]:
    """Figs. 11 and 12, over the frequencies of the force."""
    return {
        f"{name}-undeformed": _undeformed(panels),
        f"{name}-anticipated": _anticipated(panels),
        f"{name}-grows": _grows(panels),
        f"{name}-flattens": _flattens(panels),
        f"{name}-coexistence": coexistence(panels),
        f"{name}-confirmed": confirmed(panels.values()),
    }


def _critical(spectrum: Any) -> float:
    """Hcr, at which rest is lost under a static load."""
    return float(spectrum.attrs["critical"])


def _undeformed(panels: Panels) -> Measured:
    """As printed: beyond Hcr motions go from rest to the limit cycle. Erratum 24: rest is left, and
    reached again, in every period."""
    turns = []
    gone = []
    rows = []
    for frequency, tree in panels.items():
        row = tree["undeformed"]
        cycle = float(
            np.max(
                amplitudes_at(main_branch(tree), _critical(tree) * 1.001, stable=True), initial=0.0
            )
        )
        turns.append(bool(row["held_below"]) and not bool(row["held_above"]))
        gone.append(float(row["later"]) > 0.5 * cycle)
        rows.append({"frequency": frequency, "later": float(row["later"]), "cycle": cycle})
    return measured(all(turns) and all(gone), all(turns), panels=rows)


def _anticipated(panels: Panels) -> Measured:
    """As printed: a supercritical cycle below Hcr.

    Erratum 36: it is stable, but born at a fold with a finite amplitude.
    """
    early = []
    small = []
    sudden = []
    lost = []
    rows = []
    for frequency, tree in panels.items():
        branch = main_branch(tree)
        critical = _critical(tree)
        birth = tree["birth"]
        fold, size = first_fold(branch)
        cycle = float(np.max(amplitudes_at(branch, critical, stable=True), initial=0.0))
        early.append(
            fold < critical and amplitudes_at(branch, (fold + critical) / 2, stable=True).size > 0
        )
        small.append(size < CRITERIA.supercritical * cycle)
        unstable = np.max(
            amplitudes_at(branch, fold * (1 + CRITERIA.past_fold), stable=False), initial=0.0
        )
        sudden.append(not small[-1] and unstable > 0.0)
        lost.append(float(birth["after"]) < 0.5 * float(birth["before"]))
        rows.append(
            {
                "frequency": frequency,
                "fold": fold,
                "size": size,
                "cycle": cycle,
                "after": float(birth["after"]),
            }
        )
    critical = _critical(next(iter(panels.values())))
    return measured(
        bool(early) and all(early) and all(small),
        bool(early) and all(early) and all(sudden),
        second=bool(lost) and all(lost),
        critical=critical,
        panels=rows,
        falls=[{"frequency": row["frequency"], "after": row["after"]} for row in rows],
    )


def _grows(panels: Panels) -> Measured:
    """As printed: the first cycle's amplitude grows with Hhat from its birth on. Erratum 30: from
    twice Hcr on, beyond the superharmonics at low frequencies."""
    always = []
    later = []
    rows = []
    for frequency, tree in panels.items():
        main = main_branch(tree)
        near, far = (
            _largest(main, values) for values in _along_the_first_path(main, _critical(tree))
        )
        later.append(_rises(far))
        always.append(_rises(near) and later[-1])
        row = {"frequency": frequency, "birth": near[0], "double": near[-1], "tenfold": far[-1]}
        rows.append(row | {"falls": [] if always[-1] else [{}]})
    return measured(bool(always) and all(always), bool(later) and all(later), panels=rows)


def _along_the_first_path(main: Any, critical: float) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes of the load from the first fold to 2 Hcr, and from there to 10 Hcr."""
    fold = first_fold(main)[0]
    shares = (np.arange(60) + 1) / 60
    return fold + (2 * critical - fold) * shares, critical * (2 + 8 * shares)


def _largest(main: Any, values: np.ndarray) -> np.ndarray:
    steps = steps_of(smooth_lines(main), stable=True)
    return np.array([np.max(passing(steps, value), initial=0.0) for value in values])


def _rises(sizes: np.ndarray) -> bool:
    return bool((sizes > 0).all() and (np.diff(sizes) > 0).all())


def _flattens(panels: Panels) -> Measured:
    """As printed: the first cycle's amplitude falls with Omega at every load. Erratum 30: if both
    frequencies are above the primary resonance, or the load is large."""
    critical = _critical(next(iter(panels.values())))
    sizes = np.array([_largest(main_branch(tree), critical * LOADS) for tree in panels.values()])
    falls = np.diff(sizes, axis=0) < 0
    several = len(panels) > 1
    rows = [
        {"frequency": w, "sizes": [{"size": x} for x in row]}
        for w, row in zip(panels, sizes, strict=True)
    ]
    late = bool(falls[:, -1].all()) and not falls[:, 0].any() and min(panels) < CRITERIA.resonance
    return measured(several and bool(falls.all()), several and late, panels=rows)


def coexistence(panels: Panels) -> Measured:
    """As printed: the number of coexisting stable motions grows with the load. Erratum 38: several
    coexist, but their mean number falls again.

    The means are those over the quarters of the range beyond twice Hcr, by the branches and,
    independently, by the attractors on which simulated motions have settled.
    """
    means = []
    dots = []
    most = []
    rows = []
    for frequency, tree in panels.items():
        start = 2 * _critical(tree)
        high = float(tree.attrs["bounds"][1])
        edges = np.linspace(start, high, CRITERIA.quarters + 1)
        values, number = range_counts(tree, CRITERIA.samples)
        means.append(_means(values, number, edges))
        simulated = tree["search"]["searched"].values
        reached = np.isclose(
            tree["attractors"]["parameter"].values[:, None], simulated, rtol=1e-12, atol=0.0
        ).sum(axis=0)
        dots.append(_means(simulated, reached, edges))
        most.append(int(number[values > start].max()))
        rows.append(
            {
                "frequency": frequency,
                "most": most[-1],
                "place": float(values[values > start][number[values > start].argmax()]),
                "means": [{"mean": mean} for mean in means[-1]],
                "dots": [{"mean": mean} for mean in dots[-1]],
            }
        )
    grows = [bool((np.diff(one) > 0.0).all()) for one in means]
    falls = [
        bool((np.diff(one) < 0.0).any() and (np.diff(other) < 0.0).any())
        for one, other in zip(means, dots, strict=True)
    ]
    several = bool(most) and min(most) > 1
    return measured(
        several and all(grows),
        several and not all(grows),
        second=any(falls),
        panels=rows,
        reached=rows,
    )


def _means(values: np.ndarray, number: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The means of a number over the values between neighbouring edges; 0 where there is none."""
    inside = [(values > low) & (values <= high) for low, high in pairwise(edges)]
    return np.array([float(number[here].mean()) if here.any() else 0.0 for here in inside])


def border_of_rest(data: Any) -> Measured:
    """As printed: theta = 0 is held up to abs(V / tan(beta0)) under load (iii). Erratum 35: as long
    as the ellipse of the loads lies inside the border."""
    rest = data["undeformed"]
    disturbed = data["disturbed"]
    critical = _critical(data["a"])
    below, above, printed = map(float, disturbed["moved"].values)
    turns = bool(rest["held_below"]) and not bool(rest["held_above"])
    return measured(
        printed < CRITERIA.held,
        turns and critical < float(disturbed.attrs["printed"]),
        second=below < CRITERIA.held and above > CRITERIA.left and printed > CRITERIA.left,
        printed=float(disturbed.attrs["printed"]),
        critical=critical,
        below=below,
        above=above,
        wrong=printed,
        amplitude=float(disturbed["amplitude"].values[-1]),
    )


def both_diagram(spectrum: Any, mirror: Any) -> dict[str, Measured]:
    """Fig. 13; `mirror` holds how far motions are from mirror images under each load."""
    gaps = dict(zip(map(str, mirror["load"].values), map(float, mirror["gap"].values), strict=True))
    own = [int(branch["symmetric"].sum()) for _, branch in branches_of(spectrum)]
    main = main_branch(spectrum)
    uneven = np.abs(main["highest"].values + main["lowest"].values)
    kinds = {kind: count(spectrum, kind) for kind in ("LP", "PD", "GR")}
    values, number = range_counts(spectrum, CRITERIA.samples)
    most = int(number.max())
    shared = float((number > 1).mean())
    doubled = sorted(
        {
            int(branch["period"][0])
            for _, branch in branches_of(spectrum)
            if branch.attrs["end_kinds"].count("PD")
        }
    )
    fold = np.fmin.reduce(
        [
            first_fold(branch)[0]
            for _, branch in branches_of(spectrum)
            if int(branch["period"][0]) == 1
        ]
    )
    same = (
        fold < _critical(spectrum)
        and {2, 4} <= set(doubled)
        and spectrum["bands"].sizes["band"] > 0
    )
    symmetric = (
        max(gaps["(i)"], gaps["(ii)"]) < CRITERIA.confirmed
        and gaps["(iii)"] > CRITERIA.apart
        and not any(own)
    )
    return {
        "fig13-symmetry": measured(
            symmetric,
            loads=[{"load": load, "gap": gap} for load, gap in gaps.items()],
            uneven=uneven.max(),
        ),
        "fig13-features": measured(
            same and shared > CRITERIA.shared and all(kinds.values()),
            most=most,
            shared=shared,
            fold=fold,
            bands=spectrum["bands"].sizes["band"],
            doubled=[{"period": period} for period in doubled],
            place=float(values[number.argmax()]),
            kinds=[{"kind": kind, "number": n} for kind, n in kinds.items()],
        ),
        "fig13-confirmed": confirmed([spectrum]),
    }
