"""Contacts that are no singularity: orbits, multipliers and marks through grazings, against DOP853
and at several steps.
"""

from functools import cache

import numpy as np
import pytest
from soft_stops import soft_stop, variational_map

import saltus
from saltus.errors import ParameterError
from saltus.orbits.beyond.special_point import SpecialKind

FREQUENCY = "load.frequency"
CASES = {
    "spring": ({}, (0.2, 3.0)),
    "spring and damper": ({"damper": 0.3, "amplitude": 0.6}, (0.2, 3.0)),
    "softer beyond": ({"stop": -0.6, "amplitude": 0.4}, (0.5, 2.0)),
}
every_case = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.thorough if name == "spring" else ()) for name in CASES],
)
shortest_case = pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "softer beyond" else pytest.mark.thorough)
        for name in CASES
    ],
)


@cache
def branch_of(name, step=0.1):
    numbers, bounds = CASES[name]
    return saltus.continue_orbit(
        saltus.find_orbit(soft_stop(**numbers), x=0.0), FREQUENCY, bounds, step=step
    )


@cache
def mapped(name):
    """Points of a branch but for the special ones, with their states after a period and the
    derivatives, by DOP853.
    """
    branch = branch_of(name)
    points, special = branch.points, [s.point.place for s in branch.special]
    is_special = np.array(
        [any(np.array_equal(p.place, place) for place in special) for p in points]
    )
    # and between them every third, as each takes 0.1 s
    beside = np.convolve(is_special, np.ones(3), "same") > 0
    points = [p for n, p in enumerate(points) if not is_special[n] and (beside[n] or n % 3 == 0)]
    return [
        (point, *variational_map(point.orbit.system, np.array(point.orbit.state)))
        for point in points
    ]


def marks(branch):
    return sorted((str(s.kind), s.parameter) for s in branch.special)


@every_case
def test_multipliers_at_a_grazing_are_those_of_the_variational_equation(name):
    grazings = [s for s in branch_of(name).special if s.kind == SpecialKind.GR]
    assert grazings
    for special in grazings:
        orbit = special.orbit
        end, derivative = variational_map(orbit.system, np.array(orbit.state))
        assert end == pytest.approx(orbit.state, abs=1e-9)
        assert min(abs(orbit.clearance), orbit.shallowest) < 1e-9
        expected = np.linalg.eigvals(derivative)
        expected = expected[np.argsort(-np.abs(expected), kind="stable")]
        assert np.sort_complex(orbit.multipliers) == pytest.approx(
            np.sort_complex(expected.astype(complex)), abs=2e-4
        )
        assert np.prod(orbit.multipliers).real == pytest.approx(np.linalg.det(derivative), abs=1e-6)


@shortest_case
def test_multipliers_along_the_branch_are_those_of_the_variational_equation(name):
    points = [p for p in mapped(name) if min(p[0].orbit.clearance, p[0].orbit.shallowest) > 1e-6]
    for point, end, derivative in points[:: len(points) // 25]:
        if min(point.orbit.clearance, point.orbit.shallowest) < 1e-2:
            end, derivative = variational_map(
                point.orbit.system, np.array(point.orbit.state), longest=0.01
            )
        assert end == pytest.approx(point.orbit.state, abs=1e-9)
        trace = point.orbit.multipliers.sum().real
        assert trace == pytest.approx(np.trace(derivative), abs=1e-6 * (1 + abs(trace)))


@shortest_case
def test_marks_are_the_same_at_other_steps(name):
    """To 1e-8, except grazings of the order in which rounding of the depth, 1e-16, moves them."""
    known = marks(branch_of(name))
    for step in (0.03, 0.011):
        found = marks(branch_of(name, step))
        assert [kind for kind, _ in found] == [kind for kind, _ in known]
        assert [value for _, value in found] == pytest.approx(
            [value for _, value in known], abs=1e-8
        )


@shortest_case
def test_the_branch_has_the_special_points_that_a_shooting_method_of_another_integrator_shows_and_no_others(
    name,
):
    """det(M - 1) and det(M + 1) of DOP853 vanish at LP and PD, and change sign along the branch as
    often as there are such.
    """
    branch = branch_of(name)
    matrices = [derivative for _, _, derivative in mapped(name)]
    for kind, sign in ((SpecialKind.LP, -1.0), (SpecialKind.PD, 1.0)):
        determinants = np.array([np.linalg.det(m + sign * np.eye(2)) for m in matrices])
        expected = [s for s in branch.special if s.kind == kind]
        assert np.count_nonzero(np.diff(np.sign(determinants))) == len(expected)
        for special in expected:
            end, derivative = variational_map(
                special.orbit.system, np.array(special.orbit.state), longest=0.01
            )
            assert end == pytest.approx(special.orbit.state, abs=1e-9)
            assert np.linalg.det(derivative + sign * np.eye(2)) == pytest.approx(0.0, abs=1e-6)
    assert {s.kind for s in branch.special} <= {SpecialKind.LP, SpecialKind.PD, SpecialKind.GR}


def test_a_grazing_is_passed_as_an_ordinary_orbit():
    branch = branch_of("spring")
    assert {str(end).split()[0] for end in branch.ends} == {"bound"}
    assert not branch.missed
    for special in branch.special:
        if special.kind == SpecialKind.GR:
            assert special.orbit.stable == bool((np.abs(special.orbit.multipliers) < 1).all())
            assert special.defect < 1e-12
            with pytest.raises(ParameterError, match="is not a singularity"):
                saltus.continue_special(special, "load.force.amplitude")


def test_a_force_that_jumps_keeps_its_grazing_a_square_root():
    """Preloaded: beside the grazing the trace of the multipliers is a number / v, with v the speed
    of the impacts.
    """
    system = soft_stop(preload=0.2, amplitude=0.25, frequency=1.6)
    orbit = saltus.find_orbit(system, x=0.0)
    branch = saltus.continue_orbit(orbit, FREQUENCY, (1.0, 2.0))
    special, *_ = [s for s in branch.special if s.kind == SpecialKind.GR]
    assert special.orbit.grazes
    assert not special.orbit.stable
    assert special.orbit.crossings == 0
    beside = [
        p.orbit for p in branch.points if p.orbit.signature.sides and 1e-8 < p.orbit.slowest < 1e-2
    ]
    products = np.array([orbit.multipliers.sum().real * orbit.slowest for orbit in beside])
    assert len(beside) >= 3
    assert products == pytest.approx(np.full(len(beside), products[-1]), rel=0.05)


def test_symmetric_orbits_through_a_regular_contact_are_solved_over_half_a_period():
    model = saltus.Metainterface(beta0=1.4, damping=0.1)
    system = saltus.System(
        model=model, load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5))
    )
    orbit = saltus.find_orbit(system, theta=0.1)
    assert orbit.symmetric
    assert (orbit.crossings, orbit.signature.impact_count) == (2, 0)
    assert orbit.defect < 1e-12
    full = orbit.motion(tol=1e-14)
    assert full.at(0.25 * orbit.duration)[0] == pytest.approx(
        -full.at(0.75 * orbit.duration)[0], abs=1e-12
    )


