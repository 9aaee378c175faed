"""10^4 random systems and states: no penetration, every impact a root, the jump law exact, always
an end.
"""

import math
import time

import numpy as np
import pytest
from flow_references import evaluate_steps
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from saltus.errors import MotionError
from saltus.flow import EventKind, Stop, simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    System,
    VelocityReduction,
)

CHUNKS, CHUNK = 10, 1000
SLOWEST = 20.0  # seconds: a motion that takes longer hangs


def system(*, beta0, C, k, m, c, W, H, phase, mean, V, V_wave, lower, zeta, nu, impact):
    """Every channel carries something; all these systems share one structure for each impact
    law.
    """
    return System(
        model=Metainterface(
            beta0=beta0, damping=C, stiffness_ratio=k, mass_ratio=m, dissipation_ratio=c
        ),
        load=Load(
            frequency=W,
            horizontal=Harmonic(amplitude=H, mean=mean, phase=phase),
            vertical=Harmonic(amplitude=V_wave, mean=V, phase=1.0),
            lower_horizontal=lower,
            ground_horizontal=Harmonic(amplitude=zeta / W**2),
            ground_vertical=Harmonic(amplitude=nu / W**2, phase=0.5),
        ),
        impact=impact,
    )


def random_system(rng):
    """Half of the numbers at the values that make things meet: symmetric layers, no damping, no
    loss, no load.
    """

    def sometimes(value, other):
        return value if rng.random() < 0.5 else other

    return system(
        beta0=rng.uniform(0.15, 3.0),
        C=sometimes(0.0, rng.uniform(0.0, 1.0)),
        k=sometimes(1.0, rng.uniform(0.2, 3.0)),
        m=sometimes(0.0, rng.uniform(0.0, 3.0)),
        c=sometimes(1.0, rng.uniform(0.0, 3.0)),
        W=10 ** rng.uniform(-1.0, 0.6),
        H=sometimes(0.0, rng.uniform(-2.0, 2.0)),
        phase=sometimes(0.0, rng.uniform(-3.0, 3.0)),
        mean=sometimes(0.0, 0.2 * rng.normal()),
        V=rng.choice([-1.0, -1.0, 1.0]) * sometimes(0.5, 10 ** rng.uniform(-2.0, 0.5)),
        V_wave=sometimes(0.0, rng.uniform(0.0, 0.5)),
        lower=sometimes(0.0, 0.3 * rng.normal()),
        zeta=sometimes(0.0, rng.uniform(0.0, 0.5)),
        nu=sometimes(0.0, rng.uniform(0.0, 0.3)),
        impact=VelocityReduction(rng.choice([1.0, 0.0, 0.8, rng.uniform(0.0, 0.99)])),
    )


def random_state(rng):
    theta = rng.choice(
        [0.0, 1e-3 * rng.normal(), 0.5 * rng.normal(), 2.0 * rng.normal()], p=[0.2, 0.1, 0.5, 0.2]
    )
    return float(theta), float(rng.choice([0.0, 1e-3 * rng.normal(), rng.normal()]))


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """So that no motion below is charged for the compilation."""
    for impact in (VelocityReduction(1.0), EnergyRestitution(1.0)):
        simulate(
            random_system(np.random.default_rng(0)).with_({"impact": impact}),
            theta=0.1,
            velocity=0.0,
            duration=0.1,
        )


def check(motion):
    """What every motion must keep. Returns the number of its impacts."""
    dense, crossings = motion.dense, motion.impacts
    assert np.isfinite([motion.theta, motion.velocity]).all()
    size = max(1.0, np.abs(dense.series[:, 0, 0]).max())
    assert (dense.side[:, None] * evaluate_steps(dense)).min() >= -1e-13 * size, "penetration"
    assert not evaluate_steps(dense)[dense.side == 0].any()
    # the step that an impact ends
    before = np.searchsorted(dense.start, crossings.time, side="left") - 1
    if (before >= 0).all() and len(crossings):
        tau = crossings.time - dense.start[before]
        powers = tau[:, None] ** np.arange(dense.series.shape[2])
        theta = (dense.series[before, 0] * powers).sum(axis=1)
        assert (
            np.abs(theta) <= 1e-13 * np.maximum(size, np.abs(crossings.velocity_before))
        ).all(), "an impact that is no root"
    assert (crossings.velocity_before * crossings.side < 0).all()
    assert (crossings.velocity_after * crossings.side <= 0).all()
    assert (np.diff(crossings.time) >= 0).all()
    # an accumulation ends a little after its last impact
    assert (np.diff([e.time for e in motion.events]) >= -1e-5).all()
    if motion.stop is Stop.REST:
        assert motion.theta == motion.velocity == 0.0
    return len(crossings)


