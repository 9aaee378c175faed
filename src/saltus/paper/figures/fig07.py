"""Fig. 7: the peak ratio against the stiffness ratio, from the energy balance, with points of the exact motion laid over."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.provenance import TOLERANCE, dataset, tree
from saltus.plots import DOUBLE_COLUMN, draw_family, new_figure, panel_label, styled

ANGLES = (2.0, 4.0, 6.0, 8.0, 10.0)  # degrees
LOADS = (0.0, 0.25, 0.5, 0.75, 1.0)
LARGEST = 1e3


def compute(samples: int = 49) -> Any:
    """P_R over k for both panels, and at four values of k from the simulated motion; theta0 < 0, so the upper layer starts."""
    stiffness = np.geomspace(1.0, LARGEST, samples)
    groups = {
        "a": _panel(stiffness, [(-0.5, -np.deg2rad(angle)) for angle in ANGLES]),
        "b": _panel(stiffness, [(-load, -np.deg2rad(5.0)) for load in LOADS]),
        "balance": _balance(),
    }
    return tree(groups, what="peak ratio of conservative motion, beta0 = 80 deg, m = 0, C = 0, e = 1", tol=TOLERANCE)


def system(stiffness: float, vertical: float) -> Any:
    """The conservative system of Fig. 7."""
    from saltus.systems import Load, Metainterface, System

    return System(model=Metainterface(beta0=np.deg2rad(80.0), stiffness_ratio=stiffness), load=Load(vertical=vertical))


def simulated_peak(system: Any, theta0: float) -> float:
    """The other peak of the exact motion from theta0 at rest: without losses it comes midway between the first two impacts."""
    from saltus.flow import simulate
    from saltus.theory import peaks

    period = peaks(system, theta0).period
    motion = simulate(system, theta=theta0, velocity=0.0, duration=period, tol=TOLERANCE)
    first, second = motion.impacts.time[:2]
    return float(motion.at(np.array([(first + second) / 2]))[0][0])


def _panel(stiffness: np.ndarray, curves: list[tuple[float, float]]) -> Any:
    from saltus.theory import peaks

    ratio = np.array([[peaks(system(k, v), start).ratio for k in stiffness] for v, start in curves])
    dots = np.array([1.0, 10.0, 100.0, LARGEST])
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
    from saltus.theory import reciprocal

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
    return dataset({name: ((), value) for name, value in values.items()}, what="simulated peaks", system=reference)


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


def claims(data: Any) -> list[Claim]:
    """The balance (erratum 6), the monotonic decrease, the limit, the reciprocity."""
    b = {name: float(value) for name, value in data["balance"].to_dataset().items()}
    k, v, low, high, b0 = b["stiffness_ratio"], b["vertical"], b["theta_min"], b["theta_max"], np.deg2rad(80.0)
    printed = k * low**2 / 2 - v * np.sin(b0 + low) - (high**2 / 2 - v * np.sin(b0 - high))
    corrected = k * high**2 / 2 - v * np.sin(b0 + high) - (low**2 / 2 - v * np.sin(b0 + abs(low)))
    deviation = max(_deviation(data["a"]), _deviation(data["b"]))
    unloaded = data["b"]["ratio"][0]
    falls = all((np.diff(data[p]["ratio"].values, axis=1) < 0).all() for p in "ab")
    last = max(float(data[p]["ratio"][:, -1].max()) for p in "ab")
    twin = b["twin_theta_max"] / -b["twin_theta_min"]
    here, there = high / -low, b["other_side_theta_max"] / -b["other_side_theta_min"]
    return [
        check(
            "pot-balance",
            "pot_balance",
            "The two peaks of conservative motion match their potential energies",
            printed=printed,
            corrected=corrected,
            erratum=6,
            tolerance=1e-11,
            evidence=f"k = {k:g}, V = {v:g}: simulated from θ_min = {low:.6f} the motion turns at θ_max = {high:.12f}",
        ),
        check(
            "pot-balance-side",
            "pot_balance, Fig. 7",
            "P_R is a function of V and k for a given |θ₀|, whichever side starts",
            printed=min(here, 1 / here) - min(there, 1 / there),
            corrected=bool(abs(min(here, 1 / here) - min(there, 1 / there)) > 1e-6),
            erratum=6,
            evidence=f"simulated, |θ₀| = 10°, V = {v:g}, k = {k:g}: P_R = {min(here, 1 / here):.6f} if the upper layer starts, "
            f"{min(there, 1 / there):.6f} if the lower one does",
        ),
        check(
            "fig07-unloaded",
            "quasi-bounce-peak",
            "Without load P_R = min{1/√k, √k}",
            printed=float(np.abs(unloaded - unloaded["stiffness_ratio"] ** -0.5).max()),
            evidence="largest deviation of the energy balance at V = 0 over the curve",
        ),
        check(
            "fig07-simulated",
            "Fig. 7",
            "The peak ratio of the balance is that of the motion",
            printed=deviation,
            tolerance=1e-10,
            evidence=f"{sum(data[p]['simulated'].size for p in 'ab')} simulated motions, largest relative deviation of P_R",
        ),
        check(
            "fig07-monotonic",
            "Fig. 7",
            "P_R decreases monotonically with k ≥ 1",
            printed=falls,
            evidence=f"all {data['a'].sizes['curve'] + data['b'].sizes['curve']} curves over k = 1 to {LARGEST:g}",
        ),
        check(
            "fig07-limit",
            "section 5.3",
            "P_R vanishes for k → ∞ with V < 0 too",
            printed=bool(last * np.sqrt(LARGEST) < 3),
            evidence=f"P_R ≤ {last:.4f} at k = {LARGEST:g} on every curve, P_R √k ≤ {last * np.sqrt(LARGEST):.3f}",
        ),
        check(
            "reciprocity",
            "Prprop",
            "P_R(V, k) from θ_min equals P_R(V/k, 1/k) from θ_max = |θ_min|",
            printed=min(here, 1 / here) - min(twin, 1 / twin),
            tolerance=1e-10,
            evidence="both motions simulated",
        ),
    ]


def _deviation(panel: Any) -> float:
    theory = panel["ratio"].sel(stiffness_ratio=panel["dot"].values, method="nearest").values
    return float(np.abs(panel["simulated"].values / theory - 1).max())


FIGURE = PaperFigure(
    name="fig07",
    title="Fig. 7: peak ratio of bouncing-like motion",
    caption=(
        "Peak ratio P_R over the stiffness ratio k (β₀ = 80°, m = 0, C = 0, e = 1) for motions that start at "
        "rest with θ₀ < 0, the upper "
        "layer open: with V < 0 the other start gives another ratio (erratum 6). (a) V = −0.5, θ₀ = −2° to −10°; (b) θ₀ = −5°, "
        "V = 0 to −1. Lines: energy balance; dots: peaks of the simulated motion. The curve of V = 0 is 1/√k."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
