"""Appendix A: the free rocking block, its periods, and the energy at an impact on a moving
ground.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import Harmonic, Load, RockingBlock, simulate
from saltus.plots import LOOK, new_figure, panel_label, shades, styled
from saltus.theory import (
    rocking_energy_decreases,
    rocking_energy_jump,
    rocking_period,
    short_rocking_period,
    slender_rocking_period,
)
from saltus_paper.figure_data import TOLERANCE, dataset, scalar_dataset, tree
from saltus_paper.figures.figure import paper_figure
from saltus_paper.sections.rocking_block import block, measure, residuals

SLENDERNESS_ANGLES = (5.0, 20.0, 45.0)  # alpha, degrees
DOT_ANGLES = (0.02, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95)  # theta0 / alpha of the simulated motions
JUMP = {"alpha": 20.0, "e": 0.8}


def compute(samples: int = 160) -> Any:
    """Periods over theta0 / alpha by every formula and by simulation; the energy jump over the
    ground's velocity.
    """
    checks = scalar_dataset(
        residuals(np.random.default_rng(1)),
        what="residuals of the formulas, as printed and as corrected",
    )
    groups = {
        "period": _periods(samples),
        "jump": _jump(np.deg2rad(JUMP["alpha"]), JUMP["e"]),
        "checks": checks,
    }
    return tree(groups, what="the rigid rocking block (appendix A), times in 1/p", tol=TOLERANCE)


def _periods(samples: int) -> Any:
    share = np.concatenate(
        [np.geomspace(1e-3, 0.05, samples // 4), np.linspace(0.05, 0.995, samples)[1:]]
    )
    forms = (rocking_period, short_rocking_period, slender_rocking_period)
    curves = [
        np.array([form(share * a, alpha=a) for a in np.deg2rad(SLENDERNESS_ANGLES)])
        for form in forms
    ]
    simulated = np.empty((len(SLENDERNESS_ANGLES), len(DOT_ANGLES)))
    for i, alpha in enumerate(np.deg2rad(SLENDERNESS_ANGLES)):
        for j, dot in enumerate(DOT_ANGLES):
            expected = float(rocking_period(dot * alpha, alpha=alpha))
            motion = simulate(
                block(float(alpha)),
                theta=float(dot * alpha),
                velocity=0.0,
                duration=1.6 * expected,
                tol=TOLERANCE,
            )
            simulated[i, j] = motion.impacts.time[2] - motion.impacts.time[0]
    names = ("exact", "short", "slender")
    meanings = (
        "closed form with an elliptic integral",
        "4 sqrt(2 theta0 / sin(alpha))",
        "4 arccosh(1 / (1 - theta0 / alpha))",
    )
    return dataset(
        {
            **{
                n: (("alpha", "share"), c, "1/p", m)
                for n, c, m in zip(names, curves, meanings, strict=True)
            },
            "simulated": (
                ("alpha", "dot"),
                simulated,
                "1/p",
                "time from the first to the third impact of the motion",
            ),
        },
        {
            "alpha": ("alpha", np.deg2rad(SLENDERNESS_ANGLES), "rad", "slenderness angle"),
            "share": ("share", share, "1", "theta0 / alpha"),
            "dot": ("dot", np.array(DOT_ANGLES), "1", "theta0 / alpha of the motions"),
        },
        what="period of free rocking",
    )


def _jump(alpha: float, e: float) -> Any:
    """[[T]] / (T of the rotation before) over zeta' / theta', from the formula and from the model's
    kinetic energy.
    """
    ground = np.linspace(-2.0, 2.0, 201)
    dots = ground[10::20]
    impact: dict[str, Any] = {"alpha": alpha, "e": e, "ground_velocity": ground}
    computed = np.array([_model_jump(alpha, e, g) for g in dots])
    return dataset(
        {
            "jump": (
                "ground",
                2 * rocking_energy_jump(1.0, **impact),
                "1",
                "[[T]] over theta'-^2 / 2",
            ),
            "decreases": (
                "ground",
                rocking_energy_decreases(1.0, **impact),
                "1",
                "either condition holds",
            ),
            "computed": ("dot", 2 * computed, "1", "the same from the model's energies"),
        },
        {
            "ground": ("ground", ground, "1", "zeta' / theta'-"),
            "dot": ("dot", dots, "1", "zeta' / theta'-"),
        },
        what="energy jump at an impact",
        alpha=alpha,
        e=e,
        bound=(1 + e) / (2 * np.cos(alpha)),
    )


def _model_jump(alpha: float, e: float, ground: float) -> float:
    """T after less T before an impact from theta' = 1 while the ground moves with velocity
    `ground`.
    """
    # zeta'(0) = amplitude
    load = Load(frequency=1.0, ground_horizontal=Harmonic(amplitude=float(ground)))
    model = RockingBlock(alpha=alpha)
    return float(
        model.kinetic_energy(0.0, 0.0, e, -1, load) - model.kinetic_energy(0.0, 0.0, 1.0, 1, load)
    )


@styled
def draw(data: Any) -> Any:
    """(a) periods, (b) errors of the approximations, (c) energy jump."""
    figure = new_figure(LOOK.double_column, 68.0)
    axes = figure.subplots(1, 3)
    draw_periods(axes[0], data["period"])
    draw_errors(axes[1], data["period"])
    draw_jump(axes[2], data["jump"])
    for ax, label in zip(axes, "abc", strict=True):
        panel_label(ax, label)
    return figure


SHORT_DASHES = (0, (1, 1.3))
SLENDER_DASHES = (0, (5, 2))


def draw_periods(ax: Any, data: Any) -> None:
    """p T0 over theta0 / alpha: closed form, simulated dots, and the arccosh, which is the same
    curve for every alpha.
    """
    for i, colour in enumerate(shades(data.sizes["alpha"])):
        name = rf"$\alpha={np.rad2deg(float(data['alpha'][i])):.0f}^\circ$"
        ax.plot(data["share"], data["exact"][i], color=colour, lw=1.2, label=name)
        ax.plot(data["dot"], data["simulated"][i], color=colour, ls="none", marker="o", ms=3)
    ax.plot(
        data["share"],
        data["slender"][0],
        color=LOOK.ink,
        ls=SLENDER_DASHES,
        lw=0.9,
        label="arccosh",
        zorder=1,
    )
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 22)
    ax.set_yticks(range(0, 21, 5))
    ax.set_xlabel(r"$|\theta_0|/\alpha$")
    ax.set_ylabel(r"$p\,T_0$")
    ax.legend(loc="upper left")


def draw_errors(ax: Any, data: Any) -> None:
    """Relative errors of both approximations."""
    for i, colour in enumerate(shades(data.sizes["alpha"])):
        for name, dashes in (("short", SHORT_DASHES), ("slender", SLENDER_DASHES)):
            error = abs(data[name][i] / data["exact"][i] - 1).values
            ax.plot(data["share"], error, color=colour, ls=dashes, lw=1.2)
    ax.plot([], [], color=LOOK.ink, ls=SHORT_DASHES, label=r"$4\sqrt{2|\theta_0|/\sin\alpha}$")
    ax.plot([], [], color=LOOK.ink, ls=SLENDER_DASHES, label="arccosh")
    ax.set_yscale("log")
    ax.set_xlim(0, 1)
    ax.set_ylim(4e-7, 3)
    ax.set_xlabel(r"$|\theta_0|/\alpha$")
    ax.set_ylabel("relative error of $T_0$")
    ax.legend(loc="lower left", borderaxespad=0.2)


def draw_jump(ax: Any, data: Any) -> None:
    """The energy jump over the ground's velocity, the range of growth shaded."""
    ground = data["ground"].values
    jump = data["jump"].values
    bound = float(data.attrs["bound"])
    ax.axvspan(ground[0], -bound, color="#ececec", lw=0, zorder=0)
    ax.axhline(0.0, color=LOOK.faint, lw=0.8)
    ax.axvline(0.0, color=LOOK.faint, lw=0.8)
    ax.plot(ground, jump, color=LOOK.stable, lw=1.2)
    ax.plot(data["dot"], data["computed"], color=LOOK.stable, ls="none", marker="o", ms=3)
    ax.set_xlim(ground[0], ground[-1])
    ax.set_xlabel(r"$\dot\zeta/\dot\theta^-$")
    ax.set_ylabel(r"$[\![\mathcal{T}\,]\!]$ / energy of rotation before")
    ax.text(
        (ground[0] - bound) / 2,
        jump.min() + 0.06,
        "energy\ngrows",
        ha="center",
        va="bottom",
        fontsize=8,
    )


FIGURE = paper_figure("appendix", compute=compute, draw=draw, measure=measure)
