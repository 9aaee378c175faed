"""Derivatives of motions with several contacts: against differences, the reduced model, closed
forms and the mirror.
"""

import math

import numpy as np
import pytest
from test_contacts import BETA80, layers

import saltus
from saltus import NewtonImpact, TwoStops
from saltus.flow import EventKind
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction

PATHS = (
    "model.beta0",
    "load.frequency",
    "load.vertical",
    "impact.e.0",
    "impact.e.1",
    "impact.transfer",
    "model.damping",
)


def end_and_times(system, x, v, duration):
    motion = saltus.simulate(
        system,
        theta=(x[0], -x[1]),
        velocity=(v[0], -v[1]),
        duration=duration,
        tol=1e-15,
        dense=False,
    )
    return np.array(
        [
            *motion.position,
            *motion.velocity,
            *(event.time for event in motion.events if lasting(event)),
        ]
    )


def lasting(event):
    """Not one of the impacts that die away, of which it is rounding that decides how many are
    followed.
    """
    return (
        event.kind is not EventKind.IMPACT
        or abs(event.velocity_before[event.contact == "upper"]) > 1e-3
    )


def derivatives(system, x, v, duration, paths=(), tol=1e-14):
    return saltus.sensitivities(
        system,
        theta=(x[0], -x[1]),
        velocity=(v[0], -v[1]),
        duration=duration,
        parameters=paths,
        tol=tol,
    )


def columns(result):
    """Of the end and the events' times: for x1, x2, v1, v2 (openings), then the parameters."""
    times = result.event_times[[lasting(event) for event in result.motion.events]]
    both = np.vstack([np.hstack([result.state, result.parameters]), times])
    return both * np.array([1.0, -1.0, 1.0, -1.0, *np.ones(both.shape[1] - 4)])


def differences(system, x, v, duration, paths, step):
    """Central ones, of second order."""
    start = np.array([*x, *v])

    def moved(k, by):
        there = start + by * (np.arange(4) == k)
        changed = system.with_({paths[k - 4]: system.get(paths[k - 4]) + by}) if k >= 4 else system
        return end_and_times(changed, there[:2], there[2:], duration)

    return np.array(
        [(moved(k, step) - moved(k, -step)) / (2 * step) for k in range(4 + len(paths))]
    ).T


# What happens, and the system and start: impacts of both layers, releases and closings,
# accumulations on one layer
CASES = {
    "impacts of both layers": (
        layers(
            e=(0.3, 0.6),
            transfer=0.2,
            mass_ratio=4.0,
            ground=0.2,
            H=0.4,
            W=1.7,
            damping=0.1,
            stiffness_ratio=0.6,
        ),
        (0.2, 0.3),
        (0.1, 0.0),
        12.0,
        {EventKind.IMPACT},
    ),
    "releases and closings without bounce": (
        layers(transfer=0.7, H=0.5, damping=0.1, mass_ratio=0.1),
        (0.3, 0.2),
        (0.1, 0.2),
        20.0,
        {EventKind.IMPACT, EventKind.RELEASE},
    ),
    "impacts that die away": (
        layers(e=(0.05, 0.1), transfer=0.6, H=0.5, damping=0.1, mass_ratio=0.2),
        (0.3, 0.05),
        (0.1, 0.1),
        12.0,
        {EventKind.IMPACT, EventKind.RELEASE, EventKind.HELD},
    ),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.thorough if name.startswith("releases") else ())
        for name in CASES
    ],
)
def test_derivatives_are_the_limit_of_central_differences_of_second_order(name):
    system, x, v, duration, kinds = CASES[name]
    paths = PATHS if system.impact.e[0] else PATHS[:3] + PATHS[5:]
    result = derivatives(system, x, v, duration, paths)
    assert kinds <= {event.kind for event in result.motion.events}
    assert result.undefined is None
    found = columns(result)
    size = np.abs(found).max(axis=0) + 1e-3
    coarse, fine = (differences(system, x, v, duration, paths, step) for step in (4e-6, 2e-6))
    np.testing.assert_allclose((4 * fine - coarse) / 3 / size, found / size, rtol=0, atol=1e-8)
    far, near = (
        np.abs(d - found).max() for d in (differences(system, x, v, duration, paths, 2e-5), coarse)
    )
    assert near < far / 10, (far, near)  # 25, but for rounding


