"""Orbits that rest for a part of their period: released by the load alone, reached from anywhere,
followed to where rest ends.
"""

import functools
import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from orbit_cases import FREQUENCY
from shared_systems import BETA80, forced, rocking, walled

from saltus import (
    EnergyRestitution,
    Harmonic,
    InelasticImpact,
    Load,
    Metainterface,
    System,
    continue_orbit,
    find_orbit,
    sensitivities,
    simulate,
    switch_branch,
)
from saltus.errors import MotionError
from saltus.flow import EventKind, contact_pull, load_releases
from saltus.orbits import Branch, OrbitEnd

# abs(V / tan(beta0)), from which on a horizontal load releases the mass from rest
HCR = 0.5 / math.tan(BETA80)
HHAT, ZETA, AMPLITUDE = (
    "load.horizontal.amplitude",
    "load.ground_horizontal.amplitude",
    "load.force.amplitude",
)


def energetic():
    """Unequal layers, whose impacts restitute a share of the energy; beta0 is small enough for slow
    impacts to be solvable.
    """
    return System(
        model=Metainterface(beta0=BETA80, damping=0.1, mass_ratio=0.2),
        load=Load(frequency=0.2, horizontal=Harmonic(amplitude=0.15), vertical=-0.5),
        impact=EnergyRestitution(0.3),
    )


def inelastic():
    """Layers that hit each other without friction and bounce: e = -cos(2 beta0) = 0.17."""
    return System(
        model=Metainterface(beta0=math.radians(50), damping=0.1),
        load=Load(frequency=0.2, horizontal=Harmonic(amplitude=0.6), vertical=-0.5),
        impact=InelasticImpact(),
    )


CASES = {  # system, start, forcing periods, rests in a period of the orbit, own mirror image
    "metainterface": (forced(H=0.15, W=0.2, e=0.3), {"theta": 0.3}, 1, 2, True),
    "no bounce": (forced(H=0.15, W=0.2, e=0.0), {"theta": 0.3}, 1, 2, True),
    "unequal layers, a mean load": (
        forced(H=0.15, mean=0.02, W=0.2, e=0.4, k=1.2, m=0.2, c=0.7),
        {"theta": 0.1},
        1,
        2,
        False,
    ),
    "released to one side": (forced(H=0.12, mean=0.1, W=0.2, e=0.4), {"theta": 0.1}, 1, 1, False),
    "restitution of energy": (energetic(), {"theta": 0.1}, 1, 2, False),
    "inelastic": (inelastic(), {"theta": 0.1}, 1, 2, True),
    "rocking block": (rocking(a=1.2, W=3.0, alpha=0.6), {"theta": 0.01}, 1, 2, True),
    "on the wall": (walled(A=0.8, W=0.5, wall=0.5, e=0.3), {"x": 0.2}, 1, 1, False),
    "on the wall, every other period": (
        walled(A=0.6, W=2.2, wall=0.2, e=0.05),
        {"x": 0.0},
        2,
        1,
        False,
    ),
    "on the wall, every sixth period": (
        walled(A=3.0, W=3.8, wall=-0.3, e=0.2),
        {"x": -0.5},
        6,
        1,
        False,
    ),
}


@functools.cache
def orbit_of(name):
    system, start, *_ = CASES[name]
    return find_orbit(system, **start)


@functools.cache
def family_of(name, path, bounds):
    return continue_orbit(orbit_of(name), path, bounds)


ELSEWHERE = ("restitution of energy", "inelastic", "rocking block")  # each compiles for itself


@pytest.fixture(
    params=[pytest.param(n, marks=[pytest.mark.thorough] * (n in ELSEWHERE)) for n in CASES]
)
def name(request):
    return request.param


def with_rests(family):
    """The orbits of a family that rest; beyond CH it goes on with orbits that do not."""
    return [orbit for orbit in family.orbits if orbit.releases.size]


def at_phase_zero(orbit):
    """The state at phase 0 as the arguments of a motion."""
    position, velocity = orbit.state
    return {orbit.system.model.coordinates[0]: position, "velocity": velocity}


