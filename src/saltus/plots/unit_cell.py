"""The unit cell as a mechanical drawing: bars, hinges, sliders, springs, masses, angles, forces and
ground motion.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from saltus.plots.conventions import LOOK, axes_or_new, drawing

BAR = "#5f6b76"
FORCE = LOOK.unstable
GROUND = LOOK.limit
ORIGIN = np.array([-0.95, -0.55])  # of the inertial frame, from the lower left hinge
ARROW: dict[str, Any] = {
    "arrowstyle": "-|>,head_width=0.2,head_length=0.45",
    "lw": 1.1,
    "shrinkA": 0,
    "shrinkB": 0,
}


@drawing
def draw_unit_cell(
    dataset: Any, *, ax: Axes | None = None, width: float = LOOK.single_column
) -> Axes:
    """Draw the dataset of a `UnitCell` or a `CellLayout`; returns the axes."""
    ax = axes_or_new(ax, width, 0.9 * width)
    draw_cell(ax, dataset)
    return ax


def draw_cell(
    ax: Any, cell: Any, labels: Literal["", "undeformed", "deformed"] = ""
) -> dict[str, np.ndarray]:
    """Bars, hinges, sliders, spiral springs and masses of one state of a cell; returns its points
    by name.

    `cell` is a Dataset with position(point, axis) and the pairs of point names bar(bar, end) and
    slider(slider, end); `labels` says which names and dimensions are written to it: those of the
    undeformed state, or those of a deformed one, with its frames.
    """
    cell = cell.to_xarray() if hasattr(cell, "to_xarray") else cell
    points = dict(zip(cell["point"].values.tolist(), cell["position"].values, strict=True))
    _ground(ax, points)
    for start, end in cell["bar"].values.tolist():
        ends = np.array([points[start], points[end]])
        ax.plot(*ends.T, color=BAR, lw=2.6, solid_capstyle="round", zorder=2)
    for first, last in cell["slider"].values.tolist():
        _slider(ax, points[first], points[last], points[_partner(cell, first)])
    for name, at in points.items():
        if not name.startswith(("slider", "mass")):
            ax.add_patch(Circle(at, 0.032, facecolor="white", edgecolor=LOOK.ink, lw=0.8, zorder=4))
        if name.startswith("mass"):
            ax.add_patch(Circle(at, 0.075, facecolor=LOOK.ink, edgecolor=LOOK.ink, zorder=5))
    for name in cell["spring"].values.tolist():
        _spiral(ax, points[name])
    ax.set_aspect("equal")
    ax.axis("off")
    if labels == "undeformed":
        _label_undeformed(ax, points, cell)
    elif labels == "deformed":
        _label_deformed(ax, points, cell)
        _label_heights(ax, points, 2.12)
        _draw_frames(ax, ORIGIN, points["lower_left"])
    return points


def _label_undeformed(ax: Any, points: dict[str, np.ndarray], cell: Any) -> None:
    """Names of parts and the dimensions alpha0, beta0, l of the undeformed state."""
    alpha = float(cell["alpha"][0])
    beta = float(cell["beta"][0])
    _angles(
        ax,
        points,
        (alpha, alpha),
        (beta, beta),
        (r"$\alpha_0$", r"$\alpha_0$"),
        (r"$\beta_0$", r"$\beta_0$"),
    )
    dimension(ax, points["lower_left"], points["middle_left"], r"$l$", offset=0.17, shift=0.09)
    dimension(ax, points["middle_left"], points["upper_left"], r"$l$", offset=0.17, shift=0.09)
    base = r"$l\,\sin(\alpha_0+\beta_0)\,/\sin\alpha_0$"
    dimension(ax, points["lower_left"], points["lower_right"], base, offset=-0.32, shift=0.11)
    dimension(
        ax, points["middle_right"], points["slider_2_in"], r"$\lambda l$", offset=-0.12, shift=0.1
    )
    for name, at, where, ha in (
        ("A", "lower_right", (0.12, 0.02), "left"),
        ("B", "upper_right", (0.12, -0.02), "left"),
    ):
        j = {"A": 1, "B": 2}[name]
        ax.text(*(points[at] + where), rf"$\mathrm{{{name}}}$: $K_{j},\,C_{j}$", ha=ha, va="center")
    ax.text(*(points["mass_1"] + _xy(0.0, 0.14)), r"$M_1$", ha="center", va="bottom")
    ax.text(*(points["mass_2"] + _xy(0.0, 0.14)), r"$M_2$", ha="center", va="bottom")
    middle = (points["slider_1_in"] + points["slider_1_out"]) / 2
    ax.annotate(
        "slider",
        xy=middle + _xy(-0.05, 0.06),
        xytext=middle + _xy(-0.18, 0.3),
        ha="center",
        va="center",
        arrowprops=_leader(),
        fontsize=8,
    )
    hinge = points["middle_right"]
    ax.annotate(
        "hinge",
        xy=hinge + _xy(0.035, 0.0),
        xytext=hinge + _xy(0.22, 0.0),
        ha="left",
        va="center",
        arrowprops=_leader(),
        fontsize=8,
    )


def _label_deformed(ax: Any, points: dict[str, np.ndarray], cell: Any) -> None:
    """The angles alpha_j, beta_j, theta_j, phi_j, the forces H_j, V_j and the ground's U_h, U_v of
    the deformed state.
    """
    alpha, beta, theta, phi = (cell[name].values for name in ("alpha", "beta", "theta", "phi"))
    _angles(
        ax, points, alpha, beta, (r"$\alpha_1$", r"$\alpha_2$"), (r"$\beta_1$", r"$\beta_2$"), 0.56
    )
    _differences(ax, points, beta, theta)
    _misalignments(ax, points, alpha, phi)
    for j in (1, 2):
        at = points[f"mass_{j}"]
        size = 0.42
        ax.annotate(
            "", xy=at + _xy(size, 0.0), xytext=at, arrowprops={**ARROW, "color": FORCE}, zorder=6
        )
        ax.annotate(
            "", xy=at + _xy(0.0, size), xytext=at, arrowprops={**ARROW, "color": FORCE}, zorder=6
        )
        ax.text(*(at + _xy(size - 0.06, 0.1)), rf"$H_{j}$", color=FORCE, ha="center", va="center")
        ax.text(*(at + _xy(0.05, size)), rf"$V_{j}$", color=FORCE, ha="left", va="center")


def _label_heights(ax: Any, points: dict[str, np.ndarray], x: float) -> None:
    """The heights eta_j l of both layers as dimension lines at the abscissa `x`."""
    levels = [points[name][1] for name in ("lower_right", "middle_right", "upper_right")]
    for name, level in zip(("lower_right", "middle_right", "upper_right"), levels, strict=True):
        ax.plot([points[name][0] + 0.16, x + 0.05], [level, level], color=LOOK.ink, lw=0.4)
    for j in (1, 2):
        ends = _xy(x, levels[j]), _xy(x, levels[j - 1])
        dimension(ax, *ends, rf"$\eta_{j}\,l$", shift=0.13)


def _draw_frames(ax: Any, origin: np.ndarray, ground: np.ndarray) -> None:
    """The inertial frame X-Y at `origin`, the frame x-y at the lower left hinge `ground`, and the
    ground motion between.
    """
    for at, names, size in ((origin, ("X", "Y"), 0.36), (ground, ("x", "y"), 0.36)):
        for direction, place, name in zip(
            ((1, 0), (0, 1)), ((-0.04, 0.08), (-0.09, -0.04)), names, strict=True
        ):
            tip = at + size * np.array(direction)
            ax.annotate(
                "",
                xy=tip,
                xytext=at,
                arrowprops={**ARROW, "color": LOOK.ink, "lw": 0.7, "mutation_scale": 7},
                zorder=6,
            )
            ax.text(*(tip + place), f"${name}$", ha="center", va="center")
    corner = np.array([ground[0], origin[1]])
    dimension_ = {**ARROW, "color": GROUND}
    ax.plot(*np.array([origin, corner]).T, color=GROUND, lw=0.4)
    ax.annotate("", xy=corner, xytext=origin + _xy(0.5, 0), arrowprops=dimension_)
    ax.annotate("", xy=ground, xytext=corner, arrowprops=dimension_)
    ax.text(
        *((origin + _xy(0.5, 0) + corner) / 2 + _xy(0, -0.1)),
        "$U_h$",
        color=GROUND,
        ha="center",
        va="center",
    )
    ax.text(*((corner + ground) / 2 + _xy(0.08, 0)), "$U_v$", color=GROUND, ha="left", va="center")


def _angles(
    ax: Any,
    points: Any,
    alpha: Any,
    beta: Any,
    alpha_names: Any,
    beta_names: Any,
    radius: float = 0.42,
) -> None:
    """alpha_j between base and diagonal, beta_j between base and inclined bar, in both layers."""
    arc(ax, points["lower_left"], radius, 0.0, alpha[0], alpha_names[0], reach=1 + 0.115 / radius)
    arc(ax, points["lower_right"], 0.25, np.pi - beta[0], np.pi, beta_names[0], reach=1.55, at=0.7)
    arc(
        ax,
        points["middle_right"],
        radius,
        np.pi - alpha[1],
        np.pi,
        alpha_names[1],
        reach=1 + 0.115 / radius,
    )
    arc(ax, points["middle_left"], 0.25, 0.0, beta[1], beta_names[1], reach=1.5)


def _differences(ax: Any, points: Any, beta: Any, theta: Any) -> None:
    """theta_j, from the undeformed direction of the inclined bar (dashed) to the present one."""
    for corner, lean, j in (("lower_left", -1, 0), ("middle_right", 1, 1)):
        undeformed = beta[j] - abs(theta[j])
        present = beta[j]
        first, last = (np.pi - b if lean < 0 else b for b in (undeformed, present))
        at = points[corner]
        tip = at + 1.02 * np.array([np.cos(first), np.sin(first)])
        ax.plot(*np.array([at, tip]).T, color=LOOK.separatrix, lw=0.8, ls=(0, (4, 2)), zorder=1)
        arc(ax, at, 0.72, min(first, last), max(first, last), "", reach=1.0)
        beside = first - 0.16 * lean  # outside the wedge, which is too narrow for the name
        name = rf"$\theta_{j + 1}$" if j == 0 else rf"$|\theta_{j + 1}|$"
        ax.text(
            *(at + 0.76 * np.array([np.cos(beside), np.sin(beside)])),
            name,
            ha="center",
            va="center",
            color=LOOK.stable,
        )


def _misalignments(ax: Any, points: Any, alpha: Any, phi: Any) -> None:
    """phi_j, between the line joining the ends of the diagonal (dotted) and its near half."""
    for corner, far, direction, j in (
        ("lower_left", "middle_right", alpha[0], 0),
        ("middle_right", "upper_left", np.pi - alpha[1], 1),
    ):
        at = points[corner]
        ax.plot(
            *np.array([at, points[far]]).T,
            color=LOOK.separatrix,
            lw=0.8,
            ls=(0, (1, 1.5)),
            zorder=1,
        )
        arc(ax, at, 0.4, direction, direction + phi[j], "")
        middle = direction + phi[j] / 2
        place = at + 0.51 * np.array([np.cos(middle), np.sin(middle)])
        ax.text(*place, rf"$\varphi_{j + 1}$", ha="center", va="center", color=LOOK.stable)


def _partner(cell: Any, name: str) -> str:
    """The hinge at the other end of the half diagonal that ends at the slider point `name`."""
    return str(
        next(a if b == name else b for a, b in cell["bar"].values.tolist() if name in (a, b))
    )


def _slider(ax: Any, first: np.ndarray, last: np.ndarray, hinge: np.ndarray) -> None:
    """Two plates across the diagonal, one on each half, that slide along each other."""
    along = (first - hinge) / np.linalg.norm(first - hinge)
    across = np.array([-along[1], along[0]])
    for at, sign in ((first, -1), (last, 1)):
        gap = 0.028 * sign * along
        ends = np.array([at + gap - 0.15 * across, at + gap + 0.15 * across])
        ax.plot(*ends.T, color=LOOK.ink, lw=1.6, solid_capstyle="butt", zorder=3)


def _spiral(ax: Any, at: np.ndarray) -> None:
    """A spiral spring about a hinge."""
    angle = np.linspace(0, 5 * np.pi, 200)
    radius = 0.035 + 0.07 * angle / angle[-1]
    ax.plot(
        at[0] + radius * np.cos(angle),
        at[1] + radius * np.sin(angle),
        color=LOOK.stable,
        lw=0.8,
        zorder=5,
    )


def _ground(ax: Any, points: dict[str, np.ndarray]) -> None:
    """Hatched supports below the base."""
    left = points["lower_left"]
    right = points["lower_right"]
    y = left[1] - 0.1
    ax.plot([left[0] - 0.18, right[0] + 0.18], [y, y], color=LOOK.ink, lw=0.9, zorder=1)
    for x in np.arange(left[0] - 0.16, right[0] + 0.17, 0.08):
        ax.plot([x, x - 0.06], [y, y - 0.07], color=LOOK.ink, lw=0.4, zorder=1)
    for at in (left, right):
        ax.add_patch(
            Polygon(
                [at, at + _xy(-0.07, -0.1), at + _xy(0.07, -0.1)],
                facecolor="white",
                edgecolor=LOOK.ink,
                lw=0.8,
                zorder=3,
            )
        )


def _xy(x: float, y: float) -> np.ndarray:
    return np.array([x, y])


def _leader() -> dict[str, Any]:
    return {"arrowstyle": "-", "color": LOOK.ink, "lw": 0.5, "shrinkA": 1, "shrinkB": 0}


def dimension(
    ax: Any,
    start: np.ndarray,
    end: np.ndarray,
    label: str,
    offset: float = 0.0,
    shift: float = 0.05,
) -> None:
    """A dimension line from `start` to `end`, moved sideways by `offset`, with its label beside the
    middle.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([-along[1], along[0]])
    a = start + offset * side
    b = end + offset * side
    for foot, tip in ((start, a), (end, b)):
        if offset:
            ax.plot(
                *zip(foot, tip + 0.3 * shift * np.sign(offset) * side, strict=True),
                color=LOOK.ink,
                lw=0.4,
            )
    style = {
        "arrowstyle": "<|-|>,head_width=0.12,head_length=0.3",
        "color": LOOK.ink,
        "lw": 0.5,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    ax.annotate("", xy=b, xytext=a, arrowprops=style)
    ax.text(*((a + b) / 2 + np.sign(offset or 1) * shift * side), label, ha="center", va="center")


def arc(
    ax: Any,
    centre: np.ndarray,
    radius: float,
    first: float,
    last: float,
    label: str,
    reach: float = 1.35,
    at: float = 0.5,
) -> None:
    """An arc of an angle from direction `first` to `last` (rad), its label at `reach` radii and the
    share `at` of the angle.
    """
    angles = np.linspace(first, last, 60)
    ax.plot(
        centre[0] + radius * np.cos(angles),
        centre[1] + radius * np.sin(angles),
        color=LOOK.ink,
        lw=0.6,
    )
    middle = first + at * (last - first)
    ax.text(
        centre[0] + reach * radius * np.cos(middle),
        centre[1] + reach * radius * np.sin(middle),
        label,
        ha="center",
        va="center",
    )