def test_an_orbit_is_followed_where_its_contact_becomes_a_singularity():
    """Along V a metainterface without it is one of the ordinary kind: its orbit is found again with
    impacts.
    """
    model = saltus.Metainterface(beta0=1.4, damping=0.1)
    load = saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=0.0)
    orbit = saltus.find_orbit(saltus.System(model=model, load=load), theta=0.1)
    assert orbit.signature.impact_count == 0
    branch = saltus.continue_orbit(orbit, "load.vertical", (-0.05, 0.05))
    assert {p.orbit.signature.impact_count for p in branch.points} == {2}
    middle = min(branch.points, key=lambda p: abs(p.parameter)).orbit
    assert middle.amplitude == pytest.approx(orbit.amplitude, abs=1e-9)
    assert np.sort_complex(middle.multipliers) == pytest.approx(
        np.sort_complex(orbit.multipliers), abs=1e-7
    )


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_no_torus_is_born_where_areas_never_grow(damping):
    """Without damping the complex pairs lie on the unit circle, and rounding decides on which
    side.
    """
    system = soft_stop(damping=damping, amplitude=0.05, frequency=0.6)
    orbit = saltus.find_orbit(system, x=0.0, settle=0, period=1)
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (0.01, 0.6))
    assert not [s for s in branch.special if s.kind == SpecialKind.NS]
    assert not branch.missed
    assert {s.kind for s in branch.special} >= {SpecialKind.GR}


def test_a_torus_is_born_where_areas_may_grow():
    """The forced van der Pol oscillator leaves its entrained motion at an NS, where the product of
    the multipliers is 1.
    """

    class VanDerPol(saltus.Model):
        coordinates = ("x",)
        channels = ("force",)

        def acceleration(self, t, x, velocity, side, load):
            return load.force(t) - x + 0.2 * (1 - x * x) * velocity

    load = saltus.Load(frequency=1.3, force=saltus.Harmonic(1.5))
    orbit = saltus.find_orbit(saltus.System(model=VanDerPol(), load=load), x=1.0)
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (0.2, 2.0))
    torus, *_ = [s for s in branch.special if s.kind == SpecialKind.NS]
    assert np.prod(torus.orbit.multipliers).real == pytest.approx(1.0, abs=1e-9)


def test_a_pair_beyond_the_circle_where_areas_never_grow_is_reported_as_missed(monkeypatch):
    from saltus.orbits.branches import branch_events

    monkeypatch.setattr(branch_events, "complex_pairs", lambda orbit: np.array([1.01]))
    system = soft_stop(amplitude=0.05, frequency=0.5)
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.0), "load.force.amplitude", (0.04, 0.06)
    )
    assert branch.missed
    assert all(
        str(one).startswith("NS near 0.0") and "areas of states never grow" in str(one)
        for one in branch.missed
    )


@pytest.mark.parametrize("step", [0.1, 0.02, 0.01])
def test_the_instant_of_a_passage_may_go_through_phase_0(step):
    """With a damper the state at phase 0 has a corner there, at 0.43782756, on which steps shrank
    to nothing.
    """
    numbers = {
        "stop": 40.0,
        "damper": 0.3,
        "edge": 0.0659496,
        "damping": 0.1315172,
        "amplitude": 0.2826206,
    }
    orbit = saltus.find_orbit(soft_stop(**numbers, frequency=0.4811265), x=-0.234)
    branch = saltus.continue_orbit(orbit, FREQUENCY, (0.42, 0.5), step=step)
    assert sorted(end.parameter for end in branch.ends) == [0.42, 0.5]
    sides = {point.orbit.state[0] > 0.0659496 for point in branch.points}
    assert sides == {True, False}
