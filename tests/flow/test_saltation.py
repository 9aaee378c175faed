"""The determinant of the flow's derivative is the product of its saltations and of its damping, on
10^4 random motions.

det Phi = prod(R_v v+ / v-) exp(-C [c T_lower / (1+m) + T_upper]), R the law of the impact
(numerics.md, section 5).
"""

import math

import numpy as np
import pytest
from shared_systems import paired

import saltus
from saltus import InelasticImpact
from saltus.errors import MotionError
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)

DURATION = 6.0


def side_times(motion):
    """The time spent on each side, from the impacts alone."""
    bounds = np.concatenate([[0.0], motion.impacts.time, [motion.time]])
    sides = np.append(motion.impacts.side, motion.side)
    return {s: np.diff(bounds)[sides == s].sum() for s in (1, -1)}


def energy_slope(system, t, v, side):
    """dT/dv at contact: T is a quadratic in v, so that this difference is exact."""
    energy = [
        float(system.model.kinetic_energy(t, system.model.contact, w, side, system.load))
        for w in (v + 1.0, v - 1.0)
    ]
    return (energy[0] - energy[1]) / 2


def impact_slope(system, t, side, before, after):
    """R_v: e, the closed form's factor, or from T+(v+) = r T-(v-) the ratio r T-'(v-) / T+'(v+)."""
    impact, turned = system.impact, side if len(system.model.sides) == 1 else -side
    if isinstance(impact, VelocityReduction):
        return impact.e
    if isinstance(impact, EnergyRestitution):
        forward = abs(after) * np.sign(before)
        return (
            impact.r
            * energy_slope(system, t, before, side)
            / energy_slope(system, t, forward, turned)
        )
    if isinstance(system.model, RockingBlock):
        return 1.0 - 1.5 * math.sin(system.model.alpha) ** 2
    factor = max(-math.cos(2 * system.model.beta0), 0.0)
    return factor if side > 0 else factor / (1 + system.model.mass_ratio)


def damping_integral(system, motion):
    """The integral of minus the trace of the equations of motion."""
    model = system.model
    if isinstance(model, RockingBlock):
        return 0.0
    if isinstance(model, WallOscillator):
        return model.damping * motion.time
    spent = side_times(motion)
    return model.damping * (model.dissipation_ratio * spent[1] / (1 + model.mass_ratio) + spent[-1])


def law(system, motion):
    """The determinant, from the impacts and the times spent on each side."""
    impacts = motion.impacts
    rows = zip(
        impacts.time, impacts.side, impacts.velocity_before, impacts.velocity_after, strict=True
    )
    factors = [
        impact_slope(system, t, int(s), before, after) * abs(after / before)
        for t, s, before, after in rows
    ]
    return math.prod(factors) * math.exp(-damping_integral(system, motion))


def metainterface(rng, impact):
    """All of m, k, c, every load channel, both signs of V."""
    load = Load(
        frequency=rng.uniform(0.6, 2.0),
        horizontal=Harmonic(rng.uniform(0.0, 0.8), phase=rng.uniform(0.0, 6.0)),
        vertical=Harmonic(mean=rng.uniform(-0.8, 0.3), amplitude=rng.uniform(0.0, 0.2)),
        lower_horizontal=rng.uniform(-0.1, 0.1),
        lower_vertical=Harmonic(
            mean=rng.uniform(-0.2, 0.0), amplitude=rng.uniform(0.0, 0.1), order=2
        ),
        ground_horizontal=Harmonic(rng.uniform(0.0, 0.05)),
        ground_vertical=Harmonic(rng.uniform(0.0, 0.02), phase=rng.uniform(0.0, 6.0)),
    )
    model = Metainterface(
        beta0=rng.uniform(0.9, 2.2),
        damping=rng.uniform(0.0, 0.3),
        mass_ratio=rng.uniform(0.0, 1.0),
        stiffness_ratio=rng.uniform(0.5, 2.0),
        dissipation_ratio=rng.uniform(0.0, 2.0),
    )
    return System(model=model, load=load, impact=impact), {
        "theta": rng.choice([-1, 1]) * rng.uniform(0.2, 1.0)
    }


