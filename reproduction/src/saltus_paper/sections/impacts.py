"""Section 4: jumps of acceleration, energy and velocity at impacts (errata 4, 5, 25, 26, and our
own 29 and 40).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus import (
    EnergyRestitution,
    Harmonic,
    InelasticImpact,
    Load,
    Metainterface,
    RockingBlock,
    System,
    TwoLayer,
    VelocityReduction,
    simulate,
)
from saltus.systems import LayerState, other_impulse
from saltus.theory import energy_factor, energy_jump, equilibria, total_energy
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import scalar_dataset, scalars
from saltus_paper.figures.phase_portraits import constant_load
from saltus_paper.sections.equations_of_motion import random_case

TIME = 0.2  # the time of the impacts, at which no load and no ground velocity is zero


def compute(impacts: int = 400) -> Any:
    """Largest residuals, and counts of right and wrong signs, over random impacts."""
    rng = np.random.default_rng(3)
    jumps = [
        _jump(rng, e)
        for e in np.where(rng.random(impacts // 4) < 0.3, 1.0, rng.uniform(0.1, 1, impacts // 4))
    ]
    values: dict[str, Any] = {name: max(row[name] for row in jumps) for name in jumps[0]}
    values |= {
        **_no_jump(),
        **_energies(rng, impacts),
        **_still_ground(),
        **_without_root(),
        **_inelastic(rng),
        **_pushing(rng),
    }
    values |= {**_energy_of_motion(), **_both_factors(rng), **_stable_states()}
    return scalar_dataset(values, what="impacts", impacts=impacts)


def _jump(rng: np.random.Generator, e: float) -> dict[str, float]:
    """[[theta'']] from the model on both sides, against `accjump` as printed and as corrected, and
    `accjump_red`.
    """
    single, _, load = random_case(rng)
    before = float(rng.normal())
    b0 = single.beta0
    m = single.mass_ratio
    c = single.dissipation_ratio
    after = e * before
    side = float(np.sign(before))

    def exact(model: Any, loads: Any) -> float:
        return float(
            model.acceleration(TIME, 0.0, after, side, loads)
            - model.acceleration(TIME, 0.0, before, -side, loads)
        )

    lower, upper = (after, before) if side > 0 else (before, after)
    hh = load.lower_horizontal(TIME) - m * load.horizontal(TIME)
    vertical = (
        (m + 2) * load.vertical(TIME)
        + load.lower_vertical(TIME)
        - 2 * (1 + m) * load.ground_vertical.acceleration(TIME)
    )
    rest = hh * math.sin(b0) + vertical * math.cos(b0)
    printed = side / (1 + m) * (rest + (1 - c + m) * single.damping * (after - before))
    corrected = side / (1 + m) * (rest + single.damping * ((1 + m) * upper - c * lower))
    symmetric, loads = _symmetric(single, load)
    along = 2 * math.cos(b0) * (load.vertical(TIME) - load.ground_vertical.acceleration(TIME))
    reduced = exact(symmetric, loads)
    return {
        "jump_printed": abs(printed - exact(single, load)),
        "jump_corrected": abs(corrected - exact(single, load)),
        "reduced_printed": abs(side * (single.damping * (after - before) + along) - reduced),
        "reduced_corrected": abs(-single.damping * (after - before) + side * along - reduced),
    }


def _symmetric(single: Any, load: Any) -> tuple[Any, Any]:
    """The symmetric model with the same angle and damping, and the loads on the upper mass only."""
    channels = {
        name: signal for name, signal in load.channels.items() if not name.startswith("lower_")
    }
    return Metainterface(beta0=single.beta0, damping=single.damping), Load(
        frequency=load.frequency, **channels
    )


def _no_jump() -> dict[str, float]:
    """[[theta'']] with e = 1 and V = nu''; and the effect of zeta'' on it."""
    model = Metainterface(beta0=1.4, damping=0.2)

    def jump(shake: float) -> float:
        # nu''(0) = 0.3
        load = Load(
            frequency=1.0, vertical=0.3, ground_vertical=Harmonic(amplitude=-0.3, phase=np.pi / 2)
        )
        load = Load(
            frequency=1.0,
            **{**load.channels, "ground_horizontal": Harmonic(amplitude=-shake, phase=np.pi / 2)},
        )
        return float(
            model.acceleration(0.0, 0.0, 0.5, 1, load) - model.acceleration(0.0, 0.0, 0.5, -1, load)
        )

    pressed = Load(vertical=-0.5)
    at_rest = float(
        model.acceleration(0.0, 0.0, 0.5, 1, pressed)
        - model.acceleration(0.0, 0.0, 0.5, -1, pressed)
    )
    return {
        "jump_vanishes": abs(jump(0.0)),
        "jump_with_ground": abs(jump(2.0) - jump(0.0)),
        "jump_e_1": at_rest,
    }


def _energies(rng: np.random.Generator, impacts: int) -> dict[str, Any]:
    """r from the energies of both masses, against the paper's formula and the corrected one; the
    signs of [[T]].
    """
    counts = dict.fromkeys(("sign_printed", "sign_corrected", "sign_still", "gains_moving"), 0)
    worst = dict.fromkeys(("r_printed", "r_corrected", "r_e_1_printed"), 0.0)
    changes = []
    for i in range(impacts):
        single, double, load = random_case(rng)
        if i % 2:
            single, double = (type(model)(beta0=single.beta0) for model in (single, double))
        e = float(rng.uniform(0.1, 1))
        velocity = float(rng.normal())
        side = -int(np.sign(velocity))
        system = System(model=single, load=load, impact=VelocityReduction(e))
        before, after = (
            _both_masses(double, load, v, s) for v, s in ((velocity, side), (e * velocity, -side))
        )
        jump = after - before
        counts["sign_corrected"] += bool(
            (energy_jump(system, velocity, side, e, TIME) < 0) != (jump < 0)
        )
        worst["r_corrected"] = max(
            worst["r_corrected"],
            abs(energy_factor(system, velocity, side, e, TIME) / (after / before) - 1),
        )
        if i % 2:  # the paper's formulas are for m = 0
            r, falls = _as_printed(load, single.beta0, velocity, e)
            counts["sign_printed"] += bool(falls != (jump < 0))
            counts["sign_still"] += bool(
                _both_masses(double, Load(), e * velocity, -side)
                >= _both_masses(double, Load(), velocity, side)
            )
            counts["gains_moving"] += bool(jump > 0)
            worst["r_e_1_printed"] = max(
                worst["r_e_1_printed"], abs(_as_printed(load, single.beta0, velocity, 1.0)[0] - 1)
            )
            worst["r_printed"] = max(worst["r_printed"], abs(r / (after / before) - 1))
            changes.append(abs(_both_masses(double, load, velocity, -side) / before - 1))
    return {**counts, **worst, "change_at_e_1": float(np.median(changes))}


def _both_masses(double: Any, load: Any, velocity: float, side: int) -> float:
    """T of both masses with one layer moving, from the two-layer model (`kin_eng`)."""
    pair = (velocity, 0.0) if side > 0 else (0.0, velocity)
    return float(double.kinetic_energy(TIME, (0.0, 0.0), pair, 0, load))


def _as_printed(load: Any, b0: float, velocity: float, e: float) -> tuple[float, bool]:
    """r of `rest_def_vel`, and whether the condition after it says that the energy falls."""
    zeta = load.ground_horizontal.velocity(TIME)
    nu = load.ground_vertical.velocity(TIME)
    energies = [
        (f * velocity * math.sin(b0) + zeta) ** 2 + (f * velocity * math.cos(b0) + nu) ** 2
        for f in (e, 1.0)
    ]
    falls = ((1 + e) * velocity + 2 * (zeta * math.sin(b0) + nu * math.cos(b0))) * velocity > 0
    return energies[0] / energies[1], falls


def _still_ground() -> dict[str, float]:
    """r - e^2 on a ground at rest, m = 0, from both sides."""
    system = System(model=Metainterface(beta0=1.3))
    return {
        "r_still": max(
            abs(energy_factor(system, -s * 0.7, s, e) - e * e)
            for s in (1, -1)
            for e in (0.2, 0.8, 1.0)
        )
    }


def _without_root() -> dict[str, float]:
    """An energy restitution on a moving ground for which there is no velocity after the impact, and
    one for which there is.
    """
    model = Metainterface(beta0=np.deg2rad(80.0))
    load = Load(frequency=1.0, ground_horizontal=Harmonic(amplitude=0.5))
    law = EnergyRestitution(0.6)
    slow, fast = (float(law.velocity_after(model, 0.0, v, -1, 1, load)) for v in (0.05, 2.0))
    energies = [
        float(model.kinetic_energy(0.0, 0.0, v, s, load)) for v, s in ((fast, 1), (2.0, -1))
    ]
    return {"root_slow": slow, "root_fast": fast, "restitution_fast": energies[0] / energies[1]}


def _inelastic(rng: np.random.Generator) -> dict[str, float]:
    """The restitution of errata 25 against the momentum balance of both layers solved
    numerically.
    """
    worst = 0.0
    for beta0, m in zip(
        rng.uniform(np.pi / 4 + 0.01, 3 * np.pi / 4 - 0.01, 50), rng.uniform(0, 2, 50), strict=True
    ):
        matrix = TwoLayer(beta0=float(beta0), mass_ratio=float(m)).mass_matrix((0.0, 0.0))
        for side, hit in ((1, 0), (-1, 1)):
            free = 1 - hit
            before = np.eye(2)[hit]  # the hit layer moves, the other is closed
            # unknowns: velocity of the free layer after, impulse on the hit one, which stops it
            unknown = np.linalg.solve(
                np.column_stack([matrix[:, free], -np.eye(2)[hit]]), matrix @ before
            )
            law = InelasticImpact().velocity_after(
                Metainterface(beta0=float(beta0), mass_ratio=float(m)),
                0.0,
                1.0,
                side,
                -side,
                Load(),
            )
            worst = max(worst, abs(float(law) - unknown[0]))
    model = Metainterface(beta0=np.deg2rad(80.0))
    factor = float(model.inelastic_factor(1))
    return {
        "inelastic": worst,
        "inelastic_factor": factor,
        "outside": float(Metainterface(beta0=0.7).inelastic_factor(1)),
    }


def _pushing(rng: np.random.Generator) -> dict[str, float]:
    """How far the least e at which the closed layer's contact still pushes is from -cos(2 beta0),
    over 1+m going down (29).
    """
    worst = 0.0
    for beta0, m in zip(
        rng.uniform(np.pi / 4 + 0.01, 3 * np.pi / 4 - 0.01, 50), rng.uniform(0, 2, 50), strict=True
    ):
        model = TwoLayer(beta0=float(beta0), mass_ratio=float(m))
        for layer, mass in ((1, 1.0), (2, 1.0 + m)):
            worst = max(worst, abs(_least_factor(model, layer) + math.cos(2 * beta0) / mass))
    return {"pushing": worst, "least_e": _least_factor(TwoLayer(beta0=math.radians(80.0)), 1)}


def _least_factor(model: Any, layer: int) -> float:
    """The velocity factor at which the contact of the layer that opens gives no impulse: linear in
    e, so two values find it.
    """
    closing = -1.0 if layer == 1 else 1.0
    before = LayerState((0.0, 0.0), (closing, 0.0) if layer == 1 else (0.0, closing))
    none, full = (
        other_impulse(
            model,
            before,
            LayerState((0.0, 0.0), (0.0, e * closing) if layer == 1 else (e * closing, 0.0)),
            layer,
        )
        for e in (0.0, 1.0)
    )
    return -none / (full - none)


def _energy_of_motion(e: float = 0.8, gap: float = 1e-9) -> dict[str, float]:
    """The jumps of the total energy of a simulated motion over its impacts, less those of
    `eng_loss` with r = e^2 (m = 0).
    """
    system = constant_load(e=e)
    motion = simulate(system, theta=0.42, velocity=0.0, duration=20.0, tol=1e-12)
    worst = 0.0
    for time, before in zip(motion.impacts.time, motion.impacts.velocity_before, strict=True):
        first, last = (
            total_energy(system, *(float(x) for x in motion.at(t)))
            for t in (time - gap, time + gap)
        )
        worst = max(worst, abs(last - first + (1 - e * e) * before**2 / 2))
    return {"energy_of_motion": worst, "impacts_of_motion": len(motion.impacts)}


def _both_factors(rng: np.random.Generator, impacts: int = 60) -> dict[str, float]:
    """The spread of r over random impacts and horizontal ground velocities, m = 0: e = 0.8 and 1,
    and on a ground at rest.
    """
    model = Metainterface(beta0=1.3)
    spreads = {}
    for name, e, shake in (("moving", 0.8, 1.0), ("moving_e_1", 1.0, 1.0), ("still", 0.8, 0.0)):
        factors = []
        for velocity, ground in zip(
            -rng.uniform(0.1, 2, impacts), rng.normal(size=impacts), strict=True
        ):
            load = Load(frequency=1.0, ground_horizontal=Harmonic(amplitude=shake * float(ground)))
            factors.append(
                energy_factor(System(model=model, load=load), float(velocity), 1, e, 0.0)
            )
        spreads[f"spread_{name}"] = float(np.ptp(factors))
    return spreads


def _stable_states() -> dict[str, float]:
    """The number of stable equilibria of the loaded cell, and the largest number of a rocking block
    of any slenderness, without those on its sides."""
    block = 0
    for alpha in np.linspace(0.05, 1.5, 30):
        angle = np.linspace(1e-6, np.pi / 2, 4001)
        turning = np.array(
            [RockingBlock(alpha=float(alpha)).acceleration(0.0, x, 0.0, 1, Load()) for x in angle]
        )
        pushed_back = int(turning[0] < 0)  # at rest on its base
        block = max(block, pushed_back + int(((turning[:-1] > 0) & (turning[1:] <= 0)).sum()))
    return {
        "stable_of_cell": sum(p.stable for p in equilibria(constant_load())),
        "stable_of_block": block,
    }


def measure(data: Any) -> dict[str, Measured]:
    """Section 4."""
    r = scalars(data)
    n = int(data.attrs["impacts"])
    found = {
        "accjump": measured(r["jump_printed"], r["jump_corrected"]),
        "accjump-symmetric": measured(r["reduced_printed"], r["reduced_corrected"]),
        "accjump-always": measured(r["jump_vanishes"] > 1e-9, r["jump_vanishes"] < 1e-15),
        "accjump-ground": measured(r["jump_with_ground"]),
        "accjump-e-1": measured(abs(r["jump_e_1"]) > 1e-3),
        "energy-jump": measured(r["energy_of_motion"]),
        "energy-guarantee": measured(r["sign_still"] == 0 and r["gains_moving"] > 0),
        "both-factors": measured(
            r["spread_moving_e_1"] > 1e-3,
            r["spread_moving"] > 1e-3
            and r["spread_moving_e_1"] < 1e-12
            and r["spread_still"] < 1e-12,
            second=r["r_e_1_printed"],
        ),
        "multistable": measured(r["stable_of_cell"] == 3 and r["stable_of_block"] == 1),
        "restitution": measured(r["r_printed"], r["r_corrected"]),
        "restitution-still": measured(r["r_still"]),
        "restitution-decrease": measured(r["sign_printed"] == 0, r["sign_corrected"] == 0),
        "restitution-e-1": measured(r["change_at_e_1"], r["change_at_e_1"] > 1e-3),
        "restitution-solvable": measured(
            math.isfinite(r["root_slow"]),
            math.isnan(r["root_slow"]) and abs(r["restitution_fast"] - 0.6) < 1e-12,
        ),
        "restitution-closed-form": measured(
            r["inelastic"] > 1e-9, max(r["inelastic"], abs(r["outside"]))
        ),
        "restitution-range": measured(r["least_e"] <= 0, r["pushing"]),
    }
    return with_fields(r | {"impacts": n, "jumps": n // 4, "impacts_without_m": n // 2}, found)
