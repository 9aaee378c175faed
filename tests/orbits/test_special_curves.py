"""Curves of special points in two parameters: against closed forms, against one-parameter branches,
and through cusps.
"""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar

import numpy as np
import pytest
from shared_systems import walled

import saltus
from saltus import SpecialCurve
from saltus.orbits import SpecialPoint
from saltus.orbits.beyond import conditions
from saltus.orbits.beyond.conditions import normal_form
from saltus.orbits.beyond.orbit_curve import OrbitCurve
from saltus.orbits.branches.special_curve import SpecialCurvePoint
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.theory.impact_oscillator import wall_orbits

FREQUENCY, AMPLITUDE, VERTICAL, FORCE = (
    "load.frequency",
    "load.horizontal.amplitude",
    "load.vertical",
    "load.force.amplitude",
)
FREE = math.sqrt(1.0 - 0.1**2 / 4)  # frequency of the free oscillator below


def metainterface(frequency: float, amplitude: float, vertical: float = -0.5) -> saltus.System:
    return saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(
            frequency=frequency, horizontal=saltus.Harmonic(amplitude=amplitude), vertical=vertical
        ),
    )


@cache
def wall_special(kind: str) -> SpecialPoint:
    """A special point of the impact oscillator's branch along the load's amplitude."""
    system = walled(0.5, 0.7, e=0.6) if kind == "PD" else walled(0.5, 1.0)
    if kind == "PD":
        family = wall_orbits(system)
        speed = 1.3 * family.doubling_speed
        system = system.with_({FORCE: family.amplitude(speed)})
        state = family.orbit(speed).state(0.0)
        orbit = saltus.find_orbit(
            system, x=float(state[0]), velocity=float(state[1]), settle=0, period=1
        )
    else:
        orbit = saltus.find_orbit(system, x=0.0, velocity=0.0)
    branch = saltus.continue_orbit(orbit, FORCE, (0.05, 0.9))
    return next(s for s in branch.special if s.kind == kind)


@cache
def wall_locus(kind: str) -> SpecialCurve:
    bounds = (0.67, 0.95) if kind == "PD" else (0.6, 1.99)
    return saltus.continue_special(wall_special(kind), FREQUENCY, bounds, first_bounds=(0.01, 6.0))


@cache
def resonance_fold() -> SpecialPoint:
    """One of the two folds of the resonance at Hhat = 0.5."""
    orbit = saltus.find_orbit(metainterface(0.9, 0.5), theta=0.3)
    branch = saltus.continue_orbit(orbit, FREQUENCY, (0.8, 1.0))
    return next(s for s in branch.special if s.kind == "LP")


@cache
def folds() -> SpecialCurve:
    """The curve of folds through it, in the load's frequency and amplitude."""
    return saltus.continue_special(
        resonance_fold(), AMPLITUDE, (0.05, 1.2), first_bounds=(0.3, 2.0)
    )


@cache
def low_frequency_special(kind: str) -> SpecialPoint:
    orbit = saltus.find_orbit(metainterface(0.29, 0.5), theta=0.3)
    branch = saltus.continue_orbit(orbit, FREQUENCY, (0.282, 0.3))
    return next(s for s in branch.special if s.kind == kind)


@cache
def low_frequency(kind: str) -> SpecialCurve:
    """Curves through the special points about the change from two to six crossings at Hhat =
    0.5.
    """
    return saltus.continue_special(
        low_frequency_special(kind), AMPLITUDE, (0.3, 0.6), first_bounds=(0.18, 0.4)
    )


def closed_form(point: SpecialCurvePoint, kind: str) -> float:
    family = wall_orbits(point.orbit.system)
    if kind == "GR":
        return float(family.grazing_amplitude)
    speed = family.fold_speed if kind == "LP" else family.doubling_speed
    return float(family.amplitude(speed or 0.0))


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["GR", "LP", "PD"])
def test_curves_of_the_impact_oscillator_are_the_closed_forms(kind: str) -> None:
    locus = wall_locus(kind)
    assert len(locus.points) > 15
    assert np.ptp(locus.parameters[:, 1]) > 0.1
    expected = [closed_form(point, kind) for point in locus.points]
    np.testing.assert_allclose(locus.parameters[:, 0], expected, rtol=2e-11)