@pytest.mark.thorough
def test_where_the_other_layer_stays_closed_they_are_those_of_the_reduced_model():
    full = layers(transfer=0.95, H=0.1, damping=0.1, mass_ratio=0.0)
    reduced = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=full.load,
        impact=VelocityReduction(0.95),
    )
    paths = ("model.beta0", "load.frequency", "load.horizontal.amplitude", "model.damping")
    for duration in (3.0, 20.0):
        one = saltus.sensitivities(
            reduced, theta=0.12, duration=duration, parameters=paths, tol=1e-14
        )
        both = derivatives(full, (0.12, 0.0), (0.0, 0.0), duration, paths)
        place = 0 if both.motion.theta_1 > 0 else 1
        rows, start = [place, 2 + place], [0, 2]
        np.testing.assert_allclose(both.state[np.ix_(rows, start)], one.state, rtol=0, atol=1e-12)
        np.testing.assert_allclose(both.parameters[rows], one.parameters, rtol=0, atol=2e-12)
        np.testing.assert_array_equal(both.state[[1 - place, 3 - place]], 0.0)
        np.testing.assert_allclose(
            both.event_times[:, [0, 2, 4, 5, 6, 7]], one.event_times, rtol=0, atol=1e-11
        )


def test_nothing_jumps_at_a_simple_release_and_the_derivatives_do_at_an_impact():
    """The saltation of a release is the identity: what the derivatives change by across it is of
    the order of the time.
    """
    system, x, v, duration, _ = CASES["releases and closings without bounce"]
    events = list(derivatives(system, x, v, duration).motion.events)
    apart = np.diff([0.0, *(e.time for e in events), duration])
    release = next(
        i
        for i, e in enumerate(events)
        if e.kind is EventKind.RELEASE and min(apart[i], apart[i + 1]) > 1e-2
    )
    impact = next(
        i
        for i, e in enumerate(events)
        if e.kind is EventKind.IMPACT and min(apart[i], apart[i + 1]) > 1e-2
    )

    def change(index, width):
        before, after = (
            derivatives(system, x, v, events[index].time + s * width).state for s in (-1, 1)
        )
        return np.abs(after - before).max()

    assert change(release, 1e-4) < 1e-3
    assert change(release, 1e-6) < 2e-2 * change(release, 1e-4)
    assert change(impact, 1e-6) > 0.1


def test_the_determinant_without_damping_is_that_of_the_impacts_and_the_mass_matrix():
    """By Liouville's theorem that of (q, M v) is 1 along arcs; an impact of one contact gives e^2:
    det M_0 / det M prod e^2.
    """
    for e, m in (((0.3, 0.6), 4.0), ((0.8, 0.9), 1.0)):
        system = layers(e=e, mass_ratio=m, ground=0.2, H=0.4, W=1.7, stiffness_ratio=0.6)
        result = derivatives(system, (0.2, 0.3), (0.1, 0.0), 12.0)
        impacts = [event.contact for event in result.motion.events.of(EventKind.IMPACT)]
        assert {"lower", "upper"} == set(impacts)
        masses = [
            np.linalg.det(system.model.mass_matrix(q))
            for q in ((0.2, -0.3), (result.motion.theta_1, result.motion.theta_2))
        ]
        expected = masses[0] / masses[1] * math.prod(e[name == "upper"] ** 2 for name in impacts)
        assert result.determinant == pytest.approx(expected, rel=1e-10)


def test_between_walls_the_determinant_is_that_of_the_impacts():
    system = System(
        model=TwoStops(stiffness=0.0),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.8)),
        impact=NewtonImpact(e=(0.7, 0.9)),
    )
    result = saltus.sensitivities(system, x=0.1, velocity=0.6, periods=3, tol=1e-14)
    sides = [event.contact for event in result.motion.events]
    assert set(sides) == {"left", "right"}
    assert result.determinant == pytest.approx(
        math.prod({"left": 0.49, "right": 0.81}[s] for s in sides), rel=1e-9
    )


