"""Fig. 7: the peak ratio against the stiffness ratio, from the energy balance, with points of the exact motion laid over."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.flow import simulate
from saltus.paper.claims.claim import Measured, measured
from saltus.paper.figure_data import TOLERANCE, dataset, scalar_dataset, scalars, tree
from saltus.paper.figures.figure import paper_figure
from saltus.plots import DOUBLE_COLUMN, draw_family, new_figure, panel_label, styled
from saltus.systems import Load, Metainterface, System
from saltus.theory import peaks, reciprocal

LOAD_ANGLES = (2.0, 4.0, 6.0, 8.0, 10.0)  # degrees
LOADS = (0.0, 0.25, 0.5, 0.75, 1.0)
STIFFEST = 1e3  # k


def compute(samples: int = 49) -> Any:
    """P_R over k for both panels, and at four values of k from the simulated motion; theta0 < 0, so the upper layer starts."""
    stiffness = np.geomspace(1.0, STIFFEST, samples)
    groups = {
        "a": _panel(stiffness, [(-0.5, -np.deg2rad(angle)) for angle in LOAD_ANGLES]),
        "b": _panel(stiffness, [(-load, -np.deg2rad(5.0)) for load in LOADS]),
        "balance": _balance(),
    }
    return tree(groups, what="peak ratio of conservative motion, beta0 = 80 deg, m = 0, C = 0, e = 1", tol=TOLERANCE)


def system(stiffness: float, vertical: float) -> Any:
    """The conservative system of Fig. 7."""
    return System(model=Metainterface(beta0=np.deg2rad(80.0), stiffness_ratio=stiffness), load=Load(vertical=vertical))


def simulated_peak(system: Any, theta0: float) -> float:
    """The other peak of the exact motion from theta0 at rest: without losses it comes midway between the first two impacts."""
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
            "ratio": (("curve", "stiffness_ratio"), ratio, "1", "P_R from the energy balance (erratum 6)"),
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


def _balance(stiffness: float = 5.0, vertical: float = -0.5, theta0: float = np.deg2rad(-10.0)) -> Any:
    """Both peaks of one simulated motion from either side, for the balance as printed and as corrected; the reciprocity."""
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
    figure = new_figure(DOUBLE_COLUMN, 76.0)
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
    k, v, low, high, b0 = b["stiffness_ratio"], b["vertical"], b["theta_min"], b["theta_max"], np.deg2rad(80.0)
    printed = k * low**2 / 2 - v * np.sin(b0 + low) - (high**2 / 2 - v * np.sin(b0 - high))
    corrected = k * high**2 / 2 - v * np.sin(b0 + high) - (low**2 / 2 - v * np.sin(b0 + abs(low)))
    deviation = max(_deviation(data["a"]), _deviation(data["b"]))
    unloaded = data["b"]["ratio"][0]
    falls = all((np.diff(data[p]["ratio"].values, axis=1) < 0).all() for p in "ab")
    last = max(float(data[p]["ratio"][:, -1].max()) for p in "ab")
    twin = b["twin_theta_max"] / -b["twin_theta_min"]
    here, there = high / -low, b["other_side_theta_max"] / -b["other_side_theta_min"]
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
        "fig07-unloaded": measured(float(np.abs(unloaded - unloaded["stiffness_ratio"] ** -0.5).max())),
        "fig07-simulated": measured(deviation, motions=sum(data[p]["simulated"].size for p in "ab")),
        "fig07-monotonic": measured(falls, curves=data["a"].sizes["curve"] + data["b"].sizes["curve"], largest_k=STIFFEST),
        "fig07-limit": measured(
            bool(last * np.sqrt(STIFFEST) < 3), largest=last, largest_k=STIFFEST, scaled=last * np.sqrt(STIFFEST)
        ),
        "reciprocity": measured(min(here, 1 / here) - min(twin, 1 / twin)),
    }


def _deviation(panel: Any) -> float:
    theory = panel["ratio"].sel(stiffness_ratio=panel["dot"].values, method="nearest").values
    return float(np.abs(panel["simulated"].values / theory - 1).max())


FIGURE = paper_figure("fig07", compute=compute, draw=draw, measure=measure)