@pytest.mark.parametrize("kind", ["GR", "LP"])
def test_folds_end_at_the_grazing_where_the_free_motion_takes_whole_half_periods(kind: str) -> None:
    """There v+ = e v- cannot change where the linear motion touches: alpha of the closed form
    vanishes.
    """
    found = {round(2 * FREE / s.parameters[1]): s for s in wall_locus(kind).special}
    assert set(found) >= ({2, 3} if kind == "GR" else {2})
    for halves, special in found.items():
        assert special.kind == ("LP-PD-GR" if kind == "GR" else "LP-GR")
        frequency = 2 * FREE / halves
        assert special.parameters[1] == pytest.approx(frequency, rel=1e-10)
        assert special.parameters[0] == pytest.approx(
            abs(complex(1 - frequency**2, 0.1 * frequency)), rel=1e-10
        )
        assert special.evidence.before * special.evidence.after < 0


def test_both_folds_of_the_resonance_lie_on_one_curve_through_a_cusp() -> None:
    locus = folds()
    assert [s.kind for s in locus.special] == ["CP"]
    for amplitude, known in (
        (0.5, [0.848485265597, 0.908810732539]),
        (1.0, [0.811772145949, 0.995113422444]),
    ):
        assert sorted(o.frequency for o in locus.at(AMPLITUDE, amplitude)) == pytest.approx(
            known, abs=2e-12
        )
    assert [str(end) for end in locus.ends] == [f"bound {AMPLITUDE} = 1.2"] * 2


@pytest.mark.parametrize(("beyond", "count"), [(0.004, 2), (-0.001, 0)])
def test_a_branch_has_two_folds_on_one_side_of_the_cusp_and_none_on_the_other(
    beyond: float, count: int
) -> None:
    cusp = folds().special[0]
    orbit = saltus.find_orbit(metainterface(0.9, cusp.parameters[1] + beyond), theta=0.3)
    branch = saltus.continue_orbit(orbit, FREQUENCY, (cusp.parameters[0] - 0.02, 0.91))
    found = sorted(s.parameter for s in branch.special if s.kind == "LP")
    assert len(found) == count
    there = sorted(o.frequency for o in folds().at(AMPLITUDE, cusp.parameters[1] + beyond))
    assert there == pytest.approx(found, abs=1e-10)


def test_onset_of_the_motion_follows_the_vertical_load() -> None:
    """The curve of onsets in the vertical load, against a branch along that load at an amplitude a
    little larger.
    """
    orbit = saltus.find_orbit(metainterface(1.0, 0.05), theta=0.1)
    branch = saltus.continue_orbit(orbit, AMPLITUDE, (0.015, 0.06))
    onset = next(s for s in branch.special if s.kind == "LP")
    assert onset.parameter == pytest.approx(0.0219879514, abs=1e-10)
    locus = saltus.continue_special(onset, VERTICAL, (-0.9, -0.4))
    beside = saltus.continue_orbit(branch.at(0.0222)[0], VERTICAL, (-0.9, -0.4))
    folds_there = [s.parameter for s in beside.special if s.kind == "LP"]
    assert len(folds_there) == 1
    assert [o.system.get(VERTICAL) for o in locus.at(AMPLITUDE, 0.0222)] == pytest.approx(
        folds_there, abs=1e-9
    )
    assert locus.at(AMPLITUDE, 0.0222)[0].defect < 1e-10


@pytest.mark.parametrize(("curve", "multiplier"), [("folds", 1), ("BPC", 1), ("PD", -1), ("LP", 1)])
def test_every_point_is_an_orbit_with_its_multiplier(curve: str, multiplier: int) -> None:
    locus = (
        folds() if curve == "folds" else wall_locus("PD") if curve == "PD" else low_frequency(curve)
    )
    last = len(locus.points) - 1
    for index, point in enumerate(locus.points):
        assert point.residual < 1e-10
        assert point.orbit.admissible
        if 0 < index < last:  # at a grazing multipliers are infinite
            assert np.abs(point.orbit.multipliers - multiplier).min() < 1e-7


