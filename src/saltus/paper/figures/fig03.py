"""Fig. 3: the misalignment and the difference angle near an impact, from an exact motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.provenance import TOLERANCE, dataset, tree
from saltus.plots import DOUBLE_COLUMN, draw_history, draw_phase, new_figure, panel_label, styled

SPAN = 1.5  # of time before the impact


def compute(alpha0: float = 45.0, samples: int = 400) -> Any:
    """theta, phi and their rates until the first impact from theta = 0.4 at rest, beta0 = 80 deg; `alpha0` in degrees."""
    from saltus.flow import simulate
    from saltus.systems import Load, Metainterface, System, UnitCell

    beta0 = np.deg2rad(80.0)
    cell = UnitCell(alpha0=np.deg2rad(alpha0), beta0=beta0)
    system = System(model=Metainterface(beta0=beta0, damping=0.1), load=Load(vertical=-0.5))
    motion = simulate(system, theta=0.4, velocity=0.0, duration=4.0, tol=TOLERANCE)
    impact = float(motion.impacts.time[0])
    to_go = np.concatenate([np.linspace(SPAN, 0.05, samples), np.geomspace(0.05, 1e-8, samples)[1:]])
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
    return tree({"approach": data}, what="misalignment and difference angle before an impact", tol=TOLERANCE)


@styled
def draw(data: Any) -> Any:
    """(a) over time, (b) in the phase plane."""
    figure = new_figure(DOUBLE_COLUMN, 66.0)
    left, right = figure.subplots(1, 2)
    draw_history(left, data["approach"])
    draw_phase(right, data["approach"])
    panel_label(left, "a")
    panel_label(right, "b")
    return figure


def claims(data: Any) -> list[Claim]:
    """The square-root law and the singular velocity."""
    d = data["approach"]
    near = d["to_go"].values < 1e-4
    to_go, rate = d["to_go"].values[near], abs(d["phi_velocity"].values[near])
    slope = float(np.polyfit(np.log(to_go), np.log(rate), 1)[0])
    ratio = d["phi_small"].values / d["phi"].values - 1
    product = 2 * d.attrs["psi"] / d.attrs["sin_beta0"] * d["phi"].values * abs(d["phi_velocity"].values)
    velocity = abs(d["theta_velocity"].values)
    return [
        check(
            "fundamental-property",
            "fundamentalproperty",
            "|θ| ≈ ψ φ² / sin β₀ for small φ",
            printed=float(ratio[-1]),
            tolerance=1e-6,
            evidence=f"relative error of φ {abs(ratio[0]):.1e} at θ = {d['theta'].values[0]:.3f}, {abs(ratio[-1]):.1e} at "
            f"θ = {d['theta'].values[-1]:.1e}",
        ),
        check(
            "fundamental-velocity",
            "fundamentalvelocity",
            "|θ'| ≈ 2 ψ |φ| |φ'| / sin β₀ for small φ",
            printed=float(product[-1] / velocity[-1] - 1),
            tolerance=1e-6,
            evidence=f"exact rates {d['to_go'].values[-1]:.0e} before the impact of a simulated motion",
        ),
        check(
            "phi-singular",
            "Fig. 3",
            "The velocity of φ is infinite at an impact that θ meets with a finite one",
            printed=bool(abs(slope + 0.5) < 1e-3),
            evidence=f"φ' grows like (τ* − τ)^{slope:.5f} down to τ* − τ = {to_go[-1]:.0e}, where φ' = {rate[-1]:.3g} and "
            f"θ' = {-velocity[-1]:.4f}",
        ),
    ]


FIGURE = PaperFigure(
    name="fig03",
    title="Fig. 3: misalignment and difference angle at an impact",
    caption=(
        "Approach to an impact at τ*, from an exact motion (β₀ = 80°, α₀ = 45°, C = 0.1, V = −0.5, from θ = 0.4 at rest). "
        "(a) |φ| and |θ| over time; (b) their phase portraits. The velocity of φ grows without bound as φ → 0, "
        "that of θ does not."
    ),
    compute=compute,
    draw=draw,
    claims=claims,
)
