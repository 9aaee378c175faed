"""Both layers as they really move: two coordinates, two contacts."""

import math

import numpy as np
import pytest
from contact_reference import follow

import saltus
from saltus import NewtonImpact, TwoLayer, TwoStops
from saltus.errors import MotionError, ParameterError
from saltus.flow import EventKind
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction, energy_gain

BETA80 = math.radians(80)


def layers(*, e=(0.0, 0.0), transfer=0.0, V=-0.5, H=0.0, W=1.0, ground=0.0, **numbers):
    return System(
        model=TwoLayer(**{"beta0": BETA80} | numbers),
        load=Load(
            frequency=W,
            vertical=V,
            horizontal=Harmonic(amplitude=H),
            ground_horizontal=Harmonic(amplitude=ground),
        ),
        impact=NewtonImpact(e=e, transfer=transfer),
    )


def moved(system, x, v, duration, tol=1e-12):
    return saltus.simulate(
        system, theta=(x[0], -x[1]), velocity=(v[0], -v[1]), duration=duration, tol=tol
    )


def openings(motion):
    (theta, velocity) = motion.position, motion.velocity
    return np.array([theta[0], -theta[1], velocity[0], -velocity[1]])


def random_case(i):
    """A system and a state of which something is asked at random; the seed is the case's number."""
    rng = np.random.default_rng(i)
    e = rng.uniform(0, 0.9, 2) * (rng.random(2) < 0.7)
    # in every fourth case e up to 1, or 1
    extreme = np.random.default_rng([i, 1]).uniform(0, 1, (2, 2))
    if i % 4 == 1:
        e = np.where(extreme[0] < 0.3, 1.0, extreme[1])
    system = layers(
        e=tuple(e),
        V=rng.uniform(-1.5, 0.3),
        H=rng.uniform(0, 1.0),
        W=rng.uniform(0.3, 3.0),
        ground=rng.uniform(0, 0.2),
        beta0=math.radians(rng.uniform(20, 160)),
        mass_ratio=10 ** rng.uniform(-3, 1),
        damping=rng.uniform(0, 0.3),
        stiffness_ratio=rng.uniform(0.3, 2.0),
        dissipation_ratio=rng.uniform(0, 2.0),
    )
    x = rng.uniform(0.02, 0.6, 2) * (rng.random(2) < 0.7)
    v = np.where(x > 0, rng.uniform(-0.5, 0.5, 2), 0.0)
    return system, x, v


REFERENCES = {
    "one layer closed, all energy kept": (layers(transfer=1.0), (0.15, 0.0), (0.0, 0.0), 10.0),
    "the closed layer is let go": (
        layers(transfer=1.0, H=0.5, damping=0.1),
        (0.1, 0.0),
        (0.0, 0.0),
        20.0,
    ),
    "both bounce": (layers(e=(0.5, 0.5), mass_ratio=1.0), (0.3, 0.4), (0.0, 0.6), 6.0),
    "heavy lower mass under a moving ground": (
        layers(
            e=(0.3, 0.6), mass_ratio=4.0, ground=0.2, H=0.4, W=1.7, damping=0.1, stiffness_ratio=0.6
        ),
        (0.2, 0.3),
        (0.1, 0.0),
        12.0,
    ),
}


@pytest.mark.parametrize("name", REFERENCES)
def test_motions_are_those_of_an_independent_event_driven_integrator(name):
    system, x, v, duration = REFERENCES[name]
    motion = moved(system, x, v, duration)
    expected_x, expected_v, events = follow(system, x, v, duration)
    found = [
        (str(e.kind), e.contact, e.time)
        for e in motion.events
        if e.kind in (EventKind.IMPACT, EventKind.RELEASE)
    ]
    assert [(kind, {"lower": 0, "upper": 1}[contact]) for kind, contact, _ in found] == [
        event[:2] for event in events
    ]
    np.testing.assert_allclose([t for *_, t in found], [t for *_, t in events], rtol=0, atol=2e-9)
    np.testing.assert_allclose(openings(motion), [*expected_x, *expected_v], rtol=0, atol=2e-8)