def rocking_block(rng, impact):
    ground = {
        name: Harmonic(rng.uniform(0.0, 0.05), phase=rng.uniform(0.0, 6.0))
        for name in RockingBlock.channels
    }
    load = Load(frequency=rng.uniform(0.6, 2.0), **ground)
    alpha = rng.uniform(0.1, 0.35)  # slender enough to rock on
    return System(model=RockingBlock(alpha=alpha), load=load, impact=impact), {
        "theta": rng.uniform(-0.6, 0.6) * alpha
    }


def wall_oscillator(rng, impact):
    model = WallOscillator(
        stiffness=rng.uniform(0.0, 2.0), damping=rng.uniform(0.0, 0.3), wall=rng.uniform(-0.2, 0.4)
    )
    load = Load(
        frequency=rng.uniform(0.6, 2.0),
        force=Harmonic(rng.uniform(0.2, 0.9), phase=rng.uniform(0.0, 6.0), mean=0.2),
    )
    return System(model=model, load=load, impact=impact), {"x": model.wall - rng.uniform(0.1, 1.0)}


CASES = {
    "metainterface, e": (
        metainterface,
        lambda rng: VelocityReduction(rng.choice([1.0, rng.uniform(0.5, 1.0)])),
        3000,
    ),
    "metainterface, r": (metainterface, lambda rng: EnergyRestitution(rng.uniform(0.6, 1.0)), 2000),
    "metainterface, inelastic": (metainterface, lambda rng: InelasticImpact(), 1500),
    "block, e": (
        rocking_block,
        lambda rng: VelocityReduction(rng.choice([1.0, rng.uniform(0.5, 1.0)])),
        1000,
    ),
    "block, inelastic": (rocking_block, lambda rng: InelasticImpact(), 1000),
    "wall, e": (
        wall_oscillator,
        lambda rng: VelocityReduction(rng.choice([1.0, rng.uniform(0.5, 1.0)])),
        1500,
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
def test_the_determinant_is_the_product_of_the_saltations_and_of_the_damping(name):
    build, impact, count = CASES[name]
    rng, used, with_impacts, refused = np.random.default_rng(len(name)), 0, 0, 0
    for _ in range(count):
        system, start = build(rng, impact(rng))
        speed = rng.uniform(-0.7, 0.7) * (0.2 if build is rocking_block else 1.0)
        try:
            result = saltus.sensitivities(
                system, **start, velocity=speed, duration=DURATION, tol=1e-14, dense=False
            )
        except MotionError:  # errata 26: no velocity after the impact
            refused += 1
            continue
        motion = result.motion
        # rest, or the block overturned: its tests are elsewhere
        if any(event.kind != "impact" for event in motion.events):
            continue
        assert result.undefined is None
        assert result.determinant == pytest.approx(law(system, motion), rel=0, abs=1e-10), (
            system,
            start,
            speed,
        )
        used, with_impacts = used + 1, with_impacts + (len(motion.impacts) > 0)
    assert used > 0.6 * count, used
    assert with_impacts > 0.5 * count, with_impacts
    assert refused < 0.05 * count


def trace_integral(system, motion):
    """The integral of the trace, by differences (quadratic in the velocities, so exact) and Gauss's
    rule.
    """
    nodes, weights = np.polynomial.legendre.leggauss(40)
    times = motion.time * (nodes + 1) / 2
    position, velocity = motion.at(times)
    total = np.zeros_like(times)
    for i in (0, 1):
        ahead, behind = (velocity + s * np.eye(2)[i][:, None] for s in (1, -1))
        a, b = (
            system.model.acceleration(times, position, v, 1, system.load)[i]
            for v in (ahead, behind)
        )
        total += (a - b) / 2
    return motion.time / 2 * weights @ total


@pytest.mark.thorough
def test_two_coordinates_obey_liouville():
    rng = np.random.default_rng(4)
    for _ in range(30):
        system = paired(rng.uniform(0.0, 1.0), rng.uniform(0.6, 2.0), damping=rng.uniform(0.0, 0.3))
        start = {"x": rng.normal(), "y": rng.normal(), "velocity": tuple(rng.normal(size=2))}
        result = saltus.sensitivities(system, **start, duration=3.0, tol=1e-14)
        expected = math.exp(trace_integral(result.motion.system, result.motion))
        assert result.determinant == pytest.approx(expected, rel=0, abs=1e-10)
