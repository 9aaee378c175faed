"""Orbits with contacts or dry friction that are their own mirror images: half a period, and where
the symmetry breaks.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus
from saltus.continuation import CurveEnd
from saltus.orbits import OrbitEnd

FORCE = "load.force.amplitude"
LOAD = "load.horizontal.amplitude"


def room(amplitude: float, e: float = 0.7) -> saltus.System:
    """A free mass between walls at -1 and 1 under A cos(tau)."""
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=amplitude, phase=pi / 2))
    return saltus.System(
        model=saltus.TwoStops(stiffness=0.0), load=load, impact=saltus.NewtonImpact(e=e)
    )


def leaving(amplitude: float, e: float) -> tuple[float, float]:
    """Speed and phase at which the left wall is left by the motion with one impact at each wall a
    period, in closed form.
    """
    a = -(1 - e) / (2 * e * amplitude)  # sin phi = a v
    b, c = 1.0 / amplitude, -pi / (2 * amplitude) + pi * a / 2  # cos phi = b + c v
    v = float(np.roots([a * a + c * c, 2 * b * c, b * b - 1.0])[0].real)
    return v, atan2(a * v, b + c * v)


def half_map(amplitude: float, e: float) -> np.ndarray:
    """The derivative of the map of phase and speed from leaving one wall to leaving the other,
    mirrored.
    """
    v, phi = leaving(amplitude, e)
    u, s, slope = v / e, pi, amplitude * cos(phi)
    g = -2 * amplitude * sin(phi) - s * slope
    return np.array(
        [[1 - g / u, -s / u], [e * (slope * g / u - 2 * slope), e * (1 + slope * s / u)]]
    )


def state_at_zero(amplitude: float, e: float) -> tuple[float, float]:
    """The state of that motion at phase 0."""
    v, phi = leaving(amplitude, e)
    turns = int(np.floor(-phi / pi))
    s, sign = -(phi + turns * pi), (-1) ** turns
    x = -1 + v * s + amplitude * (cos(phi) - cos(s + phi)) - amplitude * s * sin(phi)
    return sign * x, sign * (v + amplitude * (sin(s + phi) - sin(phi)))


@pytest.fixture(scope="module")
def between_walls() -> saltus.Branch:
    """The symmetric motions with two impacts a period."""
    x, velocity = state_at_zero(0.8, 0.7)
    orbit = saltus.find_orbit(room(0.8), x=x, velocity=velocity, settle=0, period=1)
    return saltus.continue_orbit(orbit, FORCE, (0.6, 0.9))


def test_half_a_period_has_the_map_of_the_closed_form(between_walls: saltus.Branch) -> None:
    """Its multipliers, squared, and its speeds, all along the branch."""
    for orbit in between_walls.orbits[::4]:
        amplitude = orbit.system.get(FORCE)
        assert orbit.symmetric
        assert (len(orbit.signature.events), orbit.signature.impact_count) == (1, 2)
        assert 0.7 * orbit.speeds == pytest.approx([leaving(amplitude, 0.7)[0]] * 2, abs=1e-10)
        expected = np.sort_complex(np.linalg.eigvals(half_map(amplitude, 0.7)) ** 2)
        assert np.abs(np.sort_complex(orbit.multipliers[:2]) - expected).max() < 1e-9
        assert orbit.defect < 1e-9


def test_the_symmetry_breaks_where_the_half_map_has_the_multiplier_minus_one(
    between_walls: saltus.Branch,
) -> None:
    """Named as such, and two mirror images are born, which end there again when they are followed
    back.
    """
    expected = brentq(lambda a: np.linalg.det(half_map(a, 0.7) + np.eye(2)), 0.65, 0.8, xtol=1e-14)
    (point,) = (special for special in between_walls.special if special.kind == "BPC")
    assert abs(point.parameter - expected) < 1e-10
    assert not any(
        special.kind == "LP" and abs(special.parameter - expected) < 1e-3
        for special in between_walls.special
    )
    born = saltus.switch_branch(point, (0.6, 0.9))
    assert len(born) == 2
    first, second = (branch.orbits[min(8, len(branch.orbits) - 1)] for branch in born)
    assert not first.symmetric
    assert second.period == 1
    (image,) = born[1].at(first.system.get(FORCE))
    # from the left wall to the right one
    spans = [np.diff(orbit.impact_times)[0] for orbit in (first, image)]
    assert abs(spans[0] - pi) > 1e-3
    assert sum(spans) == pytest.approx(2 * pi, abs=1e-8)
    # as the force has no mean, both walls push alike
    assert first.speeds[0] == pytest.approx(first.speeds[1], abs=1e-12)
    back = saltus.continue_orbit(first, FORCE, (0.6, 0.9))
    ends = [end for end in back.ends if end.reason is OrbitEnd.IMAGE]
    assert [(end.kind, end.parameter) for end in ends] == [
        ("BPC", pytest.approx(expected, abs=1e-9))
    ]
    assert not any(
        special.kind == "LP" and abs(special.parameter - expected) < 1e-6
        for special in back.special
    )


def test_the_breaking_of_the_symmetry_in_load_and_restitution_is_the_closed_form(
    between_walls: saltus.Branch,
) -> None:
    """All along the curve: there the half map, which depends on both, has the multiplier -1."""
    (point,) = (special for special in between_walls.special if special.kind == "BPC")
    curve = saltus.continue_special(point, "impact.e", (0.5, 0.9), first_bounds=(0.05, 2.0))
    assert [end.parameter for end in curve.ends] == [0.5, 0.9]
    assert len(curve.points) > 20
    for there in curve.points:
        amplitude, e = there.parameters
        assert abs(np.linalg.det(half_map(amplitude, e) + np.eye(2))) < 1e-12
        assert there.orbit.symmetric
    again = saltus.orbits.orbits_of(curve.to_xarray())
    assert [orbit.solution.unknowns.tolist() for orbit in again] == [
        orbit.solution.unknowns.tolist() for orbit in curve.orbits
    ]


def leaving_without_speed(amplitude: float) -> float:
    """The phase at which a wall that takes all speed is left at once by the stable motion from wall
    to wall, in closed form.

    A free mass that leaves the left wall at the phase phi is at the right one half a period later
    if 2 cos(phi) - pi sin(phi) = 2 / A, which has two solutions between -pi/2 and 0 that meet at A
    = 2 / sqrt(4 + pi^2).
    """
    fold = -atan2(pi, 2.0)
    return brentq(
        lambda phi: 2 * cos(phi) - pi * sin(phi) - 2 / amplitude, -pi / 2, fold, xtol=1e-15
    )


def test_motions_that_leave_walls_without_speed_fold_stick_and_graze_where_the_closed_form_does() -> (
    None
):
    """The wall that a half begins at is the image of the one that it ends at: this one is left by
    the force, or holds.

    The fold as above; the force at the impact vanishes where phi = -pi/2, and the speed of the
    impact where phi = 0.
    """
    phi = leaving_without_speed(0.6)
    x, velocity = -1 + 0.6 * (cos(phi) - 1 + phi * sin(phi)), -0.6 * sin(phi)
    orbit = saltus.find_orbit(room(0.6, e=0.0), x=x, velocity=velocity, settle=0, period=1)
    assert orbit.symmetric
    assert orbit.multipliers[0] == pytest.approx((pi / 2 / np.tan(-phi)) ** 2, abs=1e-10)
    branch = saltus.continue_orbit(orbit, FORCE, (0.4, 1.2))
    found = sorted((float(special.parameter), str(special.kind)) for special in branch.special)
    expected = [(2 / sqrt(4 + pi**2), "LP"), (2 / pi, "SW"), (1.0, "GR")]
    assert [kind for _, kind in found] == [kind for _, kind in expected]
    assert [place for place, _ in found] == pytest.approx(
        [place for place, _ in expected], abs=1e-10
    )
    # without an impact the mass may move anywhere between the walls
    assert [end.reason for end in branch.ends] == [OrbitEnd.NOT_ISOLATED, CurveEnd.BOUND]
    assert branch.ends[0].parameter == pytest.approx(1.0, abs=1e-10)
    for other in branch.orbits:
        # that which touches a wall at phase 0 can be started there, too
        assert other.grazes or other.defect < 1e-9
        assert np.isfinite(other.defect)


def test_mirror_layers_are_followed_over_half_a_period() -> None:
    """The layers swap; the orbit and its multipliers are those over the full period."""
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1)
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.5))
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.0))
    assert saltus.orbits.is_symmetric(system)
    assert not saltus.orbits.is_symmetric(system.with_({"model.mass_ratio": 0.1}))
    orbit = saltus.find_orbit(system, theta_1=0.1, theta_2=0.0)
    assert orbit.symmetric
    assert orbit.highest == pytest.approx(-orbit.lowest, rel=1e-14)
    motion = orbit.motion(tol=1e-14)
    assert orbit.highest == pytest.approx(
        np.abs(motion.at(np.linspace(motion.start, motion.time, 40001))[0]).max(), abs=1e-7
    )
    start = motion.start
    first, later = motion.at(start), motion.at(start + pi)
    for one, other in zip(first, later, strict=True):
        assert one == pytest.approx(-other[::-1], abs=1e-11)


def layers(frequency: float, amplitude: float) -> saltus.System:
    """Both layers, which the mirror swaps."""
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1)
    load = saltus.Load(
        frequency=frequency, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=amplitude)
    )
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.0))


@pytest.fixture(scope="module")
def mirrored() -> saltus.Branch:
    """The layers from small loads to large ones."""
    return saltus.continue_orbit(
        saltus.find_orbit(layers(1.0, 0.1), theta_1=0.1, theta_2=0.0), LOAD, (0.02, 0.9)
    )


@pytest.fixture(scope="module")
def breaking() -> saltus.Branch:
    """The layers under a slower load, where the symmetry breaks."""
    return saltus.continue_orbit(
        saltus.find_orbit(layers(0.5, 0.5), theta_1=0.3, theta_2=0.0), LOAD, (0.1, 0.5)
    )


def test_both_halves_switch_together(mirrored: saltus.Branch) -> None:
    """At a grazing or a switching of a symmetric orbit it stays one."""
    assert all(orbit.symmetric for orbit in mirrored.orbits)
    assert {"GR", "SW", "LP"} <= {str(point.kind) for point in mirrored.special}
    assert len({len(orbit.signature.events) for orbit in mirrored.orbits}) >= 4
    for point in mirrored.special:
        assert point.evidence.bracket < 1e-10


def test_every_orbit_of_a_branch_of_both_layers_is_a_motion(mirrored: saltus.Branch) -> None:
    """By direct simulation: no contact stays closed that an impact of the other layer opens.

    At the grazing of small loads the motions beside it have such an impact at once, which throws
    the closed layer open.
    """
    # At a grazing itself rounding decides whether the motion has an impact there, and at a
    # switching itself whether a contact opens just before an impact or with it; `defect` may be inf
    # at both.
    between = [o for o in mirrored.orbits if not o.grazes and abs(o.pressing) > 1e-9]
    assert len(between) > 0.8 * len(mirrored.orbits)
    for orbit in between:
        assert orbit.defect < 1e-10 * (1 + np.abs(orbit.multipliers).max())
    assert mirrored.ends[0].reason is OrbitEnd.TWO_AT_ONCE


def test_where_the_layers_lose_their_symmetry_two_branches_begin(breaking: saltus.Branch) -> None:
    """The full-period equations are singular there: a multiplier is 1, and no fold is meant."""
    (point,) = (special for special in breaking.special if special.kind == "BPC")
    assert point.orbit.multipliers[0] == pytest.approx(1.0, abs=1e-9)
    for branch in saltus.switch_branch(point, (0.1, 0.2)):
        assert not branch.orbits[-1].symmetric
        assert max(orbit.residual for orbit in branch.orbits) < 1e-9


@pytest.mark.parametrize(
    ("name", "kind", "start"),
    [pytest.param("mirrored", "LP", 0.1, marks=pytest.mark.thorough), ("breaking", "BPC", 0.2)],
)
def test_special_points_of_the_layers_lie_on_their_curves(
    name: str, kind: str, start: float, request: pytest.FixtureRequest
) -> None:
    """A branch at another vertical load, of orbits found there, has its own where the curve of the
    first one's is.
    """
    (point,) = (
        special for special in request.getfixturevalue(name).special if special.kind == kind
    )
    curve = saltus.continue_special(point, "load.vertical", (-0.505, -0.495))
    (there,) = curve.at("load.vertical", -0.498)
    assert there.defect < 1e-10
    near = there.system.get(LOAD)
    settled = saltus.find_orbit(there.system.with_({LOAD: start}), theta_1=0.3, theta_2=0.0)
    branch = saltus.continue_orbit(settled, LOAD, sorted((start, near + 0.01 * (near - start))))
    assert (
        min(abs(special.parameter - near) for special in branch.special if special.kind == kind)
        < 1e-11
    )


def test_a_curve_ends_where_its_orbits_graze(mirrored: saltus.Branch) -> None:
    """Named as both at once, with an orbit that has the multiplier 1 and touches a layer."""
    (fold,) = (special for special in mirrored.special if special.kind == "LP")
    curve = saltus.continue_special(fold, "load.frequency", (0.6, 1.1))
    (both,) = curve.special
    assert (both.kind, curve.ends[0].reason) == ("LP-GR", OrbitEnd.MEETS_GRAZING)
    assert abs(both.orbit.multipliers[0] - 1.0) < 1e-6
    assert min(both.orbit.slowest, both.orbit.clearance) == pytest.approx(0.0, abs=1e-12)


def test_friction_on_ground_that_stands_still_keeps_the_symmetry() -> None:
    """Over half a period as over the full one; a moving belt has no symmetry."""
    model = saltus.BeltOscillator(kinetic=0.4, static=0.4, damping=0.1, belt_speed=0.0)
    system = saltus.System(
        model=model, load=saltus.Load(frequency=0.3, force=saltus.Harmonic(amplitude=1.0))
    )
    orbit = saltus.find_orbit(system, x=0.2, velocity=0.1)
    assert orbit.symmetric
    assert not saltus.orbits.is_symmetric(system.with_({"model.belt_speed": 0.1}))
    problem, values, step = orbit.equations, orbit.solution.values, 1e-6
    along = saltus.continue_orbit(orbit, "load.frequency", (0.29, 0.31)).orbits[0]
    unknowns, values = along.solution.unknowns, along.solution.values
    ahead, behind = (
        along.equations.evaluate(unknowns, values + s * step).residual for s in (1, -1)
    )
    assert (
        np.abs((ahead - behind) / (2 * step) - along.solution.evaluation.parameters[:, 0]).max()
        < 1e-6
    )
    assert problem.signature.span == 0.5
    assert orbit.defect < 1e-11