def test_the_error_falls_with_tol_at_every_decade():
    system, x, v, duration = REFERENCES["heavy lower mass under a moving ground"]
    exact = openings(moved(system, x, v, duration, tol=1e-15))
    errors = [
        np.abs(openings(moved(system, x, v, duration, tol=10.0**-k)) - exact).max()
        for k in range(6, 14)
    ]
    assert all(
        error < 10.0 ** (1 - k) * 30 for error, k in zip(errors, range(6, 14), strict=True)
    ), errors


def test_where_the_other_layer_stays_closed_the_motion_is_the_reduced_one():
    """At V = -0.5 and small loads the reaction never vanishes: then the layers cross as the one
    angle does, both ways.
    """
    full = layers(transfer=0.95, H=0.1, damping=0.1, mass_ratio=0.0)
    reduced = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=full.load,
        impact=VelocityReduction(0.95),
    )
    times = np.linspace(0.0, 40.0, 400)
    both = moved(full, (0.12, 0.0), (0.0, 0.0), 40.0, tol=1e-14)
    one = saltus.simulate(reduced, theta=0.12, duration=40.0, tol=1e-14)
    assert one.validity.respected
    theta = both.at(times)[0]
    np.testing.assert_allclose(theta[0] + theta[1], one.at(times)[0], rtol=0, atol=1e-13)
    np.testing.assert_array_equal(theta[0] * theta[1], 0.0)
    assert len(both.impacts) == len(one.impacts)


def test_the_mirror_exchanges_the_layers():
    """For m = 0, k = c = 1 the layers have the same equations with the horizontal load turned
    round.
    """
    rng = np.random.default_rng(3)
    for _ in range(10):
        x, v = rng.uniform(0.05, 0.2, 2) * (1, 0), np.array([rng.uniform(-0.1, 0.1), 0.0])
        H, e = rng.uniform(0.0, 0.3), float(rng.uniform(0, 0.9))
        ahead = moved(layers(e=(e, e), H=H, damping=0.1), x, v, 15.0, tol=1e-14)
        back = moved(layers(e=(e, e), H=-H, damping=0.1), x[::-1], v[::-1], 15.0, tol=1e-14)
        assert ahead.stop == back.stop
        np.testing.assert_allclose(
            openings(ahead), openings(back)[[1, 0, 3, 2]], rtol=0, atol=1e-12
        )


def test_energy_is_kept_without_damping_and_with_lossless_impacts():
    """T + (k x1^2 + x2^2) / 2 - V (vertical displacement) under a constant vertical load, e = 1, C
    = 0.
    """
    system = layers(e=(1.0, 1.0), mass_ratio=0.7, stiffness_ratio=0.8)
    model = system.model

    def energy(theta, velocity):
        kinetic = model.kinetic_energy(0.0, theta, velocity, 1, system.load)
        height = np.sin(model.beta0 + theta[0]) + np.sin(model.beta0 - theta[1])
        return kinetic + model.potential_energy(theta) + 0.5 * height

    motion = moved(system, (0.3, 0.4), (0.0, 0.2), 30.0, tol=1e-14)
    assert len(motion.impacts) > 10
    theta, velocity = motion.at(np.linspace(0.0, 30.0, 500))
    values = energy(theta, velocity)
    np.testing.assert_allclose(values, values[0], rtol=0, atol=1e-12)


