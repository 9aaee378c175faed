"""How much of Fig. 9 is proved: every orbit and every special point of a panel's branches.

    python -m saltus reproduce fig09
    python benchmarks/prove_figure.py results/fig09.nc b d

An orbit is regular if it is no special point itself: no multiplier has a modulus within 1e-6 of 1,
no impact is slower than 1e-10, and its contact is never nearer than 1e-12 between impacts.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Any

import numpy as np

import saltus

PROVED_KINDS = ("LP", "BPC", "PD", "GR")
SAME = 1e-9  # special points of one kind whose parameters differ by less are one


def main(path: str, panels: list[str]) -> None:
    """Print the figures of some panels."""
    tree = saltus.load(path)
    for panel in panels:
        orbits_of_panel(panel, tree[panel])
        special_points_of_panel(panel, tree[panel])


def is_regular(orbit: saltus.PeriodicOrbit) -> bool:
    """Whether an orbit is no special point itself."""
    moduli = np.abs(orbit.multipliers)
    near = bool((np.abs(moduli - 1.0) < 1e-6).any())
    touches = orbit.impact_count > 0 and orbit.slowest < 1e-10
    return not near and not touches and not abs(orbit.clearance) < 1e-12


def orbits_of_panel(panel: str, tree: Any) -> None:
    """The share of the orbits that is proved, by period."""
    began = time.process_time()
    counts: Counter[tuple[int, str]] = Counter()
    stability: Counter[str] = Counter()
    widths: list[float] = []
    seconds: list[float] = []
    failures: list[str] = []
    for number, branch in saltus.branches_of(tree):
        for point, orbit in enumerate(saltus.orbits.orbits_of(branch)):
            kind = "regular" if is_regular(orbit) else "special"
            proof = saltus.prove(orbit)
            counts[orbit.period, kind] += 1
            seconds.append(proof.seconds)
            if not proof.proved:
                if kind == "regular":
                    failures.append(f"branch {number}, point {point}: {orbit}: {proof.reason}")
                continue
            counts[orbit.period, f"{kind} proved"] += 1
            if len(proof.impact_times):
                widths.append(
                    2.0
                    * float(max(proof.impact_times[:, 1].max(), proof.impact_speeds[:, 1].max()))
                )
            if proof.stable is None:
                stability["undecided"] += 1
            else:
                agrees = proof.stable == bool(orbit.stable)
                stability["as saltus says" if agrees else "against saltus"] += 1
                if not agrees:
                    failures.append(f"branch {number}, point {point}: {orbit}: stability differs")
    for period in sorted({period for period, _ in counts}):
        row = [counts[period, kind] for kind in ("regular", "regular proved")]
        row += [counts[period, kind] for kind in ("special", "special proved")]
        print(
            f"{panel} q = {period}: regular {row[0]}, proved {row[1]}; special {row[2]}, {row[3]}"
        )
    print(f"{panel} stability: {dict(stability)}")
    if widths:
        shares = np.quantile(widths, [0.0, 0.5, 0.9, 1.0])
        told = ", ".join(f"{share:.2g}" for share in shares)
        print(f"{panel} widths (least, median, 90 %, largest): {told}")
    shares = np.quantile(seconds, [0.5, 0.9, 1.0])
    told = ", ".join(f"{share:.3g}" for share in shares)
    spent = time.process_time() - began
    print(f"{panel} seconds (median, 90 %, largest): {told}; all {spent:.0f} s of processor time")
    print(*failures, sep="\n", flush=True)


def special_points_of_panel(panel: str, tree: Any) -> None:
    """The share of the special points that is proved, each once."""
    began = time.process_time()
    seen: dict[tuple[str, float], bool] = {}
    radii: list[float] = []
    failures: list[str] = []
    for number, dataset in saltus.branches_of(tree):
        orbits = saltus.orbits.orbits_of(dataset)
        parameters = dataset["parameter"].values
        branch = saltus.continue_orbit(
            orbits[len(orbits) // 2],
            str(tree.attrs["path"]),
            (float(parameters.min()), float(parameters.max())),
        )
        for special in branch.special:
            if special.kind not in PROVED_KINDS:
                continue
            proof = saltus.prove(special)
            same = next(
                (
                    key
                    for key in seen
                    if key[0] == special.kind and abs(key[1] - special.parameter) < SAME
                ),
                (str(special.kind), special.parameter),
            )
            seen[same] = seen.get(same, False) or bool(proof.proved)
            if proof.proved:
                radii.append(float(proof.parameter[1]))
            else:
                failures.append(f"branch {number}: {special}: {proof.reason}")
    counts = Counter(kind for kind, _ in seen)
    proved = Counter(kind for (kind, _), done in seen.items() if done)
    told = ", ".join(f"{kind} {proved[kind]} of {counts[kind]}" for kind in sorted(counts))
    print(f"{panel} special points: {told}; {time.process_time() - began:.0f} s of processor time")
    if radii:
        print(f"{panel} radii of the parameter: {min(radii):.2g} to {max(radii):.2g}")
    print(*failures, sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
