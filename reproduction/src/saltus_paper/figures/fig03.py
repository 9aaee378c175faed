"""Fig. 3: the misalignment and the difference angle near an impact, from an exact motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import Load, Metainterface, System, UnitCell, simulate
from saltus.plots import LOOK, arrow_along, new_figure, panel_label, styled
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, dataset, tree
from saltus_paper.figures.figure import paper_figure

SPAN = 1.5  # of time before the impact


def compute(alpha0: float = 45.0, samples: int = 400) -> Any:
    """theta, phi and their rates until the first impact from theta = 0.4 at rest, beta0 = 80 deg;
    `alpha0` in degrees.
    """
    beta0 = np.deg2rad(80.0)
    cell = UnitCell(alpha0=np.deg2rad(alpha0), beta0=beta0)
    system = System(model=Metainterface(beta0=beta0, damping=0.1), load=Load(vertical=-0.5))
    motion = simulate(system, theta=0.4, velocity=0.0, duration=4.0, tol=TOLERANCE)
    impact = float(motion.impacts.time[0])
    to_go = np.concatenate(
        [np.linspace(SPAN, 0.05, samples), np.geomspace(0.05, 1e-8, samples)[1:]]
    )
    theta, velocity = motion.at(impact - to_go)
    data = dataset(
        {
            "theta": ("to_go", theta, "rad", "difference angle"),
            "theta_velocity": ("to_go", velocity, "1", "theta'"),
            "phi": ("to_go", cell.phi(theta), "rad", "misalignment"),
            "phi_velocity": ("to_go", cell.phi_velocity(theta, velocity), "1", "phi'"),
            "phi_small": ("to_go", cell.small_phi(theta), "rad", "phi of `fundamentalproperty`"),
        },
        {"to_go": ("to_go", to_go, "1", "time before the impact, tau_* - tau")},
        what="approach to an impact",
        system=system,
        tol=TOLERANCE,
        alpha0_degrees=alpha0,
        impact_time=impact,
        impact_velocity=float(motion.impacts.velocity_before[0]),
        psi=cell.psi,
        sin_beta0=float(np.sin(beta0)),
    )
    return tree(
        {"approach": data}, what="misalignment and difference angle before an impact", tol=TOLERANCE
    )


@styled
def draw(data: Any) -> Any:
    """(a) over time, (b) in the phase plane."""
    figure = new_figure(LOOK.double_column, 66.0)
    left, right = figure.subplots(1, 2)
    draw_history(left, data["approach"])
    draw_phase(right, data["approach"])
    panel_label(left, "a")
    panel_label(right, "b")
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """The square-root law and the singular velocity."""
    d = data["approach"]
    near = d["to_go"].values < 1e-4
    to_go = d["to_go"].values[near]
    rate = abs(d["phi_velocity"].values[near])
    slope = float(np.polyfit(np.log(to_go), np.log(rate), 1)[0])
    ratio = d["phi_small"].values / d["phi"].values - 1
    product = (
        2 * d.attrs["psi"] / d.attrs["sin_beta0"] * d["phi"].values * abs(d["phi_velocity"].values)
    )
    velocity = abs(d["theta_velocity"].values)
    return {
        "fundamental-property": measured(
            float(ratio[-1]),
            error_at_start=abs(ratio[0]),
            theta_at_start=d["theta"].values[0],
            error_at_end=abs(ratio[-1]),
            theta_at_end=d["theta"].values[-1],
        ),
        "fundamental-velocity": measured(
            float(product[-1] / velocity[-1] - 1), to_go=d["to_go"].values[-1]
        ),
        "phi-singular": measured(
            bool(abs(slope + 0.5) < 1e-3),
            slope=slope,
            to_go=to_go[-1],
            phi_velocity=rate[-1],
            theta_velocity=-velocity[-1],
        ),
    }


PHI: dict[str, Any] = {"color": LOOK.unstable, "ls": LOOK.dashes[1], "lw": 1.2}
THETA: dict[str, Any] = {"color": LOOK.stable, "ls": "-", "lw": 1.2}


def draw_history(ax: Any, data: Any) -> None:
    """abs(phi) and abs(theta) over tau - tau_*."""
    time = -data["to_go"].values
    ax.plot(time, abs(data["phi"].values), label=r"$|\varphi|$", **PHI)
    ax.plot(time, abs(data["theta"].values), label=r"$|\theta|$", **THETA)
    ax.axvline(0.0, color=LOOK.faint, lw=0.8)
    ax.set_xlim(time[0], 0.08)
    ax.set_ylim(0, None)
    ax.set_xlabel(r"$\tau-\tau_*$")
    ax.set_ylabel(r"$|\varphi|,\ |\theta|$ (rad)")
    ax.legend(loc="lower left")


def draw_phase(ax: Any, data: Any, highest: float = 3.2) -> None:
    """The rates against the angles, cut off at the rate `highest`, which phi' passes on its way to
    infinity.
    """
    for name, style, label in (("phi", PHI, r"$|\varphi|$"), ("theta", THETA, r"$|\theta|$")):
        angle = abs(data[name].values)
        rate = abs(data[f"{name}_velocity"].values)
        ax.plot(angle, rate, label=label, **style)
        arrow_along(ax, angle, rate, 250, style["color"], size=8)
    ax.set_xlim(-0.02, None)
    ax.set_ylim(0, highest)
    ax.set_xlabel(r"$|\varphi|,\ |\theta|$ (rad)")
    ax.set_ylabel(r"$|\dot\varphi|,\ |\dot\theta|$")
    ax.annotate(
        r"$|\dot\varphi|\to\infty$",
        xy=(0.115, 0.97),
        xycoords=("data", "axes fraction"),
        ha="left",
        va="top",
        color=LOOK.unstable,
    )
    ax.legend(loc="center right")


FIGURE = paper_figure("fig03", compute=compute, draw=draw, measure=measure)
