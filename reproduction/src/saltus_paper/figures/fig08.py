"""Fig.

8: loading paths in the plane of the loads, and the quasi-static monostable domain with both of its
borders.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import Harmonic, Load, Metainterface, Stop, System, simulate
from saltus.plots import LOOK, arrow_along, new_figure, panel_label, styled
from saltus.theory import (
    critical_horizontal,
    equilibria,
    fold_horizontal,
    is_monostable,
    subcritical_vertical,
    unloaded_fold,
)
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import dataset, scalar_dataset, scalars, tree
from saltus_paper.figures.figure import paper_figure

# Hhat, Vbar, Vhat of load (i)
LOAD_SEGMENTS = ((0.05, -0.5, 0.0), (0.2, -0.7, 0.0), (0.16, -1.2, 0.0))
ELLIPSES = ((0.05, -0.5, 0.25), (0.2, -0.5, 0.25))  # of load (iii)
LOWEST = -1.6


def compute(beta0: float = 80.0) -> Any:
    """Both borders, the paths, and the counts of equilibria that prove which border is the true
    one; `beta0` in degrees.
    """
    groups = {
        "borders": _borders(np.deg2rad(beta0)),
        "i": _paths(np.deg2rad(beta0), LOAD_SEGMENTS, "load (i), `loadpatha`"),
        "iii": _paths(np.deg2rad(beta0), ELLIPSES, "load (iii), `loadpathb`"),
        "numbers": _numbers(),
    }
    return tree(
        groups, what="loading paths and the quasi-static monostable domain", beta0_degrees=beta0
    )


def _borders(beta0: float) -> Any:
    vertical = np.linspace(LOWEST, 0.0, 321)
    start = subcritical_vertical(beta0)
    lowest = unloaded_fold(beta0)[0]
    folded = start + (lowest - start) * np.linspace(0, 1, 121) ** 2
    critical = critical_horizontal(beta0, vertical)
    return dataset(
        {
            "critical": (
                "vertical",
                critical,
                "1",
                "Hcr, where theta = 0 is lost (the paper's border)",
            ),
            "fold": (
                "folded",
                fold_horizontal(beta0, folded),
                "1",
                "H at the fold of deformed equilibria (erratum 23)",
            ),
        },
        {
            "vertical": ("vertical", vertical, "1", "V"),
            "folded": ("folded", folded, "1", "V from -sin(beta0) to where the fold reaches H = 0"),
        },
        what="borders of the monostable domain",
        subcritical_below=start,
        deformed_without_h_below=lowest,
    )


def printed_domain(beta0: float, horizontal: Any, vertical: Any) -> Any:
    """Where V cos(beta0) < -abs(H) sin(beta0), as printed: theta = 0 is stable there, but not
    always the only equilibrium.
    """
    return vertical * np.cos(beta0) < -np.abs(horizontal) * np.sin(beta0)


def _paths(beta0: float, loads: tuple[tuple[float, float, float], ...], what: str) -> Any:
    phase = np.linspace(0, 2 * np.pi, 241)
    rows = []
    systems = []
    for amplitude, mean, swing in loads:
        vertical = Harmonic(mean=mean, amplitude=swing, phase=np.pi / 2) if swing else mean
        load = Load(frequency=1.0, horizontal=Harmonic(amplitude=amplitude), vertical=vertical)
        systems.append(System(model=Metainterface(beta0=beta0), load=load).to_json())
        rows.append(
            [
                np.broadcast_to(channel(phase), phase.shape)
                for channel in (load.horizontal, load.vertical)
            ]
        )
    horizontal, vertical = np.moveaxis(np.array(rows), 1, 0)
    return dataset(
        {
            "horizontal": (("path", "phase"), horizontal, "1", "H"),
            "vertical": (("path", "phase"), vertical, "1", "V"),
            "within": (
                "path",
                is_monostable(beta0, horizontal, vertical).all(axis=1),
                "1",
                "all of the path in the true domain",
            ),
            "within_printed": (
                "path",
                printed_domain(beta0, horizontal, vertical).all(axis=1),
                "1",
                "in the printed domain",
            ),
            "held": ("path", [_held(s) for s in systems], "1", "rests in all"),
            "deformed": (
                "path",
                [_most_deformed(beta0, *row) for row in rows],
                "1",
                "deformed equilibria under its loads",
            ),
            "system": ("path", np.array(systems), "1", "the System as JSON"),
        },
        {"phase": ("phase", phase, "rad", "Omega tau")},
        what=what,
    )


def _held(system: str) -> bool:
    """Whether a motion from rest at theta = 0 stays at rest for two periods of the loads of the
    path.
    """
    motion = simulate(System.from_json(system), theta=0.0, velocity=0.0, periods=2)
    return motion.stop is Stop.REST and len(motion.impacts) == 0


def _most_deformed(beta0: float, horizontal: np.ndarray, vertical: np.ndarray) -> int:
    """The largest number of deformed equilibria under the loads of 61 points of a path, each held
    constant.
    """
    model = Metainterface(beta0=beta0)
    points = zip(horizontal[::4], vertical[::4], strict=True)
    systems = (
        System(model=model, load=Load(horizontal=float(h), vertical=float(v))) for h, v in points
    )
    return max(sum(p.theta != 0.0 for p in equilibria(system)) for system in systems)


def _numbers() -> Any:
    """Erratum 23 in numbers: the fold and Hcr at V = -1.2, and how many equilibria there are on
    each side of the fold.
    """
    beta0 = np.deg2rad(80.0)
    vertical = -1.2
    fold = float(fold_horizontal(beta0, vertical))
    critical = float(critical_horizontal(beta0, vertical))

    def under(horizontal: float) -> System:
        return System(
            model=Metainterface(beta0=beta0), load=Load(horizontal=horizontal, vertical=vertical)
        )

    def count(horizontal: float) -> int:
        return len(equilibria(under(horizontal)))

    def held(horizontal: float) -> int:
        return int(simulate(under(horizontal), theta=0.0, duration=100.0).stop is Stop.REST)

    values = {
        "fold": fold,
        "critical": critical,
        "held_below": held(critical * 0.999),
        "held_above": held(critical * 1.001),
        "count_below_fold": count(fold * 0.999),
        "count_above_fold": count(fold * 1.001),
        "lowest_80": unloaded_fold(beta0)[0],
        "lowest_60": unloaded_fold(np.deg2rad(60.0))[0],
        "count_at_rest_above": count_unloaded(beta0, unloaded_fold(beta0)[0] + 1e-3),
        "count_at_rest_below": count_unloaded(beta0, unloaded_fold(beta0)[0] - 1e-3),
    }
    return scalar_dataset(values, what="numbers of erratum 23")


def count_unloaded(beta0: float, vertical: float) -> int:
    """How many equilibria there are under V only."""
    return len(equilibria(System(model=Metainterface(beta0=beta0), load=Load(vertical=vertical))))


@styled
def draw(data: Any) -> Any:
    """(a) load (i), (b) load (iii), both over the domain."""
    figure = new_figure(LOOK.double_column, 86.0)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, name, label in zip(axes, ("i", "iii"), "ab", strict=True):
        draw_domain(ax, data["borders"], label=label == "a")
        draw_path(ax, data[name])
        ax.set_xlim(-0.33, 0.33)
        ax.set_ylim(LOWEST, 0.25)
        ax.set_xlabel(r"horizontal load $\mathcal{H}$")
        panel_label(ax, label)
    axes[0].set_ylabel(r"vertical load $\mathcal{V}$")
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """The domain (erratum 23) and the paths."""
    n = scalars(data["numbers"])
    i = data["i"]
    iii = data["iii"]
    below_critical = n["fold"] < n["critical"]
    found = {
        "fig08-domain": measured(
            n["count_above_fold"] == 1 or not below_critical,
            n["count_below_fold"] == 1 and n["count_above_fold"] > 1 and below_critical,
            wrong_paths=int((i["within_printed"] & ~i["within"]).sum()),
        ),
        "fig08-domain-without-h": measured(
            n["count_at_rest_below"] == 1,
            n["count_at_rest_above"] == 1 and n["count_at_rest_below"] > 1,
        ),
        "fig08-paths": measured(
            all(len(set(p["within"].values.tolist())) == 2 and _borne_out(p) for p in (i, iii)),
            **{
                f"{name}_{load}": data[load][name].values.tolist()
                for name in ("within", "held", "deformed")
                for load in ("i", "iii")
            },
        ),
        "fig08-critical": measured(n["held_below"] == 1 and n["held_above"] == 0),
    }
    return with_fields(n, found)


def _borne_out(paths: Any) -> bool:
    """Whether motions stay at rest on exactly the paths within the printed border, and deformed
    equilibria are absent on exactly the paths within the true domain."""
    held = (paths["held"].values.astype(bool) == paths["within_printed"].values.astype(bool)).all()
    return bool(
        held and ((paths["deformed"].values == 0) == paths["within"].values.astype(bool)).all()
    )


TINT = "#dfeaf4"


def draw_domain(ax: Any, borders: Any, label: bool = True) -> None:
    """The true domain shaded, the part that belongs to it by the printed border only hatched, and
    both borders.
    """
    vertical = borders["vertical"].values
    critical = borders["critical"].values
    folded = borders["folded"].values
    fold = borders["fold"].values
    start = float(borders.attrs["subcritical_below"])
    upper = vertical >= start
    edge_v = np.concatenate([folded[::-1], vertical[upper]])
    edge_h = np.concatenate([fold[::-1], critical[upper]])
    ax.fill_betweenx(edge_v, -edge_h, edge_h, color=TINT, lw=0, zorder=0)
    for sign in (-1, 1):
        below = vertical <= start
        inner = np.interp(vertical[below], folded[::-1], fold[::-1], left=0.0)
        ax.fill_betweenx(
            vertical[below],
            sign * inner,
            sign * critical[below],
            facecolor="none",
            edgecolor="#b0b0b0",
            hatch="////",
            lw=0,
            zorder=0,
        )
        ax.plot(sign * critical, vertical, color=LOOK.ink, lw=0.8, zorder=2)
        ax.plot(sign * fold, folded, color=LOOK.ink, lw=1.6, ls=(0, (1, 1)), zorder=2)
    ax.axhline(0.0, color=LOOK.ink, lw=0.4, zorder=1)
    ax.axvline(0.0, color=LOOK.ink, lw=0.4, zorder=1)
    if label:
        _labels(ax, float(np.interp(-1.5, vertical, critical)))


def draw_path(ax: Any, paths: Any) -> None:
    """Each path with arrows of its direction: blue solid if within the domain, red dashed if it
    leaves it.
    """
    for i in range(paths.sizes["path"]):
        h = paths["horizontal"][i].values
        v = paths["vertical"][i].values
        inside = bool(paths["within"][i])
        style = LOOK.stable_line if inside else LOOK.unstable_line
        if np.ptp(v) == 0:  # there and back on one segment: drawn once, with an arrow at each end
            h, v = np.linspace(h.min(), h.max(), 50), np.full(50, v[0])
            arrow_along(ax, h[::-1], v, 48, style["color"])
            arrows = [48]
        else:
            arrows = [30, 90, 150, 210]
        ax.plot(h, v, **{**style, "linewidth": 1.4}, zorder=4)
        for at in arrows:
            arrow_along(ax, h, v, at, style["color"], size=8)


def _labels(ax: Any, reach: float) -> None:
    leader = {"arrowstyle": "-", "color": LOOK.ink, "lw": 0.5, "shrinkA": 1, "shrinkB": 1}
    text: dict[str, Any] = {"fontsize": 8, "ha": "left", "va": "center", "arrowprops": leader}
    ax.text(0.0, -0.9, "monostable", ha="center", va="center", fontsize=8)
    ax.annotate(
        r"$\mathcal{V}\cos\beta_0=-|\mathcal{H}|\sin\beta_0$",
        xy=(-0.0441, -0.25),
        xytext=(-0.31, -0.06),
        **text,
    )
    ax.annotate("fold of\ndeformed\nequilibria", xy=(0.1725, -1.03), xytext=(0.225, -0.9), **text)
    ax.text(
        0.0,
        -1.5,
        "more equilibria",
        ha="center",
        va="center",
        fontsize=8,
        bbox={"facecolor": "white", "lw": 0, "pad": 1},
    )


FIGURE = paper_figure("fig08", compute=compute, draw=draw, measure=measure)
