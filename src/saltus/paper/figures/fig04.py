"""Fig. 4: phase portraits of the symmetric system with each source of dissipation."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check, compare
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.figures.portrait import BETA0, VERTICAL, circled, portrait, system
from saltus.paper.provenance import TOLERANCE, tree
from saltus.plots import DOUBLE_COLUMN, draw_portrait, new_figure, panel_label, styled

BOUND = 2.55  # rad, a little outside the axes
INNER = [(0.2, 0.0), (0.4, 0.0), (-0.2, 0.0), (-0.4, 0.0)]
LOOPS = [(s * theta, 0.0) for theta in (0.68, 0.95, 1.2) for s in (1, -1)]
STARTS: dict[str, list[tuple[float, float]]] = {
    "a": [*INNER[:2], *LOOPS, (2.0, 0.0), (2.2, 0.0)],
    "b": [*LOOPS, (0.42, 0.0), (-0.42, 0.0), (2.25, 0.0), (-2.25, 0.0)],
    "c": [(2.3, 0.0), (-2.3, 0.0), (2.0, 0.0), (-2.0, 0.0), (0.45, 0.0), (-0.45, 0.0), (0.62, 0.0), (-0.62, 0.0)],
}
DURATIONS = {"a": 34.0, "b": 60.0, "c": 70.0}


def systems() -> dict[str, Any]:
    """(a) no dissipation, (b) at impacts only, (c) viscous damping only."""
    return {"a": system(), "b": system(e=0.8), "c": system(damping=0.1)}


def compute(samples: int = 900) -> Any:
    """The three portraits."""
    groups = {name: portrait(s, STARTS[name], DURATIONS[name], BOUND, samples) for name, s in systems().items()}
    return tree(groups, what="phase portraits of the symmetric system, beta0 = 80 deg, V = -1.5 / sin(beta0)", tol=TOLERANCE)


@styled
def draw(data: Any) -> Any:
    """Three panels on one pair of axes."""
    figure = new_figure(DOUBLE_COLUMN, 68.0)
    axes = figure.subplots(1, 3, sharey=True)
    for ax, name in zip(axes, "abc", strict=True):
        draw_portrait(ax, data[name], (-2.45, 2.45), (-0.95, 0.95))
        panel_label(ax, name)
    axes[0].set_ylabel(r"$\dot\theta$")
    return figure


def _corner_error(group: Any) -> float:
    """How far the measured jumps of theta'' at impacts with theta' > 0 are from 2 V cos(beta0), which is not 0."""
    jumps = np.asarray(group["corner"])
    return float(np.abs(jumps[np.isfinite(jumps)] - 2 * VERTICAL * np.cos(BETA0)).max())


