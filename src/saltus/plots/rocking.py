"""The rocking block: periods, errors of the approximations, energy at an impact."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.plots.conventions import FAINT, INK, STABLE, shades

SHORT_DASHES, SLENDER_DASHES = (0, (1, 1.3)), (0, (5, 2))


def draw_periods(ax: Any, data: Any) -> None:
    """p T0 over theta0 / alpha: closed form, simulated dots, and the arccosh, which is the same curve for every alpha."""
    for i, colour in enumerate(shades(data.sizes["alpha"])):
        name = rf"$\alpha={np.rad2deg(float(data['alpha'][i])):.0f}^\circ$"
        ax.plot(data["share"], data["exact"][i], color=colour, lw=1.2, label=name)
        ax.plot(data["dot"], data["simulated"][i], color=colour, ls="none", marker="o", ms=3)
    ax.plot(data["share"], data["slender"][0], color=INK, ls=SLENDER_DASHES, lw=0.9, label="arccosh", zorder=1)
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
    ax.plot([], [], color=INK, ls=SHORT_DASHES, label=r"$4\sqrt{2|\theta_0|/\sin\alpha}$")
    ax.plot([], [], color=INK, ls=SLENDER_DASHES, label="arccosh")
    ax.set_yscale("log")
    ax.set_xlim(0, 1)
    ax.set_ylim(4e-7, 3)
    ax.set_xlabel(r"$|\theta_0|/\alpha$")
    ax.set_ylabel("relative error of $T_0$")
    ax.legend(loc="lower left", borderaxespad=0.2)


def draw_jump(ax: Any, data: Any) -> None:
    """The energy jump over the ground's velocity, the range of growth shaded."""
    ground, jump = data["ground"].values, data["jump"].values
    bound = float(data.attrs["bound"])
    ax.axvspan(ground[0], -bound, color="#ececec", lw=0, zorder=0)
    ax.axhline(0.0, color=FAINT, lw=0.8)
    ax.axvline(0.0, color=FAINT, lw=0.8)
    ax.plot(ground, jump, color=STABLE, lw=1.2)
    ax.plot(data["dot"], data["computed"], color=STABLE, ls="none", marker="o", ms=3)
    ax.set_xlim(ground[0], ground[-1])
    ax.set_xlabel(r"$\dot\zeta/\dot\theta^-$")
    ax.set_ylabel(r"$[\![\mathcal{T}\,]\!]$ / energy of rotation before")
    ax.text((ground[0] - bound) / 2, jump.min() + 0.06, "energy\ngrows", ha="center", va="bottom", fontsize=8)