def test_every_point_of_a_grazing_curve_touches() -> None:
    locus = low_frequency("GR")
    assert len(locus.points) > 20
    for point in locus.points[::5]:
        orbit, touching = point.orbit, point.touching
        assert orbit.admissible
        assert abs(orbit.slowest) < 1e-14
        assert np.ptp(point.solution.unknowns[::2][touching]) < 1e-12
        motion, when = orbit.motion(), orbit.impact_times[touching[0]]
        theta, velocity = motion.at(
            when if when > orbit.impact_times[0] else when + 0.5 * orbit.duration
        )
        assert abs(theta) < 1e-10
        assert abs(velocity) < 1e-6


def test_folds_and_symmetry_breakings_of_six_crossings_end_at_one_point_of_the_grazing_curve() -> (
    None
):
    known = [s for s in low_frequency("GR").special if s.kind == "LP-BPC-GR"]
    for kind in ("LP", "BPC"):
        meeting = max(
            (s for s in low_frequency(kind).special if s.kind == f"{kind}-GR"),
            key=lambda s: s.parameters[0],
        )
        assert min(math.dist(meeting.parameters, s.parameters) for s in known) < 1e-11


def shift_of_the_broken_family(point: SpecialCurvePoint, distance: float) -> float:
    """How far in the first parameter the unsymmetric orbit lies that differs by a distance from a
    symmetric one at its BPC.
    """
    direction = point.condition_value.right / np.linalg.norm(point.condition_value.right)
    problem, unknowns = point.orbit.equations.over_full_period(point.solution.unknowns)
    direction = np.concatenate([direction, -direction])
    curve = OrbitCurve(
        OneContactEquations(point.orbit.system, problem.signature, (FREQUENCY,)), (1.0,)
    )
    guess = np.append(unknowns + distance * direction, point.solution.values[0])
    broken = curve.solve(guess, np.append(direction, 0.0))
    assert broken is not None
    return broken.parameter - float(point.solution.values[0])


def test_the_unsymmetric_orbits_change_sides_at_a_degenerate_symmetry_breaking() -> None:
    locus = low_frequency("BPC")
    degenerate = min(
        (s for s in locus.special if s.kind == "DBPC"), key=lambda s: abs(s.parameters[0] - 0.2421)
    )
    place = int(np.argmin(np.abs(locus.parameters - degenerate.parameters).sum(axis=1)))
    shifts = [
        [shift_of_the_broken_family(locus.points[place + k], d) / d**2 for d in (2e-3, 4e-3)]
        for k in (-2, 2)
    ]
    assert np.sign(shifts[0]) == pytest.approx(-np.sign(shifts[1]))
    forms = [normal_form(locus.points[place + k]) for k in (-2, 2)]
    ratio = [form / shift[0] for form, shift in zip(forms, shifts, strict=True)]
    assert ratio[0] * ratio[1] > 0  # the sign of the normal form says the side


def test_the_normal_form_does_not_depend_on_the_step_where_phases_respond_strongly(
    monkeypatch,
) -> None:
    """At Omega = 0.1 a small change of the speeds moves the phases of the impacts by radians."""
    orbit = saltus.find_orbit(
        metainterface(0.1, 0.0324, -1.38), theta=-1.1171, velocity=-0.0569, settle=0
    )
    flip = next(
        s
        for s in saltus.continue_orbit(orbit, AMPLITUDE, (0.0315, 0.035)).special
        if s.kind == "PD"
    )
    curve = saltus.continue_special(flip, VERTICAL, bounds=(-1.4, -1.36), first_bounds=(0.0, 0.035))
    assert not curve.special
    usual = np.array([normal_form(point) for point in curve.points])
    monkeypatch.setattr(
        conditions, "SETTINGS", replace(conditions.SETTINGS, long_shift=1e-3, farthest=5e-4)
    )
    shorter = np.array([normal_form(point) for point in curve.points])
    known = np.isfinite(shorter)
    assert np.abs(usual).max() > 1e4 * np.abs(usual).min()
    assert known.sum() > 0.9 * len(usual)
    assert usual[known] == pytest.approx(shorter[known], rel=0.5)  # the sign is what counts