def check_case(i):
    """No penetration, no pulling contact, momentum and dissipation at every impact of a random
    case.
    """
    system, x, v = random_case(i)
    motion = moved(system, x, v, 10.0, tol=1e-10)
    times = np.sort(np.random.default_rng(i).uniform(0.0, motion.time, 60))
    theta, velocity = motion.at(times)
    opening, closed = (
        np.array([theta[0], -theta[1]]),
        motion.to_xarray(times).closed_contacts.values,
    )
    assert opening.min() >= 0.0
    for place in (0, 1):
        held = closed >> place & 1 == 1
        assert not opening[place, held].any()
        acceleration = accelerations(motion, times)
        reaction = system.model.constraint_reactions(
            times, theta, velocity, acceleration, system.load
        )
        assert (reaction[place][held] * (1, -1)[place]).min(initial=0.0) >= -1e-12
    for event in motion.events.of(EventKind.IMPACT)[:60]:
        # just before it: an accumulation may follow at once, in which all of its gaps count as 0
        place = motion.at(np.nextafter(event.time, -math.inf))[0]
        mass = system.model.mass_matrix((place[0], place[1]))
        before, after = np.array(event.velocity_before), np.array(event.velocity_after)
        impulse, signs = np.array(event.impulse), np.array([1.0, -1.0])
        assert impulse.min() >= 0.0
        np.testing.assert_allclose(
            mass @ (after - before), signs * impulse, rtol=0, atol=1e-12 * (1 + np.abs(mass).max())
        )
        lost = (before @ mass @ before - after @ mass @ after) / 2
        by_law = -np.sum(impulse * (1 - np.array(system.impact.e)) * signs * before) / 2
        assert lost == pytest.approx(by_law, abs=1e-12 * (1 + np.abs(mass).max()))
    return len(motion.impacts)


def accelerations(motion, times):
    """The second derivatives of the dense output."""
    steps = motion.dense
    index = np.clip(np.searchsorted(steps.start, times, side="right") - 1, 0, None)
    powers = np.arange(steps.series.shape[2])
    series = (steps.series[index] * powers * (powers - 1))[:, :, 2:]
    tau = (times - steps.start[index])[:, None, None] ** np.arange(series.shape[2])
    return (series * tau).sum(axis=2).T


def test_random_motions_are_complementary_and_keep_the_balances():
    """In case 1943 an accumulation on both contacts follows on an impact while the other gap is
    1e-8.
    """
    assert sum(check_case(i) > 0 for i in range(60)) > 40
    assert check_case(1943) > 5


@pytest.mark.thorough
def test_ten_thousand_random_motions_are_complementary_and_keep_the_balances():
    """But for the few that bounce without loss on a contact which is pressed ever harder: these are
    refused by its name.
    """
    impacts, refusals = 0, {}
    for i in range(10_000):
        try:
            impacts += check_case(i) > 0
        except MotionError as error:
            refusals[i] = str(error)
    assert impacts > 6000
    assert len(refusals) < 150
    assert all("(e = 1)" in text and i % 4 == 1 for i, text in refusals.items()), refusals


def test_an_accumulation_on_each_layer_within_one_on_both_comes_to_rest_when_all_of_it_is_over():
    """Each layer bounces to rest while the other one is in the air, and again: case 510.

    Asked twice, from two instants of it.
    """
    system, x, v = random_case(510)
    whole = moved(system, x, v, 7.0, tol=1e-12)
    rest = next(event.time for event in whole.events if event.kind == EventKind.REST)
    part = moved(system, x, v, rest - 5e-6, tol=1e-12)
    assert len(part.impacts) > 400
    rest_of_it = saltus.simulate(
        system, theta=part.position, velocity=part.velocity, time=part.time, duration=1.0, tol=1e-14
    )
    assert next(
        event.time for event in rest_of_it.events if event.kind == EventKind.REST
    ) == pytest.approx(rest, abs=1e-9)


def test_impacts_in_turn_within_one_instant_end_though_the_gaps_vanish_as_squares():
    """Case 9215: each pair of impacts squares the gap and leaves a quarter of the speed; the last
    gaps underflow.
    """
    system, x, v = random_case(9215)
    motion = moved(system, x, v, 3.0, tol=1e-10)
    held = next(event for event in motion.events if event.kind == EventKind.HELD)
    assert held.contact == "both"
    same = [
        event for event in motion.events.of(EventKind.IMPACT) if abs(event.time - held.time) < 1e-12
    ]
    speeds = np.array([event.velocity_before[1] for event in same if event.contact == "upper"])
    model, e = system.model, system.impact.e[1]
    left = (
        math.cos(2 * model.beta0) ** 2 * (1 + e) / (1 + model.mass_ratio) - e
    )  # from upper to lower, which keeps nothing, and back
    np.testing.assert_allclose(speeds[2:] / speeds[1:-1], left, rtol=1e-9)
    assert check_case(9215) > 20