def at_rests(branch):
    """The special points of the orbits that rest."""
    return [p for p in branch.special if p.orbit.signature.section is not None]


def only(branch, kind):
    """The one special point of a kind of the orbits that rest."""
    (point,) = [p for p in at_rests(branch) if p.kind == kind]
    return point


# --- releases ----------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(
    beta0=st.floats(0.3, 1.5),
    V=st.floats(-2.0, -0.1),
    beyond=st.floats(1e-6, 20.0),
    W=st.floats(0.01, 20.0),
)
def test_load_i_releases_where_it_passes_hcr(beta0, V, beyond, W):
    """sin(Omega t) = Hcr / Hhat on side +1, half a period later on side -1; the pull grows to (Hhat
    - Hcr) sin(beta0).
    """
    Hcr = abs(V / math.tan(beta0))
    H = Hcr * (1.0 + beyond)
    lower, upper = load_releases(forced(beta0=beta0, V=V, H=H, W=W))
    assert (lower.side, upper.side) == (1, -1)
    phase = math.asin(Hcr / H)
    slack = 1e-15 / math.cos(phase) + 1e-13  # the root of a parabola as its double root is neared
    assert W * lower.time == pytest.approx(phase, abs=slack)
    assert W * upper.time == pytest.approx(phase + math.pi, abs=slack)
    assert lower.peak == pytest.approx((H - Hcr) * math.sin(beta0), rel=1e-9, abs=1e-14)


@settings(deadline=None, max_examples=20)
@given(beta0=st.floats(0.3, 1.5), V=st.floats(-2.0, -0.1), share=st.floats(0.0, 0.999))
def test_no_release_below_hcr(beta0, V, share):
    assert load_releases(forced(beta0=beta0, V=V, H=share * abs(V / math.tan(beta0)))) == ()


@settings(deadline=None, max_examples=20)
@given(A=st.floats(0.6, 5.0), W=st.floats(0.1, 9.0))
def test_the_wall_lets_go_where_the_force_falls_below_its_spring(A, W):
    (release,) = load_releases(walled(A=A, W=W, wall=0.5))
    assert W * release.time == pytest.approx(math.acos(0.5 / A), abs=1e-12)
    assert release.peak == pytest.approx(A + 0.5, rel=1e-12)


def test_higher_harmonics_release_more_often_and_two_peaks_share_a_root():
    """Under sin(t) + sin(5 t) the load passes Hcr upwards as often as sampling finely shows, on
    each side.
    """
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=Load(
            frequency=1.0,
            horizontal=Harmonic(amplitude=0.2) + Harmonic(amplitude=0.2, order=5),
            vertical=-0.5,
        ),
    )
    t = np.linspace(0.0, 2.0 * math.pi, 200_001)
    found = load_releases(system)
    for side in (1, -1):
        beyond = side * (0.2 * np.sin(t) + 0.2 * np.sin(5 * t)) > HCR
        expected = t[1:][beyond[1:] & ~beyond[:-1]]
        assert [r.time for r in found if r.side == side] == pytest.approx(
            expected.tolist(), abs=1e-4
        )
        assert all(abs(contact_pull(system, side)(r.time)) < 1e-14 for r in found if r.side == side)


# --- orbits ------------------------------------------------------------------


def test_kind_of_each_orbit(name):
    _, _, periods, rests, symmetric = CASES[name]
    orbit = orbit_of(name)
    assert orbit.releases.size
    assert (orbit.period, len(orbit.releases), orbit.symmetric) == (periods, rests, symmetric)
    assert len(orbit.rests) == rests
    assert len(orbit.impact_times) == len(orbit.speeds) == orbit.impact_count
    assert 0.0 < orbit.rest_share < 1.0
    assert orbit.admissible
    assert not orbit.grazes
    assert orbit.stable


def test_its_impacts_solve_the_equations_of_smooth_segments(name):
    """Another integration than the one that found them: at each impact the next is met, with its
    speed.
    """
    orbit = orbit_of(name)
    assert orbit.residual < 1e-12  # in natural units, of which a speed is 0.2 at the wall
    assert orbit.defect < 1e-12


