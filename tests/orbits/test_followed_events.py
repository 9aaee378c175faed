"""Where an event of a followed orbit appears or is lost: closed forms, direct motions beside it,
the engine for one contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, pi, sin
from typing import ClassVar

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus
from saltus.orbits import OrbitEnd, solved_near
from saltus.orbits.equations.whole_motion import WholeMotionEquations


def belt(frequency: float, amplitude: float = 1.0, **numbers: float) -> saltus.System:
    """A mass on a belt under a harmonic force."""
    model = saltus.BeltOscillator(
        **({"kinetic": 0.2, "static": 0.2, "damping": 0.1, "belt_speed": 0.5} | numbers)
    )
    return saltus.System(
        model=model,
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=amplitude)),
    )


def kinds_of(branch: saltus.Branch) -> list[str]:
    return [str(point.kind) for point in branch.special]


@pytest.fixture(scope="module")
def over_frequency() -> saltus.Branch:
    """From motions that slide all the time through all four changes and back."""
    orbit = saltus.find_orbit(belt(1.3), x=0.2, velocity=0.1)
    return saltus.continue_orbit(orbit, "load.frequency", (0.2, 3.0))


@pytest.fixture(scope="module")
def standing() -> saltus.Branch:
    """On ground that stands still, down to motions that stick six times a period."""
    orbit = saltus.find_orbit(
        belt(0.3, kinetic=0.4, static=0.4, belt_speed=0.0), x=0.2, velocity=0.1
    )
    return saltus.continue_orbit(orbit, "load.frequency", (0.15, 1.5))


def test_a_stick_appears_where_the_sliding_motion_reaches_the_speed_of_the_belt(
    over_frequency: saltus.Branch,
) -> None:
    """Grazing-sliding, where w = Omega F / abs(k - Omega^2 + i c Omega): that motion is a linear
    oscillator's.
    """
    expected = [
        brentq(lambda x: x / hypot(1.0 - x**2, 0.1 * x) - 0.5, *between, xtol=1e-14)
        for between in ((0.2, 0.9), (1.1, 3.0))
    ]
    found = [point for point in over_frequency.special if point.kind == "GS"]
    assert [point.parameter for point in found] == pytest.approx(expected, abs=1e-9)
    assert all(point.evidence.bracket < 1e-8 for point in found)


def test_a_stick_is_lost_where_den_hartogs_motion_would_stand_still(
    standing: saltus.Branch,
) -> None:
    """Crossing-sliding: at its turning points the force on the mass is all that friction can
    bear.
    """

    def reserve(frequency: float) -> float:
        """abs(F(t) - x) - mu at the turning point of the motion that never sticks, solved for half
        a period.
        """
        mu, c, half = 0.4, 0.1, pi / frequency
        rate = np.roots([1.0, c, 1.0])

        def forced(t: float, cosine: float, sine: float, order: int) -> complex:
            amplitude = (cosine - 1j * sine) / (1.0 - frequency**2 + 1j * c * frequency)
            return amplitude * (1j * frequency) ** order * np.exp(1j * frequency * t)

        def row(t: float, order: int) -> np.ndarray:  # free motion, F = cosine cos + sine sin
            parts = [(forced(t, 1, 0, order)).real, (forced(t, 0, 1, order)).real]
            return np.array([*(rate**order * np.exp(rate * t)), *parts, 0.0], dtype=complex)

        rows = [row(0, 0), row(0, 1), row(half, 0), row(half, 1)]
        rows[0][4], rows[2][4] = -1.0, 1.0  # from the largest value to the least one
        matrix = np.array(rows)
        # v < 0 on the way, so that friction pushes with +mu and moves the middle by mu
        right = np.array([-mu, 0.0, -mu, 0.0], dtype=complex)
        one = np.linalg.lstsq(matrix, right, rcond=None)[0]
        kernel = np.linalg.svd(matrix)[2][-1].conj()
        kernel = kernel / kernel[4]
        b = brentq(lambda s: hypot(*(one + s * kernel)[2:4].real) - 1.0, 0.0, 20.0, xtol=1e-15)
        solved = (one + b * kernel).real
        return abs(solved[2] - solved[4]) - mu

    expected = brentq(reserve, 0.5, 0.65, xtol=1e-14)
    (point,) = (point for point in standing.special if point.kind == "CS")
    assert abs(point.parameter - expected) < 1e-9


def test_at_each_change_the_motion_is_on_the_border_that_its_name_says(
    over_frequency: saltus.Branch,
) -> None:
    """The mass has the belt's speed with a force that friction can just bear, but for grazings,
    where it has no acceleration.
    """
    for point in over_frequency.special:
        motion, frequency = point.orbit.motion(tol=1e-14), point.parameter
        times = np.linspace(motion.start, motion.time, 20001)
        x, v = motion.at(times)
        force = np.sin(frequency * times) - 0.1 * v - x
        if point.kind == "GS":
            assert abs((0.5 - v).min()) < 1e-7
        else:
            events = [
                event.time for event in motion.events if str(event.kind) in ("stick", "reversal")
            ]
            there = [
                np.sin(frequency * t) - 0.1 * motion.at(t)[1] - motion.at(t)[0] for t in events
            ]
            assert min(abs(abs(f) - 0.2) for f in there) < 1e-7, point
        assert np.abs(force).max() > 0.2


def sequence(
    system: saltus.System, orbit: saltus.PeriodicOrbit, settle: int
) -> list[tuple[str, int]]:
    """The events of the last period of a motion that has settled from an orbit nearby, from any one
    of them on.
    """
    start = orbit.start()
    motion = saltus.simulate(system, **start, periods=settle, tol=1e-13, dense=False)
    position, velocity = np.atleast_1d(motion.position), motion.velocity
    names = dict(zip(system.model.coordinates, position.tolist(), strict=True))
    last = saltus.simulate(
        system, **names, velocity=velocity, time=motion.time, periods=orbit.period, tol=1e-13
    )
    closings = [event.time for event in last.events if str(event.kind) in ("impact", "held")]
    kinds = [str(event.kind) for event in last.events]
    if closings and "held" in kinds:
        kinds = [kind for kind in kinds if kind != "impact"]
    kinds = [kind for kind in kinds if kind != "rest"]
    return min((kinds[i:] + kinds[:i] for i in range(len(kinds))), default=[])


@pytest.mark.parametrize("case", ["over_frequency", "standing"])
def test_direct_motions_have_other_events_on_both_sides(
    case: str, request: pytest.FixtureRequest
) -> None:
    """A share of 1e-5 below and above each point, after 60 periods."""
    branch = request.getfixturevalue(case)
    assert {"GS", "CS"} <= set(kinds_of(branch))
    for point in branch.special:
        beside = [
            sequence(
                point.orbit.system.with_({"load.frequency": point.parameter * (1.0 + s * 1e-5)}),
                point.orbit,
                60,
            )
            for s in (-1, 1)
        ]
        assert beside[0] != beside[1], point


def test_all_four_sliding_bifurcations_are_named(
    over_frequency: saltus.Branch, standing: saltus.Branch
) -> None:
    """By what appears or is lost: a stick, a reversal that becomes a stick, a reversal before a
    stick, a slip within a stick.
    """
    assert kinds_of(over_frequency) == ["GS", "SS", "CS", "CS", "SS", "GS"]
    assert kinds_of(standing) == ["GS", "AS", "CS"]
    assert [str(end) for end in over_frequency.ends] == ["bound 0.2", "bound 3"]


def test_within_a_stick_a_slip_appears_where_the_force_just_reaches_what_friction_bears(
    standing: saltus.Branch,
) -> None:
    """Adding-sliding: beside it the largest force during the stick is mu N, where it has an
    extremum.
    """
    (point,) = (point for point in standing.special if point.kind == "AS")
    motion, frequency = point.orbit.motion(tol=1e-14), point.parameter
    marks = [
        (str(event.kind), event.time)
        for event in motion.events
        if str(event.kind) in ("stick", "slip")
    ]
    inner = []
    for (kind, begin), (_, end) in pairwise(marks):
        if kind == "stick":
            peaks = (np.arange(8) + 0.5) * pi / frequency  # where sin(Omega t) is largest or least
            inner += [
                abs(abs(sin(frequency * t) - motion.at(t)[0]) - 0.4)
                for t in peaks
                if begin < t < end
            ]
        else:
            inner += [
                abs(abs(sin(frequency * begin) - motion.at(begin)[0]) - 0.4)
                + abs(cos(frequency * begin))
            ]
    assert min(inner) < 1e-7


def test_where_static_friction_is_larger_a_stick_that_is_lost_ends_the_branch() -> None:
    """What just comes to the speed of its ground would stay for long: motions beside it part, and
    the end says so.
    """
    system = belt(0.3, kinetic=0.4, static=0.4, belt_speed=0.0)
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.2, velocity=0.1), "model.kinetic", (0.02, 0.4)
    )
    (pitchfork,) = branch.special
    assert pitchfork.kind == "BPC"
    assert np.abs(pitchfork.orbit.multipliers).max() == pytest.approx(1.0, abs=1e-9)
    born = saltus.switch_branch(pitchfork, (0.02, 0.4))
    assert len(born) == 2
    one, other = (new.orbits[-1] for new in born)
    assert one.highest == pytest.approx(-other.lowest, abs=1e-6)  # mirror images
    for new in born:
        (point,) = new.special
        assert point.kind == "GS"
        assert new.ends[1].reason is OrbitEnd.NOT_CONTINUOUS
        motion = point.orbit.motion(tol=1e-14)
        decelerations = []
        for event in motion.events:
            if str(event.kind) == "stick":
                x, _ = motion.at(event.time)
                decelerations.append(abs(abs(sin(0.3 * event.time) - x) - point.parameter))
        # it grows as the square root of the distance, which is 1e-11
        assert min(decelerations) < 1e-4


def test_a_rest_without_duration_is_where_the_engine_for_one_contact_has_it() -> None:
    """With that kind; beyond it another branch begins, with impacts that do not die away."""
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=1.5, mean=1.0))
    law, numbers = saltus.VelocityReduction(0.4), {"stiffness": 0.2, "damping": 0.1}
    wall = saltus.System(model=saltus.WallOscillator(wall=0.0, **numbers), load=load, impact=law)
    stops = saltus.System(
        model=saltus.TwoStops(left=-50.0, right=0.0, **numbers),
        load=load,
        impact=saltus.NewtonImpact(e=0.4),
    )
    expected, found = (
        saltus.continue_orbit(saltus.find_orbit(system, x=-0.5), "load.force.amplitude", (1.3, 3.0))
        for system in (wall, stops)
    )
    assert kinds_of(found)[0] == kinds_of(expected)[0] == "CH"
    assert abs(found.special[0].parameter - expected.special[0].parameter) < 1e-8
    assert found.ends[1].parameter == found.special[0].parameter
    (beyond,) = saltus.switch_branch(found.special[0], (1.3, 3.0))
    assert beyond.ends[1].parameter == 3.0


def both_layers(amplitude: float) -> saltus.System:
    """Both layers with a restitution of 0.5."""
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1, mass_ratio=0.2)
    load = saltus.Load(
        frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=amplitude)
    )
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.5))


@pytest.fixture(scope="module")
def layers() -> saltus.Branch:
    """A branch over the releases of both layers up to where impacts die away only as the next
    release comes, and beyond it.
    """
    orbit = saltus.find_orbit(both_layers(0.4), theta_1=0.1, theta_2=0.0)
    return saltus.continue_orbit(orbit, "load.horizontal.amplitude", (0.15, 0.869264))


@pytest.mark.thorough
def test_beyond_where_impacts_die_away_they_are_lost_one_by_one_at_distances_that_grow_as_the_restitution_says() -> (
    None
):
    """Each impact of an accumulation is `e` times as fast as the one before it, so that each fold
    beyond the end of the accumulation is 1/e times as far from it as the one before; and folds,
    doublings and grazings come in turn up to the bound."""
    orbit = saltus.find_orbit(both_layers(0.4), theta_1=0.1, theta_2=0.0)
    branch = saltus.continue_orbit(orbit, "load.horizontal.amplitude", (0.35, 0.9))
    end = branch.special[-1]
    (beyond,) = saltus.switch_branch(end, (0.35, 0.9))
    assert [branch.ends[0].parameter, beyond.ends[1].parameter] == [0.35, 0.9]
    others = beyond.special
    kinds = [str(point.kind) for point in (end, *others)]
    # how near to the end the first of them is depends on the smallest impacts that are followed
    turns = len(kinds) // 3 - 1
    assert turns >= 9
    assert kinds[:-2] == ["CH", *(["LP", "PD", "GR"] * turns)]
    folds = np.array([point.parameter - end.parameter for point in others if point.kind == "LP"])
    assert np.abs(folds[1:6] / folds[:5] - 2.0).max() < 0.02


@pytest.mark.thorough
def test_along_both_layers_releases_appear(layers: saltus.Branch) -> None:
    """Direct motions beside each point differ."""
    assert kinds_of(layers) == ["SW", "SW", "RL", "CH"]
    rests = [orbit for orbit in layers.orbits if orbit.signature.section is not None]
    assert max(orbit.defect for orbit in rests[::6]) < 1e-9
    for point in layers.special:
        at = [point.parameter * (1.0 + s * 1e-5) for s in (-1, 1)]
        beside = [
            sequence(point.orbit.system.with_({"load.horizontal.amplitude": a}), point.orbit, 80)
            for a in at
        ]
        assert beside[0] != beside[1], point


@pytest.mark.parametrize(
    "case", ["over_frequency", pytest.param("layers", marks=pytest.mark.thorough)]
)
def test_sections_move_away_from_events(case: str, request: pytest.FixtureRequest) -> None:
    """Along a branch an event would come to the phase at which the state is given."""
    branch = request.getfixturevalue(case)
    assert len({orbit.signature.section for orbit in branch.orbits}) > 1
    assert max(orbit.residual for orbit in branch.orbits) < 1e-9
    again = saltus.orbits.orbits_of(branch.to_xarray())
    assert [orbit.signature.section for orbit in again] == [
        orbit.signature.section for orbit in branch.orbits
    ]


@pytest.fixture(scope="module")
def bouncing() -> saltus.PeriodicOrbit:
    """Both layers with a light lower mass: each closes once a period, with impacts that die away,
    while the other one is held.
    """
    model = saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1, mass_ratio=0.01)
    load = saltus.Load(frequency=0.5, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.5))
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.5))
    return saltus.find_orbit(system, theta_1=0.1, theta_2=-0.05, velocity=(0.0, 0.0))


def test_the_section_lies_in_the_middle_of_the_longest_time_between_events(
    bouncing: saltus.PeriodicOrbit,
) -> None:
    """And not between two impacts, where alone both layers are open: one of these soon comes to it
    along a branch.
    """
    motion = bouncing.motion()
    phases = np.sort(
        np.array([event.time for event in motion.events]) * bouncing.frequency % (2 * pi)
    )
    gaps = np.diff([*phases, phases[0] + 2 * pi])
    apart = np.abs((phases - bouncing.signature.section + pi) % (2 * pi) - pi).min()
    assert apart == pytest.approx(0.5 * gaps.max(), rel=1e-9)


@pytest.mark.thorough
def test_where_the_section_lies_between_held_layers_a_branch_goes_on_with_it(
    bouncing: saltus.PeriodicOrbit,
) -> None:
    """No event comes to it between the bounds."""
    branch = saltus.continue_orbit(bouncing, "load.frequency", (0.4, 0.6))
    assert [str(end) for end in branch.ends] == ["bound 0.4", "bound 0.6"]
    assert len({orbit.signature.section for orbit in branch.orbits}) == 1
    assert max(orbit.defect for orbit in branch.orbits[::8]) < 1e-9


def test_a_state_beside_a_section_at_which_a_layer_is_held_has_events(
    bouncing: saltus.PeriodicOrbit,
) -> None:
    """A layer that is open by a little comes to rest by impacts as the first events of all: their
    list could not be read.
    """
    problem, unknowns = bouncing.equations, bouncing.solution.unknowns
    assert isinstance(problem, WholeMotionEquations)
    held = problem.held(unknowns, bouncing.system)
    assert len(held) == 2  # a coordinate and its velocity
    for place in held:
        for step in (-1e-6, 1e-6):
            beside = unknowns.copy()
            beside[place] += step
            equations = problem.evaluate(beside, problem.values, with_extremes=True)
            assert equations is None or equations.events is not None


@pytest.fixture(scope="module")
def turning(bouncing: saltus.PeriodicOrbit) -> tuple[saltus.Branch, saltus.Branch]:
    """A branch that turns round three times where a layer at its contact is just left, from both of
    its ends.
    """
    system, bounds = bouncing.system.with_({"load.frequency": 0.2665}), (0.265, 0.285)
    motion = saltus.simulate(
        system, theta_1=0.1, theta_2=-0.05, velocity=(0.0, 0.0), periods=300, dense=False
    )
    orbit = solved_near(system, "load.frequency", np.append(motion.position, motion.velocity), 1)
    assert orbit is not None
    ahead = saltus.continue_orbit(orbit, "load.frequency", bounds)
    return ahead, saltus.continue_orbit(ahead.orbits[-6], "load.frequency", bounds, step=0.06)


def slowest_first_impact(orbit: saltus.PeriodicOrbit) -> float:
    """The least speed of the first impacts after others have died away."""
    events = list(orbit.motion(tol=1e-14).events)
    pairs = [
        (first, second)
        for first, second in pairwise(events)
        if (str(first.kind), str(second.kind)) == ("held", "impact")
    ]
    return min(float(np.abs(second.velocity_before).max()) for _, second in pairs)


def where_the_impact_vanishes(branch: saltus.Branch, beside: float) -> tuple[float, float]:
    """The frequency towards which the slowest first impact of orbits of a branch loses its speed,
    and by how much it may be off.

    The frequency as a polynomial of degree 5 of that speed, extrapolated from eight orbits; one of
    degree 4 differs by 7e-11. The orbits lie 1e-4 to 1e-3 above the change: nearer to it
    multipliers are above 1e5, and rounding moves a speed by 1e-9.
    """
    frequencies = beside + np.linspace(1e-4, 1e-3, 8)
    speeds = [min(map(slowest_first_impact, branch.at(frequency))) for frequency in frequencies]
    fits = [np.polynomial.Polynomial.fit(speeds, frequencies, degree) for degree in (4, 5)]
    lower, higher = (float(fit(0.0)) for fit in fits)
    return higher, abs(higher - lower)


@pytest.mark.thorough
def test_a_change_towards_which_multipliers_grow_without_end_is_gone_through_from_both_sides(
    turning: tuple[saltus.Branch, saltus.Branch],
) -> None:
    """An impact vanishes in proportion to the way, by which orbits farther on tell where. Orbits so
    near repel so strongly that rounding keeps their residual large: the bracket, which is twice the
    way that they tell, says how far the last one is from the change."""
    ahead, back = turning
    for branch in turning:
        assert kinds_of(branch) == ["SW", "SW", "SW", "PD"]
        assert [str(end) for end in branch.ends] == ["bound 0.265", "bound 0.285"]
        assert not branch.missed
    for one, other in zip(ahead.special, back.special, strict=True):
        assert (
            abs(one.parameter - other.parameter)
            <= one.evidence.bracket + other.evidence.bracket + 1e-11
        )
    last = back.special[2]
    assert last.evidence.bracket < 1e-10
    for branch in turning:
        expected, doubt = where_the_impact_vanishes(branch, 0.267966)
        assert doubt < 2e-10
        assert abs(last.parameter - expected) < last.evidence.bracket + doubt
        bracket = ahead.special[2].evidence.bracket
        assert abs(ahead.special[2].parameter - expected) < bracket + doubt < 1e-6


@pytest.mark.thorough
def test_orbits_of_twice_the_period_end_where_a_change_of_their_parent_bears_them(
    turning: tuple[saltus.Branch, saltus.Branch],
) -> None:
    """They went on along the parent gone round twice, down to a change of that."""
    doubling = turning[0].special[3]
    (born,) = saltus.switch_branch(doubling, (0.265, 0.285))
    assert born.ends[1].reason is OrbitEnd.IMAGE
    change = turning[1].special[2]
    (last,) = (point for point in born.special if point.kind == "SW" and point.parameter < 0.27)
    assert abs(last.parameter - change.parameter) < last.evidence.bracket < 1e-4
    assert born.special[-1].orbit.period == 1


@dataclass(frozen=True, kw_only=True)
class Ledge(saltus.ContactModel):
    """A mass on a spring along a tilted ledge of a structure, with friction in their contact."""

    coordinates: ClassVar[tuple[str, ...]] = ("z", "x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (saltus.Contact(name="ledge", coordinate="y"),)
    frictions = (saltus.Friction(name="rub", coordinate="x", kinetic=0.2, contact="ledge"),)

    def mass_matrix(self, q):
        along, across = 0.1 * cos(0.5), -0.1 * sin(0.5)
        return [[1.1, along, across], [along, 0.1, 0.0], [across, 0.0, 0.1]]

    def force(self, t, q, velocity, load):
        spring = load.force(t) - q[0] - 0.05 * velocity[0]
        return spring, -0.03 * sin(0.5) - 0.05 * q[1], -0.03 * cos(0.5)


@pytest.mark.thorough
def test_a_branch_ends_by_name_where_sliding_stops_just_as_impacts_die_away():
    load = saltus.Load(frequency=1.01, force=saltus.Harmonic(0.05))
    system = saltus.System(model=Ledge(), load=load, impact=saltus.NewtonImpact(e=0.4))
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, z=0.0, x=0.0, y=0.0), "load.frequency", (1.009, 1.02)
    )
    (end,) = [end for end in branch.ends if end.reason is OrbitEnd.TURNS]
    assert end.parameter == max(branch.parameters)

    def slip(orbit):
        (held,) = [event for event in orbit.motion().events if event.kind == "held"]
        return held.velocity_after[1]

    slips, apart = (
        np.array([f(orbit) for orbit in branch.orbits])
        for f in (slip, lambda o: end.parameter - o.frequency)
    )
    assert np.abs(slips[np.argmin(apart)]) < 1e-4
    # before, it slides on until it stops at a reversal after the impacts, later the farther
    far = apart > 1e-4
    assert (slips[far] < 0.0).all()
    assert (np.diff(slips[far][np.argsort(apart[far])]) < 0.0).all()