def test_bouncing_without_loss_a_million_times_a_unit_of_time_is_refused_at_once_with_the_contact():
    """Below 45 degrees the impulse on the upper layer presses the lower one: nothing of a bounce is
    lost.
    """
    system = layers(e=(0.5, 1.0), V=-0.5, beta0=math.radians(40))
    with pytest.raises(
        MotionError,
        match=(
            r"more than 20000 impacts at 'upper' \(e = 1\).* without a loss .* never end.*e "
            r"below 1"
        ),
    ):
        moved(system, (0.0, 1e-15), (0.0, 0.0), 5.0)


def test_impacts_that_get_smaller_end_in_rest_at_the_time_that_their_sum_has():
    """Symmetric layers that bounce together with e = 1/2: the flights halve, so what is left is
    what the last two show.
    """
    motion = moved(layers(e=(0.5, 0.5)), (0.05, 0.05), (0.0, 0.0), 2.0, tol=1e-14)
    assert {event.contact for event in motion.events} == {"both"}
    last, before = motion.impacts.time[-1], motion.impacts.time[-2]
    assert motion.rest_time == pytest.approx(last + (last - before), abs=1e-12)
    assert motion.closed == ("lower", "upper")


def test_a_massless_hinge_ends_a_motion_of_both_layers_by_name():
    motion = moved(layers(), (0.6, 0.5), (0.0, 0.0), 2.0, tol=1e-14)
    assert (motion.stop.value, motion.limit) == ("singular", "massless_hinge")
    total = 2 * BETA80 + motion.theta_1 - motion.theta_2
    assert 0.0 <= total - math.pi < 1e-3  # the speed is infinite there, as that of a square root


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (
            lambda: moved(layers(), (-0.1, 0.0), (0.0, 0.0), 1.0),
            "theta_1 = -0.1 lies beyond the contact 'lower' at theta_1 = 0",
        ),
        (
            lambda: moved(layers(), (0.0, 0.1), (-0.2, 0.0), 1.0),
            "theta_1 = 0 moves into the contact 'lower'",
        ),
        (
            lambda: layers(e=(0.1, 0.2, 0.3)),
            "impact.e must have 2 value(s), for lower, upper, got 3",
        ),
        (lambda: layers(e=1.2), "e must lie in [0, 1], got 1.2"),
        (
            lambda: saltus.simulate(layers(), theta=0.1, duration=1.0),
            "theta must have 2 values, got 0.1",
        ),
    ],
)
def test_what_has_no_meaning_is_refused_by_name(ask, words):
    with pytest.raises(ParameterError) as refused:
        ask()
    assert words in str(refused.value)


def test_a_transfer_gains_energy_where_the_condition_of_two_layers_says_so():
    """M_ss e_s^2 + 2 cos(2 beta0) e_s g + M_jj g^2 > M_ss; and an impact then leaves the energy
    that it says.
    """
    rng, gaining = np.random.default_rng(6), 0
    for _ in range(50):
        m, beta0, g, e = (
            10 ** rng.uniform(-2, 1),
            rng.uniform(0.3, 2.8),
            rng.uniform(),
            rng.uniform(0, 1, 2),
        )
        law, mass = NewtonImpact(e=tuple(e), transfer=g), (1 + m, 1.0)
        found = energy_gain(TwoLayer(beta0=beta0, mass_ratio=m), law)
        for s, name in enumerate(("lower", "upper")):
            j = 1 - s
            left = mass[s] * e[s] ** 2 + 2 * math.cos(2 * beta0) * e[s] * g + mass[j] * g**2
            assert found[name] == pytest.approx(left / mass[s] - 1.0, abs=1e-12)
            gaining += left > mass[s]
    assert 5 < gaining < 95


