"""Periodic orbits with several contacts: against closed forms, the reduced model, simulation, and
through their switchings.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

import saltus
from saltus import NewtonImpact, TwoLayer, TwoStops
from saltus.continuation import CurveEnd
from saltus.errors import MotionError, ParameterError
from saltus.orbits import OrbitEnd, SpecialKind, as_json, defects, from_json, orbits_of
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction

BETA80 = math.radians(80)
H = "load.horizontal.amplitude"


def layers(H=0.2, V=-0.5, W=1.0, transfer=0.0, e=(0.0, 0.0), m=0.0, C=0.1):
    return System(
        model=TwoLayer(beta0=BETA80, damping=C, mass_ratio=m),
        load=Load(frequency=W, vertical=V, horizontal=Harmonic(amplitude=H)),
        impact=NewtonImpact(e=e, transfer=transfer),
    )


def room(A=0.8, W=1.0, e=0.7, **numbers):
    return System(
        model=TwoStops(**{"stiffness": 0.2} | numbers),
        load=Load(frequency=W, force=Harmonic(amplitude=A, phase=math.pi / 2)),
        impact=NewtonImpact(e=e),
    )


def test_between_two_walls_the_symmetric_orbit_is_its_closed_form():
    """Without a spring: x'' = A cos(W tau), solved in tests/flow/test_contacts.py. The product of
    its multipliers is e^4.

    The impacts are half a period apart, after each the speed is v; the first wall is left at the
    phase phi.
    """
    A, W, e, d, found = 0.8, 1.0, 0.7, 1.0, 0
    a = -(1 - e) * W / (2 * e * A)  # sin phi = a v
    b, c = W * W * d / A, -(W * math.pi / (2 * A)) + math.pi * a / 2  # cos phi = b + c v
    for v in np.roots([a * a + c * c, 2 * b * c, b * b - 1.0]):
        phi, half = math.atan2(a * v, b + c * v), math.pi / W
        s = np.linspace(0.0, half, 200)[1:-1]
        if v <= 0 or not (np.abs(way(A, W, d, v, phi, s)) < d).all():
            continue
        turns = math.floor(-phi / math.pi)
        s, sign = -(phi + turns * math.pi) / W, (-1) ** turns
        x, speed = way(A, W, d, v, phi, s), v + A / W * (math.sin(W * s + phi) - math.sin(phi))
        orbit = saltus.find_orbit(
            room(A, W, e, stiffness=0.0), x=sign * x, velocity=sign * speed, settle=0, period=1
        )
        np.testing.assert_allclose(e * orbit.speeds, v, rtol=0, atol=1e-10)
        np.testing.assert_allclose(
            (orbit.impact_times * W - phi + 1.0) % math.pi, 1.0, rtol=0, atol=1e-10
        )
        first, second = orbit.multipliers
        assert first * second == pytest.approx(e**4, abs=1e-10)
        found += 1
    assert found


def way(A, W, d, v, phi, s):
    """x at a time s after the left wall was left."""
    return -d + v * s + A / W**2 * (math.cos(phi) - np.cos(W * s + phi)) - A / W * s * math.sin(phi)


CASES = {
    "crossings": (layers(H=0.1, transfer=0.95), {}),
    "a release before each impact": (layers(H=0.2, transfer=1.0), {}),
    "slow second impacts": (layers(H=0.5, transfer=0.7, m=0.1), {}),
    "two walls": (room(), {"x": 0.1, "velocity": 0.5}),
}


@pytest.fixture(scope="module", params=CASES)
def orbit(request):
    system, start = CASES[request.param]
    return saltus.find_orbit(system, **(start or {"theta_1": 0.1, "theta_2": 0.0}))


def test_orbits_repeat_and_have_the_multipliers_of_their_motions(orbit):
    assert orbit.defect < 1e-12
    assert orbit.admissible
    start = orbit.start()
    flow = saltus.sensitivities(orbit.system, **start, periods=orbit.period, tol=1e-14)
    theirs = np.linalg.eigvals(flow.state)
    assert len(theirs) == len(orbit.multipliers)
    theirs = theirs[np.argsort(-np.abs(theirs), kind="stable")][:2]
    assert np.abs(np.sort_complex(theirs) - np.sort_complex(orbit.multipliers[:2])).max() < 1e-10
    assert np.abs(orbit.multipliers[2:]).max(initial=0.0) < 1e-7
    assert defects([orbit], rounds=3)[0] < 1e-11


def test_the_equations_have_the_derivatives_of_their_differences(orbit):
    paths = (
        "load.frequency",
        "impact.transfer",
        H if "theta_1" in orbit.system.model.coordinates else "load.force.amplitude",
    )
    problem = type(orbit.equations)(orbit.system, orbit.signature, paths)
    place = np.append(orbit.solution.unknowns, problem.values) + 1e-3 * np.random.default_rng(
        1
    ).normal(size=problem.size + 3)
    place[-2] = 0.5

    def residual(at):
        return problem.evaluate(at[: problem.size], at[problem.size :]).residual

    step = 1e-5
    columns = [
        (residual(place + step * row) - residual(place - step * row)) / (2 * step)
        for row in np.eye(place.size)
    ]
    exact = problem.evaluate(place[: problem.size], place[problem.size :]).derivatives()
    np.testing.assert_allclose(
        np.array(columns).T, exact, rtol=0, atol=2e-7 * max(1.0, np.abs(exact).max())
    )


def test_where_the_other_layer_stays_closed_orbits_are_those_of_the_reduced_model():
    full = saltus.find_orbit(layers(H=0.1, transfer=0.95), theta_1=0.1, theta_2=0.0)
    reduced = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=full.system.load,
        impact=VelocityReduction(0.95),
    )
    one = saltus.find_orbit(reduced, theta=0.1)
    assert full.amplitude == pytest.approx(one.amplitude, abs=1e-12)
    assert full.highest == pytest.approx(one.highest, abs=1e-12)
    assert full.lowest == pytest.approx(one.lowest, abs=1e-12)
    mine, theirs = (np.sort_complex(o.multipliers[:2]) for o in (full, one))
    assert np.abs(mine - theirs).max() < 1e-11


def test_the_largest_angles_are_those_of_the_derivation():
    """0.5694 at H = 0.2 and 1.0161 at 0.5, from an independent simulation (where the reduced model
    has .5856 and 1.0205).
    """
    for load, angle in ((0.2, 0.5694), (0.5, 1.0161)):
        assert saltus.find_orbit(
            layers(H=load, transfer=1.0), theta_1=0.1, theta_2=0.0
        ).amplitude == pytest.approx(angle, abs=6e-5)


def test_a_release_appears_where_the_reduced_model_s_reaction_vanishes():
    full = saltus.find_orbit(layers(H=0.1, transfer=1.0), theta_1=0.1, theta_2=0.0)
    branch = saltus.continue_orbit(full, H, (0.05, 0.3))
    reduced = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=full.system.load,
        impact=VelocityReduction(1.0),
    )
    theirs = saltus.continue_orbit(saltus.find_orbit(reduced, theta=0.1), H, (0.05, 0.3))
    vanishes = [s.parameter for s in theirs.special if s.kind == "reaction"]
    assert [s.kind for s in branch.special] == [SpecialKind.SW]
    assert branch.special[0].parameter == pytest.approx(vanishes[0], abs=1e-10)
    # the impact finds the layer open then, and its transfer does not act
    assert "at one instant" in str(branch.ends[1])


@pytest.fixture(scope="module")
def branch():
    orbit = saltus.find_orbit(layers(H=0.4, m=0.2), theta_1=0.1, theta_2=0.0)
    return saltus.continue_orbit(orbit, H, (0.05, 0.8))


def test_a_branch_goes_through_its_switchings(branch):
    """Without restitution and transfer nothing jumps where a release or a closing appears: orbits
    and multipliers go on.
    """
    assert [str(end) for end in branch.ends] == ["bound 0.05", "bound 0.8"]
    assert {special.kind for special in branch.special} == {SpecialKind.SW}
    assert len(branch.special) >= 4
    assert len({orbit.signature.impact_count for orbit in branch.orbits}) >= 3
    assert max(orbit.defect for orbit in branch.orbits) < 1e-11
    assert all(orbit.admissible and orbit.residual < 1e-11 for orbit in branch.orbits)
    for special in branch.special:
        beside = [branch.at(special.parameter + s * 1e-6)[0] for s in (-1.0, 1.0)]
        first, second = (np.sort_complex(orbit.multipliers[:2]) for orbit in beside)
        assert beside[0].signature != beside[1].signature
        assert np.abs(first - second).max() < 0.02
        assert beside[0].amplitude == pytest.approx(beside[1].amplitude, abs=1e-5)


@pytest.mark.parametrize("load", [0.1, 0.3, 0.55, 0.7])
def test_a_branch_has_the_orbits_that_motions_settle_on(branch, load):
    settled = saltus.find_orbit(layers(H=load, m=0.2), theta_1=0.1, theta_2=0.0)
    found = branch.at(load)
    assert len(found) == 1
    assert found[0].amplitude == pytest.approx(settled.amplitude, abs=1e-11)
    assert found[0].signature.impact_count == settled.signature.impact_count


def test_mirror_layers_switch_together():
    orbit = saltus.find_orbit(layers(H=0.2), theta_1=0.1, theta_2=0.0)
    both = saltus.continue_orbit(orbit, H, (0.05, 0.8))
    assert [str(end) for end in both.ends] == ["bound 0.05", "bound 0.8"]
    assert [special.kind for special in both.special] == [SpecialKind.SW] * 2
    low, high = (both.at(value)[0].signature for value in (0.1, 0.7))
    # the events of half a period
    assert (low.symmetric, len(low.events), low.impact_count) == (True, 1, 2)
    assert (high.symmetric, len(high.events), high.impact_count) == (True, 3, 4)


def test_a_grazing_is_where_the_linear_response_reaches_the_walls():
    """A / abs(k - W^2 + i c W) = d; beside it the orbit hits both walls, and its branch goes on
    through the grazing.
    """
    A, k, c = 0.8, 0.2, 0.3
    W = math.sqrt(k - c * c / 2 + math.sqrt((k - c * c / 2) ** 2 - k * k + A * A))
    orbit = saltus.find_orbit(room(A, W + 0.2, stiffness=k, damping=c), x=0.1, velocity=0.0)
    assert orbit.signature.impact_count == 0
    free = saltus.continue_orbit(orbit, "load.frequency", (W - 0.2, W + 0.4))
    grazing = [special for special in free.special if special.kind == SpecialKind.GR]
    assert grazing[0].parameter == pytest.approx(W, abs=1e-10)


def test_a_branch_ends_where_one_layer_is_at_its_contact_as_the_other_one_closes():
    """There the gap has a minimum that no smooth motion has, as the impact turns the first one
    round as well. Where the branch ends is no luck of rounding; which of two events at one instant
    comes first there is, and with it how far the end orbit misses itself.
    """
    ends = []
    for damping in 0.1824851532866711 * (1.0 + 1e-13 * np.arange(3)):
        system = System(
            model=TwoLayer(beta0=1.53514675339103, damping=damping, mass_ratio=0.3),
            load=Load(
                frequency=1.7382488876331892, vertical=-0.5, horizontal=Harmonic(amplitude=0.297)
            ),
            impact=NewtonImpact(e=0.6),
        )
        branch = saltus.continue_orbit(
            saltus.find_orbit(system, theta_1=0.1, theta_2=0.0), H, (0.275, 0.298)
        )
        assert branch.ends[0].reason is OrbitEnd.TWO_AT_ONCE
        assert max(orbit.defect for orbit in branch.orbits[1:]) < 1e-11
        ends.append(branch.ends[0].parameter)
    assert 0.28 < ends[0] < 0.284
    assert np.ptp(ends) < 1e-9


@dataclass(frozen=True, kw_only=True)
class ImpactAbsorber(saltus.ContactModel):
    """x'' + 2 zeta x' + x = F(tau) + r, eps y'' = -r, with y a ball in a cavity of x: |x - y| <=
    b.
    """

    zeta: float = 0.02
    eps: float = 0.05
    b: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        left = saltus.Contact(name="left", coordinate={"y": 1.0, "x": -1.0}, position=-self.b)
        return left, saltus.Contact(
            name="right", coordinate={"x": 1.0, "y": -1.0}, position=-self.b
        )

    def mass_matrix(self, theta):
        return (1.0, 0.0), (0.0, self.eps)

    def force(self, t, theta, velocity, load):
        return load.force(t) - 2.0 * self.zeta * velocity[0] - theta[0], 0.0


def absorber(F):
    return System(
        model=ImpactAbsorber(),
        load=Load(frequency=1.0, force=Harmonic(amplitude=F)),
        impact=NewtonImpact(e=0.65),
    )


def fold_of_absorber(zeta=0.02, eps=0.05, b=1.0, e=0.65):
    """The least F at which the ball hits each side once a period, half a period apart.

    With x = X, x' = u and y = X + b just after one impact, the ball flies at w = -2 (X + b) / pi to
    the other side, and meets it with all signs changed: these are three linear equations for X, u
    and F (cos, sin) of the phase, a line of solutions. The fold is its point of least F.
    """
    a, T = np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]), math.pi
    half = expm(a * T)
    # x and x' under F_c cos + F_s sin, at phase 0
    steady = np.array([[0.0, -0.5 / zeta], [0.5 / zeta, 0.0]])
    # (x, x')(T) = half ((X, u) - p) - p, p = steady (F_c, F_s), is -(X, u + 2 eps w); and u - w =
    # -e (u + 2 eps w + w)
    w = np.array([-2.0 / T, 0.0, 0.0, 0.0]), -2.0 * b / T
    rows = np.hstack([half + np.eye(2), -(half + np.eye(2)) @ steady])
    rows[1] += 2.0 * eps * w[0]
    own = np.array([0.0, 1.0 + e, 0.0, 0.0]) + (e * (2.0 * eps + 1.0) - 1.0) * w[0]
    right = -np.array([0.0, 2.0 * eps, e * (2.0 * eps + 1.0) - 1.0]) * w[1]
    matrix = np.vstack([rows, own])
    some, way = np.linalg.lstsq(matrix, right, rcond=None)[0][2:], np.linalg.svd(matrix)[2][-1, 2:]
    return abs(some[0] * way[1] - some[1] * way[0]) / math.hypot(*way)


def test_the_branch_of_an_impact_absorber_folds_in_closed_form_and_ends_where_nothing_holds_the_ball():
    """It is born at F = 2 zeta b, where the motion without impacts just fills the cavity; below,
    the ball may stand anywhere.
    """
    orbit = saltus.find_orbit(absorber(0.05), x=0.0, y=0.0, velocity=(0.0, 0.3))
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (0.01, 0.06))
    fold = next(s for s in branch.special if s.kind == SpecialKind.LP)
    born = max(s.parameter for s in branch.special if s.kind == SpecialKind.GR)
    assert fold.parameter == pytest.approx(fold_of_absorber(), abs=1e-13)
    assert born == pytest.approx(0.04, abs=1e-13)
    end = next(end for end in branch.ends if end.reason is not CurveEnd.BOUND)
    assert end.reason is OrbitEnd.NOT_ISOLATED
    # for a while a ball that is only touched may be followed
    assert 0.035 < end.parameter < 0.04 + 1e-12


def test_an_orbit_is_found_with_a_mass_that_nothing_holds_and_has_no_branch():
    orbit = saltus.find_orbit(absorber(0.02), x=0.0, y=0.2, velocity=(0.5, 0.0))
    root = complex(-0.02, math.sqrt(1 - 0.02**2))
    exact = [1.0, 1.0, *np.exp(2.0 * math.pi * np.array([root, root.conjugate()]))]
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers), np.sort_complex(exact), rtol=0, atol=1e-7
    )  # of a double one of a mass that flies freely
    assert not orbit.isolated
    assert orbit.amplitude == pytest.approx(0.5, abs=1e-12)
    with pytest.raises(ParameterError, match="others beside it"):
        saltus.continue_orbit(orbit, "load.force.amplitude", (0.01, 0.03))


def test_an_orbit_survives_a_store():
    """As a store of a diagram keeps it: the equations read back are those of several contacts, with
    equal solutions.
    """
    orbit = saltus.find_orbit(layers(H=0.2), theta_1=0.1, theta_2=0.0)
    again = from_json(as_json(orbit))
    np.testing.assert_array_equal(again.solution.unknowns, orbit.solution.unknowns)
    np.testing.assert_array_equal(again.multipliers, orbit.multipliers)
    assert again.signature == orbit.signature


def test_a_branch_and_its_orbits_survive_a_file(branch):
    again = orbits_of(branch.to_xarray())
    assert [orbit.signature for orbit in again] == [orbit.signature for orbit in branch.orbits]
    np.testing.assert_array_equal(again[3].solution.unknowns, branch.orbits[3].solution.unknowns)


def test_a_doubled_orbit_begins_at_a_period_doubling():
    orbit = saltus.find_orbit(
        room(A=0.5, W=1.0, e=0.9, stiffness=0.0, damping=0.02), x=0.1, velocity=0.9
    )
    symmetric = saltus.continue_orbit(orbit, "load.frequency", (0.3, 2.0))
    breaking = next(special for special in symmetric.special if special.kind == SpecialKind.BPC)
    branch = saltus.switch_branch(breaking, (0.3, 2.0))[0]
    doublings = [special for special in branch.special if special.kind == SpecialKind.PD]
    assert doublings
    (doubled,) = saltus.switch_branch(doublings[0], (0.3, 2.0))
    assert doubled.orbits[2].period == 2 * orbit.period
    assert doubled.orbits[2].defect < 1e-9


@pytest.mark.parametrize(
    ("ask", "error", "words"),
    [
        (
            lambda: saltus.find_orbit(
                layers(H=0.01, e=(0.3, 0.3)), theta_1=0.001, theta_2=0.0, settle=0, period=1
            ),
            MotionError,
            "held at contacts for good",
        ),
        (
            lambda: saltus.find_orbit(layers(H=0.01), theta_1=0.001, theta_2=0.0, settle=60),
            MotionError,
            "held at contacts for good",
        ),
    ],
)
def test_what_has_no_equations_is_refused_by_name(ask, error, words):
    with pytest.raises(error) as refused:
        ask()
    assert words in str(refused.value)


def test_curves_of_changes_of_events_of_whole_motions_are_refused_by_name():
    system = System(
        model=saltus.BeltOscillator(kinetic=0.2, static=0.2, damping=0.1, belt_speed=0.5),
        load=Load(frequency=1.3, force=Harmonic(amplitude=0.3)),
    )
    orbit = saltus.find_orbit(system, x=0.2, velocity=0.1)
    branch = saltus.continue_orbit(orbit, "load.force.amplitude", (0.2, 0.35))
    with pytest.raises(ParameterError, match="curves are followed from LP, PD"):
        saltus.continue_special(branch.special[0], "load.frequency", (0.9, 1.5))


@dataclass(frozen=True, kw_only=True)
class Pair(saltus.ContactModel):
    """Two equal masses between springs, of which the second one may hit a stop."""

    stop: float = 0.5
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        return (saltus.Contact(name="stop", coordinate="y", sign=-1, position=self.stop),)

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        return load.force(t) - 2.0 * x + y - 0.04 * u + 0.02 * v, x - y - 0.02 * v + 0.02 * u


def test_a_torus_is_born_where_a_complex_pair_leaves_the_circle_and_not_beside_grazings_or_at_real_pairs():
    """With four multipliers the product of all a b - 1 jumps at a grazing, and vanishes where a
    real pair has the product 1.
    """
    load = Load(frequency=0.52, force=Harmonic(amplitude=0.05))
    system = System(model=Pair(), load=load, impact=NewtonImpact(e=0.7))
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.0, y=0.0), "load.frequency", (0.5, 0.7)
    )
    tori = [point for point in branch.special if point.kind == SpecialKind.NS]
    assert [point.parameter for point in tori] == [pytest.approx(0.62554293, abs=1e-6)]
    assert min(abs(abs(m) - 1.0) for m in tori[0].orbit.multipliers if m.imag) < 1e-9
    assert any(point.kind == SpecialKind.GR for point in branch.special)