def test_the_mirror_exchanges_the_columns_of_the_layers():
    turn = [1, 0, 3, 2]
    for H in (0.1, 0.3):
        ahead = derivatives(layers(e=(0.4, 0.4), H=H, damping=0.1), (0.15, 0.0), (0.05, 0.0), 9.0)
        back = derivatives(layers(e=(0.4, 0.4), H=-H, damping=0.1), (0.0, 0.15), (0.0, 0.05), 9.0)
        assert len(ahead.motion.events) > 2
        np.testing.assert_allclose(back.state[np.ix_(turn, turn)], ahead.state, rtol=0, atol=1e-11)
        np.testing.assert_allclose(
            back.event_times[:, turn], -ahead.event_times, rtol=0, atol=1e-10
        )


@pytest.mark.parametrize("e", [0.0, 0.3])
def test_a_start_at_a_closed_contact_has_the_derivatives_of_the_side_on_which_it_opens(e):
    """An opening h falls back in a time of the order of sqrt(h), so that differences converge with
    sqrt(h).
    """
    system, x, v, duration = (
        layers(e=(e, e), H=0.3, damping=0.1, mass_ratio=0.4, V=-0.6),
        (0.15, 0.0),
        (0.3, 0.0),
        2.5,
    )
    found = columns(derivatives(system, x, v, duration))[:4]
    base = end_and_times(system, x, v, duration)[:4]
    for column, bound in ((1, 0.7), (3, 70.0)):
        errors = []
        for step in (1e-5, 1e-7):
            there = np.array([*x, *v]) + step * (np.arange(4) == column)
            difference = (end_and_times(system, there[:2], there[2:], duration)[:4] - base) / step
            errors.append(np.abs(difference - found[:, column]).max())
        assert errors[0] < bound * (math.sqrt(1e-5) if column == 1 else 1e-5)
        assert errors[1] < 0.13 * errors[0]


def test_the_motion_is_that_of_simulate():
    system, x, v, duration, _ = CASES["impacts that die away"]
    motion = derivatives(system, x, v, duration, PATHS).motion
    plain = saltus.simulate(
        system, theta=(x[0], -x[1]), velocity=(v[0], -v[1]), duration=duration, tol=1e-14
    )
    np.testing.assert_allclose(
        [*motion.position, *motion.velocity], [*plain.position, *plain.velocity], rtol=0, atol=1e-13
    )
    assert [(e.kind, e.contact) for e in motion.events] == [
        (e.kind, e.contact) for e in plain.events
    ]


def test_contacts_that_close_at_one_instant_have_derivatives_only_to_what_keeps_them_together():
    """The layers are mirror images: the vertical load keeps them so, each layer's own start does
    not.
    """
    result = derivatives(layers(e=(0.5, 0.5)), (0.05, 0.05), (0.0, 0.0), 0.4, PATHS)
    assert "close together" in result.undefined
    assert np.isnan(result.state[:, :2]).any()
    step = 1e-5
    moved = [
        end_and_times(layers(e=(0.5, 0.5), V=-0.5 + s * step), (0.05, 0.05), (0.0, 0.0), 0.4)
        for s in (1, -1)
    ]
    difference = (moved[0] - moved[1]) / (2 * step)
    vertical = result.parameters[:, PATHS.index("load.vertical")]
    np.testing.assert_allclose(vertical, difference[:4], rtol=0, atol=1e-7)


def test_a_start_at_a_closed_contact_whose_impacts_lose_nothing_has_no_derivative_to_its_opening():
    result = derivatives(layers(e=(1.0, 1.0), mass_ratio=0.4), (0.15, 0.0), (0.0, 0.0), 1.0)
    assert "impacts lose nothing" in result.undefined
    assert np.isnan(result.state[:, [1, 3]]).all()
    assert np.isfinite(result.state[:, [0, 2]]).all()