def test_an_impact_from_the_upper_layer_gains_the_energy_that_was_announced():
    system = layers(transfer=1.0, mass_ratio=0.7)
    motion = moved(system, (0.0, 0.15), (0.0, 0.0), 8.0)
    impact = motion.events.of(EventKind.IMPACT)[0]
    assert impact.contact == "upper"
    mass = system.model.mass_matrix((0.0, 0.0))
    before, after = np.array(impact.velocity_before), np.array(impact.velocity_after)
    gained = (after @ mass @ after) / (before @ mass @ before) - 1.0
    assert gained == pytest.approx(energy_gain(system.model, system.impact)["upper"], abs=1e-12)
    assert gained == pytest.approx(0.7, abs=1e-12)
    assert motion.validity.gains == pytest.approx({"upper": 0.7}, abs=1e-12)
    assert not motion.validity.respected
    assert "impacts at upper may raise the kinetic energy by 70 %" in str(motion.validity)
    harmless = moved(layers(transfer=1.0, mass_ratio=0.0), (0.0, 0.15), (0.0, 0.0), 8.0)
    assert harmless.validity.gains == {}


def test_each_factor_of_a_law_has_a_path_and_survives_a_file():
    system = layers(e=(0.2, 0.1), transfer=0.3)
    assert system.parameters["impact.e.1"] == 0.1
    assert system.with_({"impact.e.1": 0.4}).impact == NewtonImpact(e=(0.2, 0.4), transfer=0.3)
    assert System.from_json(system.to_json()) == System.from_toml(system.to_toml()) == system


def test_between_two_walls_the_symmetric_orbit_is_its_closed_form():
    """Impacts at W tau = phi + n pi, at each wall in turn, with speed v after: under A cos(W tau),
    on the way from -d to d

        x = -d + v s + A / W^2 (cos phi - cos(W s + phi)) - A / W s sin phi,    x(pi / W) = d.

    The speed before the impact is v - 2 A / W sin phi, so v (1 - e) = -2 e A / W sin phi, and 2 d =
    v pi / W + 2 A / W^2 cos phi
    - A pi / W^2 sin phi. So sin phi = -v (1 - e) W / (2 e A), and cos phi follows; both squares add
      up to 1.
    """
    A, W, e, d = 0.8, 1.0, 0.7, 1.0
    a = -(1 - e) * W / (2 * e * A)  # sin phi = a v
    b, c = W * W * d / A, -(W * math.pi / (2 * A)) + math.pi * a / 2  # cos phi = b + c v
    found = 0
    for v in np.roots([a * a + c * c, 2 * b * c, b * b - 1.0]):
        phi, s = math.atan2(a * v, b + c * v), np.linspace(0.0, math.pi / W, 200)[1:-1]
        x = (
            -d
            + v * s
            + A / W**2 * (math.cos(phi) - np.cos(W * s + phi))
            - A / W * s * math.sin(phi)
        )
        if v <= 0 or not (np.abs(x) < d).all():
            continue
        cosine = Harmonic(amplitude=A, phase=math.pi / 2)
        system = System(
            model=TwoStops(stiffness=0.0),
            load=Load(frequency=W, force=cosine),
            impact=NewtonImpact(e=e),
        )
        start = phi % (2 * math.pi) / W
        motion = saltus.simulate(
            system, x=-d, velocity=v, time=start, duration=3.5 * math.pi / W, tol=1e-14
        )
        impacts = motion.events.of(EventKind.IMPACT)
        # The orbit is unstable, each impact multiplies an error by 30: the fourth is not asked for.
        assert [event.contact for event in impacts] == ["right", "left", "right"]
        for n, event in enumerate(impacts, 1):
            assert event.time - start == pytest.approx(n * math.pi / W, abs=1e-10)
            assert abs(event.velocity_after[0]) == pytest.approx(v, abs=1e-10)
        found += 1
    assert found


class LateIndefinite(TwoStops):
    """A mass that is below 0 beyond x = 0.5, which no mechanism has."""

    __slots__ = ()

    def mass_matrix(self, x):
        return 1.0 - 2.0 * x


def test_a_mass_that_no_mechanism_has_ends_in_a_sentence():
    system = System(
        model=LateIndefinite(stiffness=0.0), load=Load(frequency=1.0, force=Harmonic(amplitude=0.8))
    )
    with pytest.raises(
        MotionError,
        match=r"the impact law has no solution at time .* the mass matrix is not positive definite",
    ):
        saltus.simulate(system, x=0.9, velocity=0.5, duration=20.0)