def test_there_is_no_normal_form_where_the_equations_are_singular() -> None:
    """Exactly singular, as they are where a curve comes to loads of zero: no codimension-two point
    is looked for there.
    """
    point = low_frequency("BPC").points[3]
    evaluation = point.evaluation
    singular = replace(
        evaluation, here=np.zeros_like(evaluation.here), there=np.zeros_like(evaluation.there)
    )
    assert math.isfinite(normal_form(point))
    assert math.isnan(normal_form(replace(point, evaluation=singular)))


@pytest.mark.thorough
def test_a_fold_of_symmetric_orbits_goes_on_without_the_symmetry() -> None:
    fold = resonance_fold()
    assert fold.orbit.symmetric
    locus = saltus.continue_special(
        fold, "model.stiffness_ratio", (0.98, 1.02), first_bounds=(0.5, 1.5)
    )
    assert [end.parameter for end in locus.ends] == [0.98, 1.02]
    assert [o.frequency for o in locus.at("model.stiffness_ratio", 1.0)] == pytest.approx(
        [fold.parameter], abs=1e-11
    )
    assert not locus.orbits[0].symmetric


def test_a_curve_keeps_all_in_its_dataset() -> None:
    locus = folds()
    data = locus.to_xarray()
    np.testing.assert_array_equal(data.parameter, locus.parameters)
    assert list(data.path.values) == [FREQUENCY, AMPLITUDE]
    assert data.special_kind.values.tolist() == ["CP"]
    system = saltus.System.from_json(data.attrs["system"])
    signature = locus.orbits[0].signature
    np.testing.assert_array_equal(data.sides, [signature.sides] * len(locus.points))
    again = OneContactEquations(system, signature, (FREQUENCY, AMPLITUDE)).evaluate(
        data.unknowns.values[3], data.parameter.values[3]
    )
    assert again is not None
    assert np.abs(again.residual).max() < 1e-12


@pytest.mark.parametrize(
    ("path", "options", "says"),
    [
        (FREQUENCY, {}, "name another parameter"),
        ("load.horizontal.amplitud", {}, "no parameter 'load.horizontal.amplitud'"),
        ("load.horizontal", {}, "not a number"),
        (AMPLITUDE, {"bounds": (2.0, 3.0)}, "widen it"),
        (AMPLITUDE, {"first_bounds": (1.0, 0.1)}, "the smaller one first"),
    ],
)
def test_bad_use_is_answered_with_a_sentence(path: str, options: dict, says: str) -> None:
    with pytest.raises(saltus.ParameterError, match=says):
        saltus.continue_special(resonance_fold(), path, **options)


def test_a_symmetry_breaking_needs_the_symmetry() -> None:
    special = low_frequency_special("BPC")
    with pytest.raises(saltus.ParameterError, match="takes away the mirror symmetry"):
        saltus.continue_special(special, "model.stiffness_ratio")


@dataclass(frozen=True, kw_only=True)
class WallOfSeveral(saltus.ContactModel):
    """x'' + c x' + x = F(t) below a wall at 1, as a model with several contacts."""

    damping: float = 0.1
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (saltus.Contact(name="wall", coordinate="x", sign=-1, position=1.0),)

    def force(self, t, x, v, load):
        return load.force(t) - x - self.damping * v


