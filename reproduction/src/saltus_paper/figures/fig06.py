"""Fig.

6: bouncing-like time histories of unequal layers without loads, with both impact laws where masses
differ.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import EnergyRestitution, Load, Metainterface, System, VelocityReduction, simulate
from saltus.plots import LOOK, new_figure, panel_label, shades, styled
from saltus.theory import total_energy, unloaded_peak_ratio, unloaded_period
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, dataset, tree
from saltus_paper.figures.figure import paper_figure

STIFFNESS = (1.0, 4.0, 16.0, 100.0)
MASSES = (0.0, 1.0, 3.0, 8.0)
THETA0 = -0.1  # rad; without loads the motion is linear on each side, so that only its sign matters
CYCLES = 2.0
EXTREME_STIFFNESS = (1e-8, 1e-4, 1e4, 1e8)
EXTREME_MASS = (1e2, 1e4, 1e6)


def compute(samples: int = 500) -> Any:
    """theta over tau / T0 from theta_min at rest, V = H = 0: (a) over k, m = 0; (b) over m, k = 1,
    with e = 1 and with r = 1.
    """
    groups = {
        "a": _histories([(k, 0.0) for k in STIFFNESS], VelocityReduction(1.0), samples),
        "b_velocity": _histories([(1.0, m) for m in MASSES], VelocityReduction(1.0), samples),
        "b_energy": _histories([(1.0, m) for m in MASSES], EnergyRestitution(1.0), samples),
    }
    limits = {
        "stiffness": [(k, 0.0) for k in EXTREME_STIFFNESS],
        "mass": [(1.0, m) for m in EXTREME_MASS],
    }
    groups |= {
        f"extreme_{name}": _histories(cases, VelocityReduction(1.0), 2)
        for name, cases in limits.items()
    }
    groups["extreme_mass_energy"] = _histories(limits["mass"], EnergyRestitution(1.0), 2)
    groups["normalised"] = _histories(
        [(k, 1.0) for k in EXTREME_STIFFNESS[:2]], VelocityReduction(1.0), 2
    )
    groups["mirrored"] = _histories(
        [(1 / k, 0.0) for k in STIFFNESS], VelocityReduction(1.0), samples, -THETA0
    )
    return tree(
        groups, what="bouncing-like motion without loads, beta0 = 80 deg, C = 0", tol=TOLERANCE
    )


def _histories(
    cases: list[tuple[float, float]], impact: Any, samples: int, theta0: float = THETA0
) -> Any:
    phase = np.linspace(0, CYCLES, samples)
    theta = []
    peak = []
    period = []
    other_half = []
    energy = []
    for k, m in cases:
        model = Metainterface(beta0=np.deg2rad(80.0), stiffness_ratio=k, mass_ratio=m)
        system = System(model=model, load=Load(vertical=0.0), impact=impact)
        cycle = float(unloaded_period(k, m))
        motion = simulate(
            system, theta=theta0, velocity=0.0, duration=CYCLES * cycle, tol=TOLERANCE
        )
        first, second, third = motion.impacts.time[:3]
        theta.append(motion.at(np.minimum(phase * cycle, motion.time))[0])
        peak.append(float(motion.at(np.array([(first + second) / 2]))[0][0]))
        period.append(float(third - first))
        other_half.append(float(second - first))
        after = motion.impacts.velocity_after[0]
        energy.append(
            total_energy(system, 0.0, after, 1 if after > 0 else -1)
            / total_energy(system, theta0, 0.0)
        )
    k, m = np.array(cases).T
    conserving = type(impact).__name__ == "EnergyRestitution"
    return dataset(
        {
            "theta": (("case", "phase"), np.array(theta), "rad", "difference angle"),
            "peak": ("case", peak, "rad", "the other peak of the motion"),
            "period": ("case", period, "1", "time from first to third impact"),
            "other_half": (
                "case",
                other_half,
                "1",
                "time from first to second impact, on the side other than that of the start",
            ),
            "period_theory": ("case", unloaded_period(k, m), "1", "T0 of `period_case2`"),
            "ratio_theory": (
                "case",
                unloaded_peak_ratio(k, m, energy_conserving=conserving),
                "1",
                "P_R (erratum 7)",
            ),
            "energy_ratio": (
                "case",
                energy,
                "1",
                "energy on the lower side over that on the upper one",
            ),
        },
        {
            "phase": ("phase", phase, "1", "tau / T0(k, m)"),
            "stiffness_ratio": ("case", k, "1", "k"),
            "mass_ratio": ("case", m, "1", "m"),
        },
        what="time histories",
        system=system,
        tol=TOLERANCE,
        theta0=theta0,
    )


@styled
def draw(data: Any) -> Any:
    """(a) over k; (b) over m, with the velocity kept and with the energy kept at impacts."""
    figure = new_figure(LOOK.double_column, 74.0)
    axes = figure.subplots(1, 3, sharey=True)
    panels = (
        ("a", "a", "stiffness_ratio", "k", ""),
        ("b_velocity", "b", "mass_ratio", "m", ": $e=1$"),
    )
    for ax, (name, label, case, symbol, law) in zip(
        axes, (*panels, ("b_energy", "b", "mass_ratio", "m", ": $r=1$")), strict=True
    ):
        names = [f"${symbol}={float(value):g}$" for value in data[name][case]]
        draw_histories(ax, data[name], names, THETA0)
        panel_label(ax, label)
        ax.set_title(ax.get_title(loc="left") + law, loc="left", pad=4)
    axes[0].set_ylabel(r"$\theta\,/\,|\theta_{\min}|$")
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """Peaks and periods, and erratum 7."""
    a = data["a"]
    velocity = data["b_velocity"]
    energy = data["b_energy"]
    ratios = {name: _ratio(data[name]) for name in ("a", "b_velocity", "b_energy")}
    shift = float(np.abs(ratios["b_velocity"] - ratios["b_velocity"][0]).max())
    kept = float(np.abs(ratios["b_energy"] - ratios["b_energy"][0]).max())
    right = float(np.abs(ratios["b_velocity"] / velocity["ratio_theory"].values - 1).max())
    change = velocity["energy_ratio"].values
    periods = max(
        float(np.abs(d["period"] / d["period_theory"] - 1).max()) for d in (a, velocity, energy)
    )
    return {
        "fig06-peaks": measured(
            float(np.abs(ratios["a"] / a["ratio_theory"].values - 1).max()),
            stiffness_ratios=list(STIFFNESS),
        ),
        "fig06-balance-sign": measured(
            float(
                np.abs(
                    a["peak"].values / (-THETA0 * np.sqrt(a["stiffness_ratio"].values)) - 1
                ).max()
            ),
            float(
                np.abs(
                    a["peak"].values / (-THETA0 / np.sqrt(a["stiffness_ratio"].values)) - 1
                ).max()
            ),
        ),
        "fig06-period": measured(periods),
        "fig06-mass": measured(
            shift,
            bool(right < 1e-9 and kept < 1e-9),
            mass_ratios=list(MASSES),
            ratios=ratios["b_velocity"].round(6).tolist(),
            right=right,
            kept=kept,
        ),
        "fig06-conservative": measured(
            float(np.abs(change - 1).max()),
            float(np.abs(change / (1 + velocity["mass_ratio"].values) - 1).max())
            + float(np.abs(energy["energy_ratio"].values - 1).max()),
            changes=change.round(9).tolist(),
        ),
        **_extremes(data),
    }


def _extremes(data: Any) -> dict[str, Measured]:
    """The limits of large and small k and m, by the distance of simulated motions from each
    asymptote.
    """
    hard = data["extreme_stiffness"]
    heavy = data["extreme_mass"]
    kept = data["extreme_mass_energy"]
    k = hard["stiffness_ratio"].values
    m = heavy["mass_ratio"].values
    # the start is above
    upper = hard["period"].values - hard["other_half"].values
    lower = hard["other_half"].values
    soft = k < 1
    asymptotes = np.where(soft, lower * np.sqrt(k), upper) / np.pi - 1
    vanishing = np.where(soft, upper / lower / np.sqrt(k), lower / upper * np.sqrt(k)) - 1
    fast = (heavy["period"].values - heavy["other_half"].values) / heavy[
        "other_half"
    ].values * np.sqrt(1 + m) - 1
    own = data["normalised"]["period"].values * np.sqrt(
        data["normalised"]["stiffness_ratio"].values
    )
    mirror = np.abs(data["mirrored"]["theta"].values + data["a"]["theta"].values).max()
    peaks = {
        name: _ratio(panel)
        for name, panel in (("stiff", hard), ("velocity", heavy), ("energy", kept))
    }
    towards_0 = float(np.abs(peaks["velocity"] * np.sqrt(1 + m) - 1).max())
    return {
        "fig06-ratio-limits": measured(
            float(np.abs(peaks["stiff"] / np.minimum(np.sqrt(k), 1 / np.sqrt(k)) - 1).max()),
            ratios=peaks["stiff"].tolist(),
            k=k.tolist(),
        ),
        "fig06-period-limits": measured(
            float(max(np.abs(asymptotes).max(), np.abs(vanishing).max())),
            periods=hard["period"].values.tolist(),
            k=k.tolist(),
        ),
        "fig06-normalisation": measured(
            float(np.abs(own / (np.pi * np.sqrt(2)) - 1)[0]),
            periods=own.tolist(),
            k=data["normalised"]["stiffness_ratio"].values.tolist(),
        ),
        "fig06-fast-side": measured(
            float(np.abs(fast).max()),
            shares=(1 / (1 + np.sqrt(1 + m))).tolist(),
            mass_ratios=m.tolist(),
        ),
        "fig06-heavy": measured(
            bool(peaks["velocity"].min() > 0.1),
            bool(towards_0 < 1e-9),
            second=float(np.abs(peaks["energy"] - 1).max()),
            ratios=peaks["velocity"].tolist(),
            mass_ratios=m.tolist(),
            kept=float(np.abs(peaks["energy"] - 1).max()),
        ),
        "fig06-mirror": measured(float(mirror), k=[1 / value for value in STIFFNESS]),
    }


def _ratio(panel: Any) -> np.ndarray:
    ratio = panel["peak"].values / -THETA0
    return np.asarray(np.minimum(ratio, 1 / ratio))


def draw_histories(ax: Any, data: Any, names: list[str], theta0: float) -> None:
    """theta(case, phase) / abs(theta0) over tau / T0, which differ in shade and dashes."""
    ax.axhline(0.0, color=LOOK.faint, lw=1.2, zorder=0)
    for i, (name, colour) in enumerate(zip(names, shades(len(names)), strict=True)):
        ax.plot(
            data["phase"],
            data["theta"][i] / abs(theta0),
            color=colour,
            ls=LOOK.dashes[i],
            lw=1.1,
            label=name,
        )
    ax.set_xlim(0, float(data["phase"][-1]))
    ax.set_ylim(-1.25, 3.9)
    ax.set_xlabel(r"$\tau\,/\,T_0$")
    ax.legend(loc="upper center", ncols=2, columnspacing=1.2)


FIGURE = paper_figure("fig06", compute=compute, draw=draw, measure=measure)
