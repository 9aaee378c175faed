"""Fig.

7: the peak ratio against the stiffness ratio, from the energy balance, with points of the exact
motion laid over.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import Harmonic, Load, Metainterface, System, VelocityReduction, simulate
from saltus.plots import LOOK, new_figure, panel_label, shades, styled
from saltus.theory import peaks, potential_energy, reciprocal
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import TOLERANCE, dataset, scalar_dataset, scalars, tree
from saltus_paper.figures.figure import paper_figure

LOAD_ANGLES = (2.0, 4.0, 6.0, 8.0, 10.0)  # degrees
LOADS = (0.0, 0.25, 0.5, 0.75, 1.0)
STIFFEST = 1e3  # k
FAR = (1e3, 1e5, 1e7)  # k of the limit; 1/k of that on the other side
CYCLES = 4


def compute(samples: int = 49) -> Any:
    """P_R over k for both panels, and at four values of k from the simulated motion; theta0 < 0, so
    the upper layer starts.
    """
    stiffness = np.geomspace(1.0, STIFFEST, samples)
    groups = {
        "a": _panel(stiffness, [(-0.5, -np.deg2rad(angle)) for angle in LOAD_ANGLES]),
        "b": _panel(stiffness, [(-load, -np.deg2rad(5.0)) for load in LOADS]),
        "balance": _balance(),
        "limit": _limits(),
        "disturbed": _disturbed(),
    }
    return tree(
        groups,
        what="peak ratio of conservative motion, beta0 = 80 deg, m = 0, C = 0, e = 1",
        tol=TOLERANCE,
    )


def system(stiffness: float, vertical: float) -> Any:
    """The conservative system of Fig. 7."""
    return System(
        model=Metainterface(beta0=np.deg2rad(80.0), stiffness_ratio=stiffness),
        load=Load(vertical=vertical),
    )


def simulated_peak(system: Any, theta0: float) -> float:
    """The other peak of the exact motion from theta0 at rest: without losses it comes midway
    between the first two impacts.
    """
    period = peaks(system, theta0).period
    motion = simulate(system, theta=theta0, velocity=0.0, duration=period, tol=TOLERANCE)
    first, second = motion.impacts.time[:2]
    return float(motion.at(np.array([(first + second) / 2]))[0][0])


def _panel(stiffness: np.ndarray, curves: list[tuple[float, float]]) -> Any:
    ratio = np.array([[peaks(system(k, v), start).ratio for k in stiffness] for v, start in curves])
    dots = np.array([1.0, 10.0, 100.0, STIFFEST])
    simulated = np.empty((len(curves), dots.size))
    for i, (vertical, start) in enumerate(curves):
        for j, k in enumerate(dots):
            peak = simulated_peak(system(k, vertical), start)
            simulated[i, j] = min(peak / -start, -start / peak)
    return dataset(
        {
            "ratio": (
                ("curve", "stiffness_ratio"),
                ratio,
                "1",
                "P_R from the energy balance (erratum 6)",
            ),
            "simulated": (("curve", "dot"), simulated, "1", "P_R of the simulated motion"),
        },
        {
            "stiffness_ratio": ("stiffness_ratio", stiffness, "1", "k"),
            "dot": ("dot", dots, "1", "k of the simulated motions"),
            "vertical": ("curve", [c[0] for c in curves], "1", "V"),
            "theta0": ("curve", [c[1] for c in curves], "rad", "initial rotation, at rest"),
        },
        what="P_R(k)",
        system=system(1.0, curves[0][0]),
    )


def _limits() -> Any:
    """P_R sqrt(k) over its limit sqrt(2 P(theta0)) / abs(theta0) for large k on every curve, and
    P_R of motions for small k.
    """
    curves = [(-0.5, -np.deg2rad(angle)) for angle in LOAD_ANGLES] + [
        (-load, -np.deg2rad(5.0)) for load in LOADS
    ]
    errors = np.empty((len(curves), len(FAR)))
    for i, (vertical, start) in enumerate(curves):
        limit = np.sqrt(2 * potential_energy(system(1.0, vertical), start)) / -start
        errors[i] = [peaks(system(k, vertical), start).ratio * np.sqrt(k) / limit - 1 for k in FAR]
    vertical, start = curves[0]
    soft = [simulated_peak(system(1 / k, vertical / k), -start) / start for k in FAR]
    limit = np.sqrt(2 * potential_energy(system(1.0, vertical), start)) / -start
    stiff = simulated_peak(system(FAR[1], vertical), start) / -start
    return dataset(
        {
            "error": (
                ("curve", "stiffness_ratio"),
                errors,
                "1",
                "P_R sqrt(k) over its limit, less 1",
            ),
            "soft_ratio": (
                "stiffness_ratio",
                np.array(soft),
                "1",
                "P_R of the simulated motion from theta_max at 1/k, V/k",
            ),
            "soft_error": (
                "stiffness_ratio",
                np.array(soft) * np.sqrt(FAR) / limit - 1,
                "1",
                "the same over its limit, less 1",
            ),
            "stiff_error": (
                (),
                stiff * np.sqrt(FAR[1]) / limit - 1,
                "1",
                "of the simulated motion at the second k",
            ),
        },
        {"stiffness_ratio": ("stiffness_ratio", np.array(FAR), "1", "k")},
        what="the limits of P_R",
        system=system(FAR[0], vertical),
    )


def _disturbed() -> Any:
    """The ratio of the mean peaks of both sides of motions with a damping, a loss at impacts, or a
    horizontal force.
    """
    start = np.deg2rad(-5.0)
    stiffness = np.array([1.0, 10.0, 100.0, STIFFEST])
    changes: dict[str, dict[str, Any]] = {
        "C = 0.05": {"model.damping": 0.05},
        "e = 0.95": {"impact": VelocityReduction(0.95)},
        "H = 0.01 sin τ": {
            "load": Load(frequency=1.0, horizontal=Harmonic(amplitude=0.01), vertical=-0.5)
        },
    }
    ratios = np.empty((len(changes), stiffness.size))
    for i, change in enumerate(changes.values()):
        for j, k in enumerate(stiffness):
            plain = system(float(k), -0.5)
            parts = {name: value for name, value in change.items() if name in ("impact", "load")}
            disturbed = replace(plain, **parts).with_(
                {n: v for n, v in change.items() if n not in parts}
            )
            motion = simulate(
                disturbed,
                theta=start,
                velocity=0.0,
                duration=2 * CYCLES * peaks(plain, start).period,
                tol=TOLERANCE,
            )
            times = motion.impacts.time[: 2 * CYCLES + 1]
            tops = [
                float(abs(motion.at(np.linspace(a, b, 201))[0]).max()) for a, b in pairwise(times)
            ]
            first = np.mean(tops[::2])
            second = np.mean(tops[1::2])
            ratios[i, j] = min(first / second, second / first)
    return dataset(
        {
            "ratio": (
                ("change", "stiffness_ratio"),
                ratios,
                "1",
                "ratio of the mean peaks of both sides",
            )
        },
        {
            "change": ("change", list(changes)),
            "stiffness_ratio": ("stiffness_ratio", stiffness, "1", "k"),
        },
        what="bouncing-like motion with losses and a load that varies",
        system=system(1.0, -0.5),
    )


def _balance(
    stiffness: float = 5.0, vertical: float = -0.5, theta0: float = np.deg2rad(-10.0)
) -> Any:
    """Both peaks of one simulated motion started on either side, for the balance as printed and
    corrected; the reciprocity.
    """
    reference = system(stiffness, vertical)
    twin, start = reciprocal(reference, theta0)
    values = {
        "stiffness_ratio": stiffness,
        "vertical": vertical,
        "theta_min": theta0,
        "theta_max": simulated_peak(reference, theta0),
        "twin_theta_max": start,
        "twin_theta_min": simulated_peak(twin, start),
        "other_side_theta_max": -theta0,
        "other_side_theta_min": simulated_peak(reference, -theta0),
    }
    return scalar_dataset(values, what="simulated peaks", system=reference)


@styled
def draw(data: Any) -> Any:
    """(a) over the initial rotation, (b) over the vertical load."""
    figure = new_figure(LOOK.double_column, 76.0)
    left, right = figure.subplots(1, 2, sharey=True)
    angles = [rf"${round(np.rad2deg(float(a))):d}^\circ$" for a in data["a"]["theta0"]]
    loads = [rf"${float(v) + 0.0:g}$" for v in data["b"]["vertical"]]
    draw_family(left, data["a"], angles, r"$\theta_0$")
    draw_family(right, data["b"], loads, r"$\overline{\mathcal{V}}$")
    left.set_ylabel(r"peak ratio $P_R$")
    for ax, label in ((left, "a"), (right, "b")):
        panel_label(ax, label)
    return figure


def measure(data: Any) -> dict[str, Measured]:
    """The balance (erratum 6), the monotonic decrease, the limit, the reciprocity."""
    b = scalars(data["balance"])
    k = b["stiffness_ratio"]
    v = b["vertical"]
    low = b["theta_min"]
    high = b["theta_max"]
    b0 = np.deg2rad(80.0)
    printed = k * low**2 / 2 - v * np.sin(b0 + low) - (high**2 / 2 - v * np.sin(b0 - high))
    corrected = k * high**2 / 2 - v * np.sin(b0 + high) - (low**2 / 2 - v * np.sin(b0 + abs(low)))
    deviation = max(_deviation(data["a"]), _deviation(data["b"]))
    unloaded = data["b"]["ratio"][0]
    falls = all((np.diff(data[p]["ratio"].values, axis=1) < 0).all() for p in "ab")
    twin = b["twin_theta_max"] / -b["twin_theta_min"]
    here = high / -low
    there = b["other_side_theta_max"] / -b["other_side_theta_min"]
    return {
        "pot-balance": measured(printed, corrected, k=k, v=v, theta_min=low, theta_max=high),
        "pot-balance-side": measured(
            min(here, 1 / here) - min(there, 1 / there),
            bool(abs(min(here, 1 / here) - min(there, 1 / there)) > 1e-6),
            v=v,
            k=k,
            upper_first=min(here, 1 / here),
            lower_first=min(there, 1 / there),
        ),
        "fig07-unloaded": measured(
            float(np.abs(unloaded - unloaded["stiffness_ratio"] ** -0.5).max())
        ),
        "fig07-simulated": measured(
            deviation, motions=sum(data[p]["simulated"].size for p in "ab")
        ),
        "fig07-monotonic": measured(
            falls, curves=data["a"].sizes["curve"] + data["b"].sizes["curve"], largest_k=STIFFEST
        ),
        **_far(data["limit"], data["disturbed"]),
        "reciprocity": measured(min(here, 1 / here) - min(twin, 1 / twin)),
    }


def _far(limit: Any, disturbed: Any) -> dict[str, Measured]:
    """The limits of k, and the motions with losses and a load that varies."""
    errors = np.abs(limit["error"].values).max(axis=0)
    k = limit["stiffness_ratio"].values
    soft = limit["soft_ratio"].values
    soft_errors = np.abs(limit["soft_error"].values)
    ratios = disturbed["ratio"].values
    stiffness = disturbed["stiffness_ratio"].values
    return {
        "fig07-limit": measured(
            bool((errors[1:] < 0.2 * errors[:-1]).all() and errors[-1] < 1e-3 and abs(float(limit["stiff_error"])) < errors[0]),
            k=k.tolist(), errors=errors.tolist(), simulated_k=k[1], simulated_error=float(limit["stiff_error"]),
        ),
        "fig07-limit-soft": measured(
            bool((soft_errors[1:] < 0.2 * soft_errors[:-1]).all() and soft[-1] < 1e-3),
            k=(1 / k).tolist(), ratios=soft.tolist(), spread=soft_errors[-1],
        ),
        "fig07-disturbed": measured(
            bool((np.diff(ratios, axis=1) < 0).all() and (ratios[:, -1] * np.sqrt(stiffness[-1]) < 3).all()),
            k=stiffness.tolist(), cycles=CYCLES,
            panels=[{"name": str(n), "ratios": row} for n, row in zip(disturbed["change"].values, ratios.tolist(), strict=True)],
        ),
    }  # fmt: skip


def _deviation(panel: Any) -> float:
    theory = panel["ratio"].sel(stiffness_ratio=panel["dot"].values, method="nearest").values
    return float(np.abs(panel["simulated"].values / theory - 1).max())


def draw_family(ax: Any, family: Any, names: list[str], title: str) -> None:
    """Curves ratio(curve, stiffness_ratio) with dots simulated(curve, dot), which differ in shade
    and dashes.
    """
    colours = shades(family.sizes["curve"])
    for i, (name, colour) in enumerate(zip(names, colours, strict=True)):
        ax.plot(
            family["stiffness_ratio"],
            family["ratio"][i],
            color=colour,
            ls=LOOK.dashes[i],
            lw=1.2,
            label=name,
        )
        ax.plot(
            family["dot"],
            family["simulated"][i],
            color=colour,
            ls="none",
            marker="o",
            ms=3.2,
            clip_on=False,
            zorder=4,
        )
    ax.set_xscale("log")
    ax.set_xlim(1, float(family["stiffness_ratio"][-1]))
    ax.set_ylim(0, 1.03)
    ax.set_xlabel("stiffness ratio $k$")
    ax.legend(title=title, loc="upper right")


FIGURE = paper_figure("fig07", compute=compute, draw=draw, measure=measure)