def run(chosen, theta, velocity, duration, tol):
    """The motion, or None where it is not unique: at contact at rest, with both sides pointing
    outward.
    """
    start = time.process_time()
    try:
        motion = simulate(chosen, theta=theta, velocity=velocity, duration=duration, tol=tol)
    except MotionError as error:
        if "not unique" not in str(error):
            raise
        return None
    assert time.process_time() - start < SLOWEST
    assert motion.time == pytest.approx(duration, rel=1e-12)
    return motion


@pytest.mark.parametrize(
    "chunk", [0, *(pytest.param(i, marks=pytest.mark.thorough) for i in range(1, CHUNKS))]
)
def test_10000_random_motions_never_penetrate_and_obey_the_law_at_every_root(chunk):
    rng, impacts, refused, kinds = np.random.default_rng(100 + chunk), 0, 0, set()
    for _ in range(CHUNK):
        chosen, (theta, velocity) = random_system(rng), random_state(rng)
        motion = run(
            chosen, theta, velocity, rng.uniform(2.0, 8.0), rng.choice([1e-12, 1e-13, 1e-15])
        )
        if motion is None:
            refused += 1
            continue
        impacts += check(motion)
        np.testing.assert_array_equal(
            motion.impacts.velocity_after, chosen.impact.e * motion.impacts.velocity_before
        )
        kinds |= {e.kind for e in motion.events}
    assert refused < 0.08 * CHUNK, f"{refused} of {CHUNK} refused as not unique"
    assert impacts > 2 * CHUNK
    assert kinds >= {EventKind.IMPACT, EventKind.REST, EventKind.RELEASE}


def test_random_motions_with_an_energy_restitution_keep_its_energy_at_every_impact():
    rng, impacts = np.random.default_rng(7), 0
    for _ in range(600):
        chosen = random_system(rng).with_(
            {"impact": EnergyRestitution(float(rng.choice([1.0, rng.uniform(0.1, 1.0)])))}
        )
        chosen = chosen.with_(
            {"load.ground_horizontal.amplitude": 0.0, "load.ground_vertical.amplitude": 0.0}
        )
        motion = run(chosen, *random_state(rng), rng.uniform(2.0, 6.0), 1e-13)
        if motion is None:
            continue
        impacts += check(motion)
        c, lower = motion.impacts, 1 + chosen.model.mass_ratio * (1 + motion.impacts.side) / 2
        upper = 1 + chosen.model.mass_ratio * (1 - c.side) / 2
        np.testing.assert_allclose(
            upper * c.velocity_after**2, chosen.impact.r * lower * c.velocity_before**2, rtol=1e-13
        )
    assert impacts > 1000


def decades(low, high):
    return st.one_of(
        st.just(0.0),
        st.floats(low, high).map(lambda x: 10.0**x),
        st.floats(low, high).map(lambda x: -(10.0**x)),
    )


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    beta0=st.floats(0.05, math.pi - 0.05),
    e=st.sampled_from([0.0, 1e-9, 0.3, 0.8, 0.99, 1.0]),
    V=decades(-9, 2),
    H=decades(-9, 2),
    mean=decades(-9, 2),
    theta=decades(-12, 0.5),
    velocity=decades(-12, 1),
    m=st.sampled_from([0.0, 1e-6, 1.0, 50.0]),
    W=st.floats(-2, 1).map(lambda x: 10.0**x),
)
def test_motions_over_many_decades_of_every_number_keep_the_same_rules(
    beta0, e, V, H, mean, theta, velocity, m, W
):
    chosen = system(
        beta0=beta0, C=0.2, k=1.0, m=m, c=1.0, W=W, H=H, phase=0.0, mean=mean, V=V, V_wave=0.0, lower=0.0, zeta=0.0, nu=0.0,
        impact=VelocityReduction(e),
    )  # fmt: skip
    motion = run(chosen, theta, velocity, 1.0, 1e-13)
    if motion is not None:
        check(motion)