def test_motions_from_anywhere_become_it_and_stay_for_ever(name):
    """From another state the motion is the orbit's after 72 of its periods, at 64 instants; from
    the orbit still after 200.
    """
    system, start, *_ = CASES[name]
    orbit = orbit_of(name)
    (coordinate,) = start
    away = {
        coordinate: start[coordinate] - (0.05 if coordinate == "x" else 0.4 * start[coordinate]),
        "velocity": 0.0,
    }
    period = orbit.system.load.period
    times = orbit.start()["time"] + orbit.duration * (np.arange(64) + 0.5) / 64.0
    expected, distances = np.stack(orbit.motion().at(times)), []
    for turn in range(orbit.period):  # an orbit of q forcing periods may begin in any of them
        shift = (72 * orbit.period + turn) * period
        settled = simulate(
            system, **away, duration=shift + 2.0 * orbit.duration, times=shift + times
        ).kept
        found = np.stack([settled.position[0], settled.velocity[0]])
        distances.append(np.abs(found - expected).max())
    assert min(distances) < 1e-11
    for periods in (orbit.period, 200 * orbit.period):
        later = simulate(system, **at_phase_zero(orbit), periods=periods, tol=1e-13, dense=False)
        assert (later.position, later.velocity) == pytest.approx(orbit.state, abs=3e-13)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case[2] > 1])
def test_it_does_not_come_back_earlier(name):
    orbit = orbit_of(name)
    assert orbit.period > 1
    times = orbit.start()["time"] + orbit.duration * (np.arange(64) + 0.5) / 64.0
    motion = orbit.motion(2 * orbit.period)
    period = orbit.system.load.period
    for q in range(1, orbit.period):
        assert np.abs(motion.at(times + q * period)[0] - motion.at(times)[0]).max() > 1e-3


def test_the_derivative_of_the_flow_over_its_period_is_0(name):
    """The saltation of every impact, of rest and of release, from a state in flight: multipliers 0,
    exactly.
    """
    orbit = orbit_of(name)
    flying = orbit.releases[0] + 0.5 * (orbit.impact_times[0] - orbit.releases[0]) + orbit.duration
    position, velocity = orbit.motion(2 * orbit.period).at(flying)
    found = sensitivities(
        orbit.system,
        **{orbit.system.model.coordinates[0]: position},
        velocity=velocity,
        time=flying,
        periods=orbit.period,
    )
    assert found.undefined is None
    assert np.abs(found.state).max() == 0.0
    assert (orbit.multipliers == 0.0).all()


def test_it_is_released_where_the_load_alone_says(name):
    orbit = orbit_of(name)
    motion = orbit.motion(3 * orbit.period, tol=1e-14)
    events = [e for e in motion.events.of(EventKind.RELEASE) if e.time > motion.start + 1e-6]
    period, known = (
        orbit.system.load.period,
        {(r.side, r.time) for r in load_releases(orbit.system)},
    )
    assert len(events) >= 2 * len(orbit.releases)
    for event in events:
        turned = [
            abs((event.time - t + period / 2) % period - period / 2)
            for side, t in known
            if side == event.side
        ]
        assert min(turned) < 1e-13 * max(1.0, event.time)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case[-1]])
