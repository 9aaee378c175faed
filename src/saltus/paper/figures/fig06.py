"""Fig. 6: bouncing-like time histories of unequal layers without loads, with both impact laws where masses differ."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.provenance import TOLERANCE, dataset, tree
from saltus.plots import DOUBLE_COLUMN, draw_histories, new_figure, panel_label, styled

STIFFNESS = (1.0, 4.0, 16.0, 100.0)
MASSES = (0.0, 1.0, 3.0, 8.0)
THETA0 = -0.1  # rad; without loads the motion is linear on each side, so that only its sign matters
CYCLES = 2.0


def compute(samples: int = 500) -> Any:
    """theta over tau / T0 from theta_min at rest, V = H = 0: (a) over k, m = 0; (b) over m, k = 1, with e = 1 and with r = 1."""
    from saltus.systems import EnergyRestitution, VelocityReduction

    groups = {
        "a": _histories([(k, 0.0) for k in STIFFNESS], VelocityReduction(1.0), samples),
        "b_velocity": _histories([(1.0, m) for m in MASSES], VelocityReduction(1.0), samples),
        "b_energy": _histories([(1.0, m) for m in MASSES], EnergyRestitution(1.0), samples),
    }
    return tree(groups, what="bouncing-like motion without loads, beta0 = 80 deg, C = 0", tol=TOLERANCE)


def _histories(cases: list[tuple[float, float]], impact: Any, samples: int) -> Any:
    from saltus.flow import simulate
    from saltus.systems import Load, Metainterface, System
    from saltus.theory import total_energy, unloaded_peak_ratio, unloaded_period

    phase = np.linspace(0, CYCLES, samples)
    theta, peak, period, energy = [], [], [], []
    for k, m in cases:
        model = Metainterface(beta0=np.deg2rad(80.0), stiffness_ratio=k, mass_ratio=m)
        system = System(model=model, load=Load(vertical=0.0), impact=impact)
        cycle = float(unloaded_period(k, m))
        motion = simulate(system, theta=THETA0, velocity=0.0, duration=CYCLES * cycle, tol=TOLERANCE)
        first, second, third = motion.impacts.time[:3]
        theta.append(motion.at(np.minimum(phase * cycle, motion.time))[0])
        peak.append(float(motion.at(np.array([(first + second) / 2]))[0][0]))
        period.append(float(third - first))
        after = motion.impacts.velocity_after[0]
        energy.append(total_energy(system, 0.0, after, 1) / total_energy(system, THETA0, 0.0))
    k, m = np.array(cases).T
    conserving = type(impact).__name__ == "EnergyRestitution"
    return dataset(
        {
            "theta": (("case", "phase"), np.array(theta), "rad", "difference angle"),
            "peak": ("case", peak, "rad", "theta_max of the motion"),
            "period": ("case", period, "1", "time from first to third impact"),
            "period_theory": ("case", unloaded_period(k, m), "1", "T0 of `period_case2`"),
            "ratio_theory": ("case", unloaded_peak_ratio(k, m, energy_conserving=conserving), "1", "P_R (erratum 7)"),
            "energy_ratio": ("case", energy, "1", "energy on the lower side over that on the upper one"),
        },
        {
            "phase": ("phase", phase, "1", "tau / T0(k, m)"),
            "stiffness_ratio": ("case", k, "1", "k"),
            "mass_ratio": ("case", m, "1", "m"),
        },
        what="time histories",
        system=system,
        tol=TOLERANCE,
        theta0=THETA0,
    )


@styled
def draw(data: Any) -> Any:
    """(a) over k; (b) over m, with the velocity kept and with the energy kept at impacts."""
    figure = new_figure(DOUBLE_COLUMN, 74.0)
    axes = figure.subplots(1, 3, sharey=True)
    panels = (("a", "a", "stiffness_ratio", "k", ""), ("b_velocity", "b", "mass_ratio", "m", ": $e=1$"))
    for ax, (name, label, case, symbol, law) in zip(
        axes, (*panels, ("b_energy", "b", "mass_ratio", "m", ": $r=1$")), strict=True
    ):
        names = [f"${symbol}={float(value):g}$" for value in data[name][case]]
        draw_histories(ax, data[name], names, THETA0)
        panel_label(ax, label)
        ax.set_title(ax.get_title(loc="left") + law, loc="left", pad=4)
    axes[0].set_ylabel(r"$\theta\,/\,|\theta_{\min}|$")
    return figure


def claims(data: Any) -> list[Claim]:
    """Peaks and periods, and erratum 7."""
    from saltus.theory import unloaded_period

    a, velocity, energy = data["a"], data["b_velocity"], data["b_energy"]
    ratios = {name: _ratio(data[name]) for name in ("a", "b_velocity", "b_energy")}
    shift = float(np.abs(ratios["b_velocity"] - ratios["b_velocity"][0]).max())
    kept = float(np.abs(ratios["b_energy"] - ratios["b_energy"][0]).max())
    right = float(np.abs(ratios["b_velocity"] / velocity["ratio_theory"].values - 1).max())
    change = velocity["energy_ratio"].values
    limits = [float(unloaded_period(k, m)) for k, m in ((1e12, 0.0), (1e-12, 0.0), (1.0, 1e12))]
    periods = max(float(np.abs(d["period"] / d["period_theory"] - 1).max()) for d in (a, velocity, energy))
    return [
        check(
            "fig06-peaks",
            "section 5.3",
            "Without loads and with m = 0, θ_max = |θ_min| / √k, so P_R = 1/√k for k ≥ 1",
            printed=float(np.abs(ratios["a"] / a["ratio_theory"].values - 1).max()),
            evidence=f"simulated peaks for k = {list(STIFFNESS)}",
        ),
        check(
            "fig06-balance-sign",
            "section 5.3",
            "Without loads θ_max = −√k θ_min",
            printed=float(np.abs(a["peak"].values / (-THETA0 * np.sqrt(a["stiffness_ratio"].values)) - 1).max()),
            corrected=float(np.abs(a["peak"].values / (-THETA0 / np.sqrt(a["stiffness_ratio"].values)) - 1).max()),
            erratum=6,
            evidence="simulated peaks against θ_max = |θ_min| / √k",
        ),
        check(
            "fig06-period",
            "period_case1, period_case2",
            "T0 = π (1 + √((1+m)/k)), whatever the amplitude",
            printed=periods,
            evidence="time between the first and the third impact of 12 simulated motions, with e = 1 and with r = 1",
        ),
        check(
            "fig06-period-limits",
            "section 5.3",
            "T0 → π for k → ∞, and grows without bound for k → 0 or m → ∞",
            printed=bool(limits[0] - np.pi < 1e-5 and limits[1] > 1e5 and limits[2] > 1e5),
            evidence=f"T0 = {limits[0]:.7f} at k = 10¹², {limits[1]:.3g} at k = 10⁻¹², {limits[2]:.3g} at m = 10¹²; simulated at "
            f"k = {STIFFNESS[-1]:g}: {float(a['period'][-1]):.6f}",
        ),
        check(
            "fig06-mass",
            "section 5.3",
            "P_R does not depend on m",
            printed=shift,
            corrected=bool(right < 1e-9 and kept < 1e-9),
            erratum=7,
            evidence=f"m = {list(MASSES)}: with e = 1 P_R = {ratios['b_velocity'].round(6).tolist()}, that is min(√((1+m)/k), "
            f"√(k/(1+m))) within {right:.0e}; with r = 1 it stays within {kept:.0e}",
        ),
        check(
            "fig06-conservative",
            "section 5.3",
            "With e = 1 and C = 0 the energy is conserved for m > 0",
            printed=float(np.abs(change - 1).max()),
            corrected=float(np.abs(change / (1 + velocity["mass_ratio"].values) - 1).max())
            + float(np.abs(energy["energy_ratio"].values - 1).max()),
            erratum=7,
            evidence=f"from upper to lower layer e = 1 multiplies the energy by {change.round(9).tolist()} = 1 + m, and back; "
            "r = 1 keeps it",
        ),
        check(
            "fig06-fast-side",
            "section 5.3",
            "For large m (or small k) the share of the period with θ < 0 vanishes",
            printed=bool((np.diff(np.pi / velocity["period"].values) < 0).all()),
            evidence=f"shares {(np.pi / velocity['period'].values).round(4).tolist()} for m = {list(MASSES)}",
        ),
    ]


def _ratio(panel: Any) -> np.ndarray:
    ratio = panel["peak"].values / -THETA0
    return np.minimum(ratio, 1 / ratio)


FIGURE = PaperFigure(
    name="fig06",
    title="Fig. 6: bouncing-like time histories",
    caption=(
        "Time histories without loads over τ/T0(k, m), from θ_min at rest (β₀ = 80°, C = 0): (a) m = 0, e = 1 "
        "and k ≥ 1; (b) k = 1 "
        "and m ≥ 0. With m > 0 a continuous velocity (e = 1) changes the energy at each impact and the peaks grow "
        "with √(1+m); the energy-conserving impact (r = 1) keeps them (erratum 7)."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