def test_the_curve_of_a_grazing_with_several_contacts_is_that_of_the_linear_motion():
    """F = d sqrt((1 - W^2)^2 + (c W)^2); its witness is the gap."""
    load = saltus.Load(frequency=0.7, force=saltus.Harmonic(0.4, phase=np.pi / 2))
    system = saltus.System(model=WallOfSeveral(), load=load, impact=saltus.NewtonImpact(0.6))
    orbit = saltus.find_orbit(system, x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.5, 0.9))
    (grazing,) = (point for point in branch.special if point.kind == "GR")
    assert grazing.evidence.witness == "gap of wall"
    curve = saltus.continue_special(
        grazing, "load.force.amplitude", (0.2, 0.6), first_bounds=(0.4, 1.4)
    )
    w, amplitude = curve.parameters.T
    assert np.ptp(amplitude) == pytest.approx(0.4)
    assert amplitude == pytest.approx(np.hypot(1 - w**2, 0.1 * w), abs=1e-12)


def test_curves_of_changes_of_two_stops_lead_through_those_of_their_branches():
    """Branches begun at other amplitudes have their GR and SW on the curves, which reach both bounds:
    an impact's reaction and the rest after it vanish together all along a curve of SW.
    """
    model = saltus.TwoStops(left=-0.8, right=0.5, stiffness=1.0, damping=0.1)
    load = saltus.Load(frequency=1.2, force=saltus.Harmonic(0.7))
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(0.0))

    def branch_at(amplitude):
        other = system.with_({"load.force.amplitude": amplitude})
        orbit = saltus.find_orbit(other, x=0.0)
        return saltus.continue_orbit(orbit, "load.frequency", (1.1, 1.8))

    changes = [point for point in branch_at(0.7).special if point.kind in ("GR", "SW")]
    expected = {
        amplitude: [point for point in branch_at(amplitude).special if point.kind in ("GR", "SW")]
        for amplitude in (0.68, 0.71)
    }
    assert {str(point.kind) for point in changes} == {"GR", "SW"}
    for point in changes:
        curve = saltus.continue_special(
            point, "load.force.amplitude", (0.67, 0.72), first_bounds=(1.0, 2.0)
        )
        assert not curve.special
        for amplitude, beside in expected.items():
            (there,) = curve.at("load.force.amplitude", amplitude)
            nearest = min(
                abs(other.parameter - there.frequency)
                for other in beside
                if other.kind == point.kind
            )
            assert nearest < 1e-8


@dataclass(frozen=True, kw_only=True)
class VanDerPol(saltus.ContactModel):
    """x'' = F - x + (mu - x^2) x'."""

    mu: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = ()

    def force(self, t, x, v, load):
        return load.force(t) - x + (self.mu - x**2) * v


def test_a_curve_of_tori_is_where_areas_neither_grow_nor_shrink() -> None:
    """The product of both multipliers is exp of the integral of mu - x^2 over a period (Liouville):
    a complex pair lies on the circle where x^2 has the mean mu, by SciPy's integration.
    """
    from scipy.integrate import solve_ivp

    load = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.3))
    system = saltus.System(model=VanDerPol(), load=load)
    branch = saltus.continue_orbit(saltus.find_orbit(system, x=0.0), FORCE, (0.1, 0.35))
    (torus,) = branch.special
    assert torus.kind == "NS"
    curve = saltus.continue_special(torus, FREQUENCY, (1.06, 1.4), first_bounds=(0.05, 1.0))
    assert sorted(curve.parameters[[0, -1], 1]) == [1.06, 1.4]
    for point in curve.points[:: max(1, len(curve.points) // 6)]:
        amplitude, frequency = point.parameters

        def rates(t, y, amplitude=amplitude, frequency=frequency):
            x, v, _ = y
            return v, amplitude * np.sin(frequency * t) - x + (0.2 - x * x) * v, x * x

        period = 2.0 * math.pi / frequency
        begin = [point.orbit.x, point.orbit.velocity, 0.0]
        end = solve_ivp(rates, (0.0, period), begin, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        np.testing.assert_allclose(end[:2], begin[:2], atol=1e-9)
        assert end[2] / period == pytest.approx(0.2, abs=1e-9)
        assert abs(point.orbit.multipliers.imag).min() > 1e-3
