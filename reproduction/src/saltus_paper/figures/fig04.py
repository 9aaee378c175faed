"""Fig. 4: phase portraits of the symmetric system with each source of dissipation."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import separatrices
from saltus.plots import LOOK, new_figure, panel_label, styled
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, tree
from saltus_paper.figures.figure import LivingPage, paper_figure
from saltus_paper.figures.phase_portraits import (
    BETA0,
    VERTICAL,
    circled,
    closed,
    constant_load,
    draw_portrait,
    outward,
    portrait,
)

BOUND = 2.55  # rad, a little outside the axes
# Inside the separatrices, and far enough from them for both to be seen.
INNER = [(0.16, 0.0), (0.32, 0.0)]
LOOPS = [(s * theta, 0.0) for theta in (0.8, 1.0, 1.22) for s in (1, -1)]
STARTS: dict[str, list[tuple[float, float]]] = {
    "a": [*INNER, *LOOPS, (2.0, 0.0), (2.2, 0.0)],
    "b": [*LOOPS, (0.42, 0.0), (-0.42, 0.0), (2.25, 0.0), (-2.25, 0.0)],
    "c": [
        (2.3, 0.0),
        (-2.3, 0.0),
        (2.0, 0.0),
        (-2.0, 0.0),
        (0.45, 0.0),
        (-0.45, 0.0),
        (0.62, 0.0),
        (-0.62, 0.0),
    ],
}
DURATIONS = {"a": 34.0, "b": 60.0, "c": 70.0}


def systems() -> dict[str, Any]:
    """(a) no dissipation, (b) at impacts only, (c) viscous damping only."""
    return {"a": constant_load(), "b": constant_load(e=0.8), "c": constant_load(damping=0.1)}


def compute(samples: int = 900) -> Any:
    """The three portraits."""
    groups = {
        name: portrait(s, STARTS[name], DURATIONS[name], BOUND, samples)
        for name, s in systems().items()
    }
    return tree(
        groups,
        what="phase portraits of the symmetric system, beta0 = 80 deg, V = -1.5 / sin(beta0)",
        tol=TOLERANCE,
    )


@styled
def draw(data: Any) -> Any:
    """Three panels on one pair of axes."""
    figure = new_figure(LOOK.double_column, 68.0)
    axes = figure.subplots(1, 3, sharey=True)
    for ax, name in zip(axes, "abc", strict=True):
        draw_portrait(ax, data[name], (-2.45, 2.45), (-0.95, 0.95))
        panel_label(ax, name)
        ax.set_ylabel(r"$\dot\theta$")
    return figure


def page(data: Any) -> LivingPage:
    """The system of (c) with the curves between the basins of its three equilibria, and a motion
    that comes near two of them.
    """
    system = systems()["c"]
    between = separatrices(system, window=((-BOUND, BOUND), (-1.0, 1.0)), step=0.1)
    return system, list(between), {"theta": 0.0, "velocity": 0.8, "duration": DURATIONS["c"]}


def _corner_error(group: Any) -> float:
    """How far the measured jumps of theta'' at impacts with theta' > 0 are from 2 V cos(beta0),
    which is not 0.
    """
    jumps = np.asarray(group["corner"])
    return float(np.abs(jumps[np.isfinite(jumps)] - 2 * VERTICAL * np.cos(BETA0)).max())


def measure(data: Any) -> dict[str, Measured]:
    """The fixed points, and the statements of the text on each panel."""
    a = data["a"]
    b = data["b"]
    c = data["c"]
    stable = a["equilibrium"].values[a["stable"].values.astype(bool)]
    rounds_a = [len(r) for r in circled(a)]
    wrong = a["wrong_reaction"].values
    outer_b = [i for i, (theta, _) in enumerate(STARTS["b"]) if abs(theta) > 2 or abs(theta) < 0.5]
    inner_b = [i for i in range(len(STARTS["b"])) if i not in outer_b]
    rounds_c = [len(r) for r in circled(c)]
    ends = c["end"].values
    left = float(np.abs(b["end"].values[outer_b]).max())
    nearest = sorted({round(float(stable[np.argmin(abs(stable - end))]), 4) for end in ends})
    return {
        "fig04-load": measured(VERTICAL),
        "fig04-theta-i": measured(float(stable[-1]), theta_ii=stable[0]),
        "fig04-tristable": measured(
            len(stable) == 3 and stable[0] < 0 == stable[1] < stable[2],
            equilibria=np.round(a["equilibrium"].values, 5).tolist(),
            stable=stable.round(5).tolist(),
        ),
        "fig04-feasible": measured(
            len(stable) == 3 and bool(np.abs(stable).max() < float(a["line_limit"])),
            theta_i=np.rad2deg(stable[-1]),
            line_limit=np.rad2deg(float(a["line_limit"])),
        ),
        "fig04a-regions": measured(
            sorted(set(rounds_a)) == [1, 3] and bool(closed(a).all()),
            motions=len(rounds_a),
            circled=rounds_a,
        ),
        "fig04a-one-layer": measured(bool(wrong.max() == 0), shares=wrong.round(3).tolist()),
        "fig04a-energy": measured(
            max(_drift(a, i) for i in range(len(STARTS["a"]))), duration=DURATIONS["a"]
        ),
        "fig04-corner": measured(_corner_error(a), jump=float(np.nanmax(a["corner"]))),
        "fig04b-loops": measured(
            _loop_shift(a, b) + max(_drift(b, i) for i in inner_b),
            motions=len(inner_b),
            impacts=int(b["impacts"][inner_b].sum()),
        ),
        "fig04b-decay": measured(
            left < 1e-6, motions=len(outer_b), largest=left, duration=DURATIONS["b"]
        ),
        "fig04c-attractors": measured(
            bool(max(np.min(abs(stable - end)) for end in ends) < 0.1),
            motions=len(ends),
            attractors=nearest,
        ),
        "fig04c-rounds": measured(
            min(rounds_c) == 3,
            min(rounds_c) < 3
            and bool(
                np.nanmax(abs(c["theta"].values)) <= max(abs(t) for t, _ in STARTS["c"]) + 1e-12
            ),
            circled=rounds_c,
            largest=np.nanmax(abs(c["theta"].values)),
        ),
    }


def _drift(panel: Any, i: int) -> float:
    energy = panel["energy"][i].values
    return float(np.nanmax(energy) - np.nanmin(energy))


def _loop_shift(first: Any, second: Any) -> float:
    """The largest distance between the loops of the separatrices of two portraits, which never
    touch theta = 0.
    """
    pairs = zip(outward(first), outward(second), strict=True)
    return max(
        float(np.abs(one - two).max()) if one.shape == two.shape else np.inf for one, two in pairs
    )


FIGURE = paper_figure("fig04", compute=compute, draw=draw, measure=measure, page=page)