def test_a_symmetric_one_is_its_own_mirror_image_half_a_period_later(name):
    orbit = orbit_of(name)
    half = orbit.duration / 2
    motion = orbit.motion(2)
    times = motion.start + half * (np.arange(50) + 0.5) / 50
    assert np.abs(np.asarray(motion.at(times + half)) + np.asarray(motion.at(times))).max() < 1e-13
    assert orbit.releases[1] - orbit.releases[0] == pytest.approx(half, rel=1e-14)
    assert orbit.lowest == -orbit.highest
    second = (motion.impacts.time > orbit.releases[1]) & (
        motion.impacts.time < orbit.rests[1] + 1e-9
    )
    mirrored = orbit.impact_times[len(orbit.impact_times) // 2 :]
    assert motion.impacts.time[second][:3] == pytest.approx(mirrored[:3], rel=1e-13)


def test_without_bounce_it_rests_from_the_first_impact_under_pressure():
    """At e = 0 the motion starts anew from its impacts as well."""
    orbit = orbit_of("no bounce")
    assert orbit.rests == pytest.approx(orbit.impact_times, rel=1e-14)
    share = sum(
        n - r
        for r, n in zip(
            orbit.rests, [*orbit.releases[1:], orbit.releases[0] + orbit.duration], strict=True
        )
    )
    assert orbit.rest_share == pytest.approx(share / orbit.duration)


def test_extrema_and_margins_are_those_of_the_motion(name):
    orbit = orbit_of(name)
    motion = orbit.motion()
    times = np.linspace(motion.start, motion.time, 20_001)
    position, velocity = motion.at(times)
    fastest = np.abs(velocity).max() * (times[1] - times[0])
    assert position.max() <= orbit.highest + 1e-14
    assert position.min() >= orbit.lowest - 1e-14
    contact = float(orbit.system.model.contact)
    for extreme, reached in ((orbit.highest, position.max()), (orbit.lowest, position.min())):
        assert abs(extreme - reached) < fastest**2 + 1e-6
        assert (extreme > contact + 1e-9) == (reached > contact + 1e-9)
    assert orbit.validity.respected == all(least > 0.0 for least in orbit.margins.values())


# --- families ----------------------------------------------------------------


def test_shrinks_to_rest_at_hcr_like_the_square_of_what_is_beyond():
    """Released at a slope sqrt(2 b eps) it flies for a time of order sqrt(eps): theta ~ eps^2."""
    family = family_of("metainterface", HHAT, (0.05, 0.5))
    lost = only(family, "RL")
    assert lost.parameter == pytest.approx(HCR, abs=1e-12)
    assert family.ends[0].reason is OrbitEnd.NO_PULL
    beyond = np.array([2e-6, 5e-6, 1e-5, 2e-5])
    sizes = [family.at(HCR + share)[0].amplitude for share in beyond]
    slope = np.polyfit(np.log(beyond), np.log(sizes), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.05)
    with pytest.raises(MotionError, match="for good"):
        find_orbit(forced(H=HCR - 1e-6, W=0.2, e=0.3), theta=0.3)


def test_a_release_lost_on_one_side_and_born_on_it_is_the_same_point():
    """With a mean load the releases are lost one after the other, at Hcr + mean and at Hcr -
    mean.
    """
    both = family_of("unequal layers, a mean load", HHAT, (0.05, 0.25))
    assert [p.kind for p in both.special][:2] == ["RL", "RL"]
    assert [p.parameter for p in both.special][:2] == pytest.approx(
        [HCR - 0.02, HCR + 0.02], abs=1e-10
    )
    assert both.ends[0].reason is OrbitEnd.NO_PULL
    system = CASES["unequal layers, a mean load"][0].with_({HHAT: 0.09})
    one = continue_orbit(find_orbit(system, theta=0.1), HHAT, (0.03, 0.25))
    assert len(one.orbits[0].releases) == 1
    assert [p.kind for p in one.special][:2] == ["RL", "RL"]
    assert [p.parameter for p in one.special][:2] == pytest.approx(
        [HCR - 0.02, HCR + 0.02], abs=1e-10
    )
    # it goes on beyond the release that is born, and is then the same branch
    for value in (0.1, 0.15, 0.2):
        assert one.at(value)[0].amplitude == pytest.approx(both.at(value)[0].amplitude, abs=1e-12)


@pytest.mark.thorough
def test_a_symmetric_orbit_goes_on_where_the_symmetry_ends():
    """Along a mean load: as far either way, to where the releases of one side are lost, at Hhat -
    Hcr.
    """
    family = family_of("metainterface", "load.horizontal.mean", (-0.2, 0.2))
    assert [p.kind for p in family.special] == ["RL", "RL"]
    assert [p.parameter for p in family.special] == pytest.approx(
        [HCR - 0.15, 0.15 - HCR], abs=1e-10
    )
    assert not any(orbit.symmetric for orbit in family.orbits)
    for mean in (0.01, 0.05):
        (lower,), (upper,) = family.at(-mean), family.at(mean)
        assert lower.highest == pytest.approx(-upper.lowest, abs=1e-13)
        assert lower.amplitude != pytest.approx(orbit_of("metainterface").amplitude, abs=1e-4)


def test_ground_motion_releases_a_block_from_tan_alpha_on():
    """zeta Omega^2 = tan(alpha) (West's formula)."""
    family = family_of("rocking block", ZETA, (0.05, 0.2))
    assert only(family, "RL").parameter == pytest.approx(math.tan(0.6) / 9.0, abs=1e-12)


def test_rest_vanishes_where_impacts_no_longer_die_away():
    """CH: rest is there just before, not just after, where orbits of another family have many
    impacts.
    """
    family = family_of("metainterface", HHAT, (0.05, 0.5))
    point = only(family, "CH")
    assert point.evidence.bracket < 1e-10
    assert point.orbit.rest_durations.min() < 1e-6
    before = find_orbit(forced(H=point.parameter - 1e-6, W=0.2, e=0.3), theta=0.3)
    after = find_orbit(forced(H=point.parameter + 1e-5, W=0.2, e=0.3), theta=0.3)
    assert before.releases.size
    assert not after.releases.size
    assert after.signature.impact_count >= 12
    assert len(simulate(after.system, **after.start(), periods=5).events.of(EventKind.REST)) == 0
    assert after.amplitude == pytest.approx(point.amplitude, abs=1e-4)
    assert np.abs(after.multipliers).max() < 1e-3
    # beyond it another family begins, with orbits that do not rest
    assert family.ends[1].reason is OrbitEnd.REST_VANISHES
    (beyond,) = switch_branch(point, (0.05, 0.5))
    assert beyond.ends[1].parameter == 0.5


def test_the_orbits_beyond_gather_grazings_and_folds_towards_the_end():
    """The family without rest, followed back, grazes ever more often, and does not get past the
    point at which rest ends.
    """
    point = only(family_of("metainterface", HHAT, (0.05, 0.5)), "CH")
    beyond = continue_orbit(find_orbit(forced(H=0.34, W=0.2, e=0.3), theta=0.3), HHAT, (0.3, 0.345))
    grazings = [p.parameter for p in beyond.special if p.kind == "GR"]
    assert beyond.parameters.min() > point.parameter
    assert beyond.parameters.min() - point.parameter < 1e-5
    distances = np.sort(np.array(grazings) - point.parameter)
    assert len(distances) >= 3
    assert (distances[1:] > 3.0 * distances[:-1]).all()


def wall_flight(A, W, wall, start, velocity):
    """x(t) and x'(t) of x'' + x' / 10 + x = A cos(W t) from the wall, in closed form."""
    k, c = 1, mp.mpf("0.1")
    D = (k - W**2) ** 2 + (c * W) ** 2
    X, Y = A * (k - W**2) / D, A * c * W / D
    w = mp.sqrt(k - c**2 / 4)
    a = wall - X * mp.cos(W * start) - Y * mp.sin(W * start)
    b = (velocity + X * W * mp.sin(W * start) - Y * W * mp.cos(W * start) + c * a / 2) / w

    def position(t):
        s = t - start
        return (
            X * mp.cos(W * t)
            + Y * mp.sin(W * t)
            + mp.exp(-c * s / 2) * (a * mp.cos(w * s) + b * mp.sin(w * s))
        )

    def speed(t):
        s = t - start
        free = (b * w - c * a / 2) * mp.cos(w * s) - (a * w + c * b / 2) * mp.sin(w * s)
        return W * (Y * mp.cos(W * t) - X * mp.sin(W * t)) + mp.exp(-c * s / 2) * free

    return position, speed


OTHER = "on the wall, every other period"  # A = 0.6, W = 2.2, wall = 0.2, e = 0.05


def test_grazing_is_that_of_the_closed_form():
    """The flight from the release touches the wall a period later: x = d, x' = 0 for A and the
    time, with 40 digits.
    """
    point = only(family_of(OTHER, AMPLITUDE, (0.1, 3.0)), "GR")
    with mp.workdps(40):
        W, wall = mp.mpf("2.2"), mp.mpf("0.2")

        def touch(A, t):
            position, speed = wall_flight(A, W, wall, mp.acos(wall / A) / W, 0)
            return position(t) - wall, speed(t)

        guess = mp.mpf("0.606")
        position, _ = wall_flight(guess, W, wall, mp.acos(wall / guess) / W, 0)
        times = [mp.acos(wall / guess) / W + i * mp.mpf("0.01") for i in range(50, 500)]
        nearest = next(
            b
            for a, b, c in zip(times, times[1:], times[2:], strict=False)
            if position(a) < position(b) > position(c)
        )
        A, _ = mp.findroot(touch, (guess, nearest))
    assert point.parameter == pytest.approx(float(A), abs=1e-10)
    assert point.orbit.clearance < 1e-9


def test_the_end_of_rest_is_that_of_closed_form_flights():
    """Impact after impact with 30 digits: the force at which they just fail to die away before the
    wall lets go.
    """
    point = next(
        p
        for p in family_of(OTHER, AMPLITUDE, (0.1, 3.0)).special
        if p.kind == "CH" and p.parameter < 0.6
    )
    with mp.workdps(30):
        low, high = mp.mpf("0.58"), mp.mpf("0.59")
        assert not dies_away(low)
        assert dies_away(high)
        while high - low > 1e-12:
            middle = (low + high) / 2
            low, high = (low, middle) if dies_away(middle) else (middle, high)
    assert point.parameter == pytest.approx(float(low), abs=2e-12)


def dies_away(A):
    """Whether the impacts after a release die away before the next but one."""
    W, wall, e = mp.mpf("2.2"), mp.mpf("0.2"), mp.mpf("0.05")
    begin, velocity = mp.acos(wall / A) / W, mp.mpf(0)
    end, t = begin + 4 * mp.pi / W, begin
    while True:
        pressing = A * mp.cos(W * t) - wall
        left = 2 * velocity / (pressing * (1 - e)) if t > begin and pressing > 0 else mp.inf
        if abs(left) < 1e-2 * (end - t) and abs(velocity) < 1e-4 and end - t < 1:
            return True
        position, speed = wall_flight(A, W, wall, t, -velocity)
        step = (
            min(mp.mpf("0.05"), 2 * velocity / pressing / 8)
            if t > begin and pressing > 0 and velocity > 0
            else mp.mpf("0.05")
        )
        there = t + step
        while position(there) < wall:
            there += step
            if there > end:
                return False
        t = mp.findroot(lambda s, x=position: x(s) - wall, (there - step, there), solver="anderson")
        velocity = e * speed(t)


def test_the_wall_may_be_scaled_instead_of_the_force():
    """The oscillator is linear: every special point in A / d is one in d, found along another
    path.
    """
    force, wall = (
        family_of(OTHER, AMPLITUDE, (0.1, 3.0)),
        family_of(OTHER, "model.wall", (0.1, 0.5)),
    )
    assert [p.kind for p in at_rests(force)] == ["CH", "GR", "CH"]
    assert [p.kind for p in at_rests(wall)] == ["CH", "GR", "CH"]
    by_force = sorted(p.parameter / 0.2 for p in at_rests(force))
    by_wall = sorted(0.6 / p.parameter for p in at_rests(wall))
    assert by_force == pytest.approx(by_wall, abs=2e-10)


def test_a_family_goes_through_grazings_without_a_leap():
    family = family_of(OTHER, FREQUENCY, (1.5, 3.0))
    assert isinstance(family, Branch)
    grazing = only(family, "GR")
    resting = with_rests(family)
    below = [orbit.frequency < grazing.parameter for orbit in resting]
    i = below.index(False)
    assert resting[i + 1].counted_impacts != resting[i - 1].counted_impacts
    assert np.abs(np.diff([orbit.amplitude for orbit in resting])).max() < 0.1


@pytest.mark.parametrize(
    ("name", "path", "bounds"),
    [
        ("metainterface", HHAT, (0.05, 0.5)),
        ("metainterface", FREQUENCY, (0.05, 1.0)),
        (OTHER, FREQUENCY, (1.5, 3.0)),
    ],
)
def test_every_orbit_of_a_family_is_a_motion(name, path, bounds):
    family = family_of(name, path, bounds)
    resting = with_rests(family)
    assert len(resting) > 10
    assert (np.diff([orbit.system.get(path) for orbit in resting]) >= 0.0).all()
    assert all(orbit.stable for orbit in resting[1:-1] if not orbit.grazes)
    for orbit in with_rests(family)[::4]:
        assert orbit.residual < 1e-12
        assert orbit.defect < 1e-12


def test_a_family_ends_at_its_bounds_and_solves_between_its_points():
    family = family_of("on the wall", AMPLITUDE, (0.78, 1.0))
    assert [str(end) for end in family.ends] == ["bound 0.78", "bound 1"]
    assert not family.special
    (orbit,) = family.at(0.8)
    assert orbit.amplitude == pytest.approx(orbit_of("on the wall").amplitude, abs=1e-13)
    assert family.at(1.2) == []


@pytest.mark.thorough
def test_the_energy_restituted_is_continued_too():
    family = continue_orbit(orbit_of("restitution of energy"), "impact.r", (0.25, 0.35))
    assert [str(end) for end in family.ends] == ["bound 0.25", "bound 0.35"]
    # the longer impacts last, the shorter the rest
    assert (np.diff([orbit.rest_share for orbit in family.orbits]) < 0.0).all()


def test_margins_and_functions_are_located():
    family = continue_orbit(
        orbit_of("on the wall"),
        AMPLITUDE,
        (0.78, 1.0),
        functions={"wide": lambda orbit: orbit.amplitude - 1.5},
    )
    (point,) = family.special
    assert point.kind == "wide"
    assert point.amplitude == pytest.approx(1.5, abs=1e-10)
    assert point.defect < 1e-12


def test_a_family_as_a_dataset():
    family = family_of(OTHER, AMPLITUDE, (0.1, 3.0))
    data = family.to_xarray()
    assert data["parameter"].values == pytest.approx(family.parameters)
    assert data["releases"].shape == data["rests"].shape == (len(family.points), 1)
    assert (data["rest_share"].values >= 0.0).all()
    assert np.isfinite(data["releases"].values[:, 0]).sum() == len(with_rests(family))
    assert sorted(data["kind"].values).count("CH") == 2
    assert data.attrs["ends"] == list(map(str, family.ends))
    assert data.attrs["end_reasons"] == [end.reason.code for end in family.ends]


# --- refusals ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "start", "sentence"),
    [
        (
            forced(H=0.05, W=0.2, e=0.5),
            0.01,
            "rest at contact for good, as the load never pulls it off",
        ),
        (forced(H=0.05, W=0.2), 0.01, "impacts lose no energy and become ever smaller"),
        (forced(H=0.09, W=0.01, C=1.0), 0.01, "its phase is lost; give the impacts a loss"),
    ],
)
def test_what_is_no_orbit_is_refused_with_the_true_reason(system, start, sentence):
    with pytest.raises(MotionError, match=sentence):
        find_orbit(system, theta=start)


def test_the_loss_that_the_refusal_asks_for_gives_an_orbit():
    orbit = find_orbit(forced(H=0.09, W=0.01, C=1.0, e=0.9), theta=0.01)
    assert orbit.rest_share > 0.5


@pytest.mark.parametrize(
    ("beta0", "H", "W", "theta", "velocity"),
    [(0.5, 1.0, 2.0, 0.0, 1.0), (1.0, 0.5, 3.0, -1.8218389092393839, 0.0)],
)
def test_what_rests_for_good_and_what_lies_beyond_its_contact_is_no_orbit(
    beta0, H, W, theta, velocity
):
    """Newton's method finds rest; once it found theta = -beta0, where only the other side has an
    equilibrium.
    """
    system = forced(beta0=beta0, C=0.5, V=-1.0, H=H, W=W, e=0.5)
    with pytest.raises(MotionError, match=r"comes to rest .* start elsewhere"):
        find_orbit(system, theta=theta, velocity=velocity, settle=0, period=2)