def claims(data: Any) -> list[Claim]:
    """The fixed points, and what the text says of each panel."""
    a, b, c = data["a"], data["b"], data["c"]
    stable = a["equilibrium"].values[a["stable"].values.astype(bool)]
    rounds_a, wrong = circled(a), a["wrong_reaction"].values
    outer_b = [i for i, (theta, _) in enumerate(STARTS["b"]) if abs(theta) > 2 or abs(theta) < 0.5]
    inner_b = [i for i in range(len(STARTS["b"])) if i not in outer_b]
    rounds_c = [len(r) for r in circled(c)]
    ends = c["end"].values
    left = float(np.abs(b["end"].values[outer_b]).max())
    nearest = sorted({round(float(stable[np.argmin(abs(stable - end))]), 4) for end in ends})
    return [
        compare("fig04-load", "section 5.2", "V̄ = −1.5 / sin β₀", printed="-1.523", value=VERTICAL, evidence="β₀ = 80°"),
        compare(
            "fig04-theta-i",
            "section 5.2",
            "θ_I = −θ_II for k = 1",
            printed="1.462",
            unit="rad",
            value=float(stable[-1]),
            evidence=f"root of P'(θ) = 0; θ_II = {stable[0]:.6f}",
        ),
        check(
            "fig04-tristable",
            "section 5.2",
            "Three stable equilibria: θ = 0, θ_I > 0 and θ_II < 0",
            printed=len(stable) == 3 and stable[0] < 0 == stable[1] < stable[2],
            evidence=f"equilibria {np.round(a['equilibrium'].values, 5).tolist()}, stable {stable.round(5).tolist()}",
        ),
        check(
            "fig04-feasible",
            "section 1",
            "Three stable attractors exist within the feasible range of deformations",
            printed=len(stable) == 3 and bool(np.abs(stable).max() < float(a["line_limit"])),
            evidence=f"|θ_I| = {np.rad2deg(stable[-1]):.2f}°, before the straight line at "
            f"{np.rad2deg(float(a['line_limit'])):.0f}°",
        ),
        check(
            "fig04a-regions",
            "Fig. 4a",
            "Without losses a motion goes round one attractor inside its separatrix, and round all three outside",
            printed=sorted({len(r) for r in rounds_a}) == [1, 3] and _closed(a),
            evidence=f"attractors circled by the {len(rounds_a)} motions: {[len(r) for r in rounds_a]}; each "
            "separatrix ends at a saddle",
        ),
        check(
            "fig04a-one-layer",
            "Fig. 4a",
            "In these motions one layer stays closed while the other is open",
            printed=bool(wrong.max() == 0),
            evidence=f"share of the time in which the closed layer's reaction has the wrong sign: {wrong.round(3).tolist()}",
        ),
        check(
            "fig04a-energy",
            "Fig. 4a",
            "The system without losses is conservative",
            printed=_energy_drift(a),
            tolerance=1e-12,
            evidence=f"largest change of energy along the motions, τ up to {DURATIONS['a']:g}",
        ),
        check(
            "fig04-corner",
            "section 5.2",
            "Trajectories have a discontinuous tangent at θ = 0",
            printed=_corner_error(a),
            evidence=f"θ'' of the simulated motions jumps by {float(np.nanmax(a['corner'])):.6f} at an impact with θ' > 0, "
            "that is 2 V cos β₀ (erratum 4)",
        ),
        check(
            "fig04b-loops",
            "Fig. 4b",
            "Loss at impacts leaves the regions around θ_I and θ_II as they were, with periodic motion",
            printed=_loop_shift(a, b) + max(_drift(b, i) for i in inner_b),
            tolerance=1e-9,
            evidence=f"shift of the separatrix loops, and energy drift of {len(inner_b)} motions inside them; they have "
            f"{int(b['impacts'][inner_b].sum())} impacts",
        ),
        check(
            "fig04b-decay",
            "Fig. 4b",
            "Loss at impacts makes every other motion decay to the undeformed state",
            printed=left < 1e-6,
            evidence=f"{len(outer_b)} motions, |θ| ≤ {left:.1e} at τ = {DURATIONS['b']:g}; no separatrix closes around θ = 0",
        ),
        check(
            "fig04c-attractors",
            "Fig. 4c",
            "With viscous damping every motion decays to one of the three attractors",
            printed=bool(max(np.min(abs(stable - end)) for end in ends) < 0.1),
            evidence=f"the {len(ends)} motions end near {nearest}",
        ),
        check(
            "fig04c-rounds",
            "Fig. 4c",
            "With viscous damping each trajectory circles all three attractors for some time, and none is bounded",
            printed=min(rounds_c) == 3,
            corrected=min(rounds_c) < 3
            and bool(np.nanmax(abs(c["theta"].values)) <= max(abs(t) for t, _ in STARTS["c"]) + 1e-12),
            erratum=27,
            evidence=f"attractors circled: {rounds_c}; the largest |θ| after the start is the start itself, "
            f"{np.nanmax(abs(c['theta'].values)):.3f} rad: the energy only falls",
        ),
    ]


def _closed(panel: Any) -> bool:
    return bool(np.isfinite(panel["manifold_starts_at"].values).all())


def _drift(panel: Any, i: int) -> float:
    energy = panel["energy"][i].values
    return float(np.nanmax(energy) - np.nanmin(energy))


def _energy_drift(panel: Any) -> float:
    return max(_drift(panel, i) for i in range(panel.sizes["trajectory"]))


def _loop_shift(first: Any, second: Any) -> float:
    """The largest distance between the outward branches, which never touch theta = 0, of two portraits."""
    shift = 0.0
    for i in range(0, first.sizes["manifold"], 2):
        for name in ("manifold_theta", "manifold_velocity"):
            one, two = (panel[name][i].dropna("point").values for panel in (first, second))
            shift = max(shift, float(abs(one - two).max()) if one.size == two.size else np.inf)
    return shift


FIGURE = PaperFigure(
    name="fig04",
    title="Fig. 4: phase portraits of the symmetric system",
    caption=(
        "Phase portraits for k = 1, m = 0, β₀ = 80°, V = −1.5/sin β₀: (a) C = 0, e = 1; (b) C = 0, e = 0.8; (c) "
        "C = 0.1, e = 1. Blue: "
        "motions; grey dashed: separatrices, computed as the stable manifolds of the saddles; filled: stable, "
        "open: unstable fixed "
        "points; grey line: impact at θ = 0, where velocities jump in (b); green: straight line at |θ| = π − β₀ "
        "= 100° (erratum 19). Decaying motions are drawn until they come close to their attractor; in (b) the "
        "manifolds that separate no two attractors are left out."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
