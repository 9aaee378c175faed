"""Orbits of models whose contacts are distances and whose frictions have a rate: beside the same
models written with coordinates, DOP853, and differences along what is held.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from flow.test_held_rows import Ball, Block, Rotor, compared, rotor
from scipy.integrate import solve_ivp

import saltus
from saltus import Contact, Friction, Harmonic, Load, NewtonImpact, System
from saltus.errors import ParameterError
from saltus.flow import RowValues


@dataclass(frozen=True, kw_only=True)
class Stopped(saltus.ContactModel):
    """A mass before a stop, with a second mass on a spring to it."""

    damping: float = 0.1
    place: float = 0.4

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        return (Contact(name="stop", coordinate="x", position=self.place, sign=-1),)

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        pull = 0.3 * (y - x) + 0.05 * (v - u)
        return load.force(t) - x - self.damping * u + pull, -y - self.damping * v - pull


@dataclass(frozen=True, kw_only=True)
class StoppedAtADistance(Stopped):
    """The same with the distance from the stop."""

    @property
    def contacts(self):
        return (Contact(name="stop", distance="room"),)

    def room(self, t, q, load):
        return self.place - q[0]


@dataclass(frozen=True, kw_only=True)
class RubsOnAFloor(saltus.ContactModel):
    """A mass on a spring that a load lifts off a floor, on which it rubs."""

    friction: float = 0.1
    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force", "lift")
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="floor", coordinate="y"),)

    @property
    def frictions(self):
        return (Friction(name="rub", coordinate="x", kinetic=self.friction, contact="floor"),)

    def force(self, t, q, velocity, load):
        return load.force(t) - q[0] - self.damping * velocity[0], load.lift(t) - 1.0


@dataclass(frozen=True, kw_only=True)
class RubsAtADistance(RubsOnAFloor):
    """The same with a distance and a rate."""

    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="floor", distance="height"),)

    @property
    def frictions(self):
        return (Friction(name="rub", rate="speed", kinetic=self.friction, contact="floor"),)

    def height(self, t, q, load):
        return q[1]

    def speed(self, t, q, velocity, load):
        return velocity[0]


@dataclass(frozen=True, kw_only=True)
class TiedBlock(Block):
    """A block of two corners on a spring, so that its orbits do not lie beside one another."""

    stiffness: float = 0.3
    damping: float = 0.1

    def force(self, t, q, velocity, load):
        return load.push(t) - self.stiffness * q[0] - self.damping * velocity[0], -1.0, 0.0


PUSHED = Load(frequency=0.8, force=Harmonic(0.4))
LIFTED = Load(frequency=0.8, force=Harmonic(0.4), lift=Harmonic(0.9))


@pytest.mark.parametrize(
    ("models", "load", "e", "start", "path", "bounds", "kinds"),
    [
        (
            (Stopped(), StoppedAtADistance()),
            PUSHED,
            0.6,
            {"x": 0.1, "y": 0.0},
            "load.force.amplitude",
            (0.2, 0.41),
            {"GR", "PD", "NS"},
        ),
        (
            (RubsOnAFloor(), RubsAtADistance()),
            PUSHED,
            0.3,
            {"x": 0.1, "y": 0.1},
            "load.force.amplitude",
            (0.12, 0.41),
            {"CS"},
        ),
        (
            (RubsOnAFloor(), RubsAtADistance()),
            LIFTED,
            0.3,
            {"x": 0.1, "y": 0.1},
            "load.lift.amplitude",
            (0.9, 1.005),
            {"RL"},
        ),
    ],
)
def test_coordinates_and_distances_have_the_same_orbits(
    models, load, e, start, path, bounds, kinds
):
    one, other = (
        saltus.find_orbit(System(model=model, load=load, impact=NewtonImpact(e)), **start)
        for model in models
    )
    assert one.impact_count == other.impact_count
    np.testing.assert_allclose(other.extrema, one.extrema, atol=1e-12)
    np.testing.assert_allclose(other.multipliers, one.multipliers, atol=1e-9)
    assert other.stable == one.stable
    first, second = (saltus.continue_orbit(orbit, path, bounds) for orbit in (one, other))
    assert {str(point.kind) for point in first.special} == kinds
    assert [str(point.kind) for point in second.special] == [
        str(point.kind) for point in first.special
    ]
    for there, here in zip(second.special, first.special, strict=True):
        assert abs(there.parameter - here.parameter) < 1e-9
    assert [end.reason for end in second.ends] == [end.reason for end in first.ends]


def at_phase_0(orbit):
    """The state of an orbit at phase 0, by its own motion."""
    motion = orbit.motion(2)
    period = orbit.duration / orbit.period
    state = motion.at(period * math.ceil(motion.start / period))
    return np.concatenate([np.atleast_1d(part) for part in state])


ROCKING = System(
    model=TiedBlock(mu=0.9),
    load=Load(frequency=2.0, push=Harmonic(1.5)),
    impact=NewtonImpact(0.0),
)
RUBBING = rotor(e=0.3, speed=0.7, unbalance=1.0)


@pytest.mark.parametrize(
    ("system", "start", "e", "kinds"),
    [
        (ROCKING, {"x": 0.1, "y": 1.0, "tilt": 0.1}, 0.0, {"impact", "slip", "stick", "reversal"}),
        (RUBBING, {"x": 0.3, "y": 0.2}, 0.3, {"impact", "slip", "stick", "release", "held"}),
    ],
)
def test_an_orbit_is_a_motion_of_dop853_that_comes_back(system, start, e, kinds):
    orbit = saltus.find_orbit(system, **start)
    assert orbit.residual < 1e-13
    assert {str(event.kind) for event in orbit.followed.events} >= kinds
    state = at_phase_0(orbit)
    half = len(state) // 2
    names = system.model.coordinates
    motion = saltus.simulate(
        system,
        **dict(zip(names, state.tolist(), strict=False)),
        velocity=tuple(state[half:]),
        periods=orbit.period,
    )
    np.testing.assert_allclose(motion.final_state, state, atol=1e-12)
    instants, positions, speeds = compared(system, motion, e, 60)
    assert max(instants, positions, speeds) < 1e-11


def multipliers_of_chart(orbit, chart, numbers):
    """The eigenvalues of the map over a period in the numbers of a chart of what is held at its
    section, by central differences."""
    system = orbit.system
    half = len(system.model.coordinates)
    begin = orbit.start()["time"]

    def after(values):
        state = chart(values)
        motion = saltus.simulate(
            system,
            **dict(zip(system.model.coordinates, state[:half].tolist(), strict=True)),
            velocity=tuple(state[half:].tolist()),
            time=begin,
            periods=orbit.period,
        )
        return motion.final_state

    found = []
    for i in range(len(numbers)):
        ends = []
        for step in (1e-6, -1e-6):
            ends.append(after(numbers + step * np.eye(len(numbers))[i]))
        found.append((ends[0] - ends[1]) / 2e-6)
    back = np.linalg.pinv(
        np.stack(
            [
                (chart(numbers + 1e-6 * one) - chart(numbers - 1e-6 * one)) / 2e-6
                for one in np.eye(len(numbers))
            ],
            axis=1,
        )
    )
    return np.linalg.eigvals(back @ np.stack(found, axis=1))


def test_multipliers_of_a_rubbing_rotor_are_those_of_its_angle():
    """At the section it rubs on its stator: one angle and one speed are free, and there are two
    multipliers 0 besides."""
    orbit = saltus.find_orbit(RUBBING, x=0.3, y=0.2)
    state = orbit.solution.unknowns
    angle = math.atan2(state[1], state[0])
    assert orbit.signature.closed == 1
    assert abs(math.hypot(*state[:2]) - 1.0) < 1e-15

    def chart(values):
        c, s = np.cos(values[0]), np.sin(values[0])
        return np.array([c, s, -s * values[1], c * values[1]])

    speed = math.cos(angle) * state[3] - math.sin(angle) * state[2]
    expected = multipliers_of_chart(orbit, chart, np.array([angle, speed]))
    found = orbit.multipliers
    assert len(found) == 4
    expected = expected[np.argsort(-abs(expected))]
    np.testing.assert_allclose(found[0], expected[0], atol=1e-7)
    np.testing.assert_allclose(abs(found[1:]), 0.0, atol=1e-7)


def test_multipliers_of_a_rocking_block_are_those_of_its_free_coordinates():
    """At the section one corner slides: place, tilt and their speeds are free."""
    orbit = saltus.find_orbit(ROCKING, x=0.1, y=1.0, tilt=0.1)
    assert orbit.signature.closed in (1, 2)  # and no friction sticks
    side = -1.0 if orbit.signature.closed == 1 else 1.0
    block = ROCKING.model
    state = orbit.solution.unknowns

    def chart(values):
        x, tilt, u, w = values
        across, above = block.corner(tilt, side)
        return np.array([x, -above, tilt, u, -w * across, w])

    numbers = state[[0, 2, 3, 5]]
    np.testing.assert_allclose(chart(numbers), state, atol=1e-14)
    expected = multipliers_of_chart(orbit, chart, numbers)
    found = orbit.multipliers
    assert len(found) == 6
    # the eigenvalues' symmetric functions, as pairs of 0 are known to roots of rounding
    np.testing.assert_allclose(np.poly(found)[:5], np.poly(expected), atol=1e-6)
    np.testing.assert_allclose(np.poly(found)[5:], 0.0, atol=1e-9)


def test_reactions_of_a_table_that_slides_follow_from_statics():
    """Both feet of a table of weight 1 slide: with its height h over the feet and their distance 2 b
    one carries (1 - mu h / b) / 2, the other one the rest."""
    system = System(model=TiedBlock(mu=0.2), load=Load(), impact=NewtonImpact(0.0))
    values = RowValues(system)
    start = {"x": 0.0, "y": 0.8, "tilt": 0.0, "velocity": (0.5, 0.0, 0.0)}
    motion = saltus.simulate(system, **start, duration=0.2)
    time = np.array([0.1])
    position, velocity, side = motion.dense.states(time)
    states = np.concatenate([position, velocity]).T
    forces = values.forces_along(time, states, motion.dense.accelerations(time).T, side)
    share = 0.2 * 0.8 / 0.5
    np.testing.assert_allclose(forces[0, :2], [(1 - share) / 2, (1 + share) / 2], atol=1e-12)
    assert np.isnan(forces[0, 2:]).all()  # no friction sticks


def test_of_feet_that_stick_together_the_sum_is_known():
    """A push f < mu on a block of weight 1 that stands on two feet: their shares are not known, mu - f
    and mu + f are."""
    system = System(
        model=TiedBlock(mu=0.3, stiffness=0.0),
        load=Load(frequency=0.8, push=0.1),
        impact=NewtonImpact(0.0),
    )
    values = RowValues(system)
    motion = saltus.simulate(system, x=0.0, y=0.8, tilt=0.0, velocity=0.0, duration=1.0)
    state = np.array([[0.0, 0.8, 0.0, 0.0, 0.0, 0.0]])
    side = np.array([1 + 3 + (1 << 2) + (1 << 4)])  # both closed, both stick
    forces = values.forces_along(np.array([0.5]), state, np.zeros((1, 3)), side)
    np.testing.assert_allclose(sum(forces[0, :2]), 1.0, atol=1e-12)
    assert np.isnan(forces[0, 2:6]).all()
    np.testing.assert_allclose(np.sort(forces[0, 6:]), [0.2, 0.4], atol=1e-12)
    assert motion.stop == "rest"


@pytest.mark.parametrize(
    ("system", "start"),
    [(ROCKING, {"x": 0.1, "y": 1.0, "tilt": 0.1}), (RUBBING, {"x": 0.3, "y": 0.2})],
)
def test_energies_of_orbits_are_balanced(system, start):
    """The surface of the stator turns, and supplies energy while it rubs and in impacts."""
    found = saltus.energies(saltus.find_orbit(system, **start))
    assert abs(found.defect) < 1e-12
    taken = found.energy.values[found.role.values == "dissipated"]
    assert taken.min() > 1e-3
    assert ("ground.impacts" in found.part.values) == (system is RUBBING)


def test_impacts_on_a_shaken_table_take_what_the_law_of_restitution_says():
    """(1 - e^2) / 2 times the squares of the relative speeds, which the table's motion is part of."""
    e, frequency, amplitude = 0.8, 2.0, 0.4
    load = Load(frequency=frequency, ground=Harmonic(amplitude))
    system = System(model=Ball(), load=load, impact=NewtonImpact(e=e))
    motion = saltus.simulate(system, y=0.8, velocity=0.0, periods=2)
    found = saltus.energies(motion, periods=2)
    impacts = motion.impacts
    assert {str(event.kind) for event in motion.events} == {"impact"}  # no accumulation
    assert len(impacts) > 2
    ground = amplitude * frequency * np.cos(frequency * impacts.time)
    speeds = np.ravel(impacts.velocity_before) - ground
    expected = 0.5 * (1.0 - e**2) * float(speeds @ speeds)
    by_part = dict(zip(found.part.values.tolist(), found.energy.values.tolist(), strict=True))
    assert abs(by_part["impact.table"] - expected) < 1e-10 * expected
    # the impulses are those of the law, and the table moves at its own speed
    supplied = (1.0 + e) * float(-speeds @ ground)
    assert abs(by_part["ground.impacts"] - supplied) < 1e-10
    assert abs(found.defect) < 1e-12


def test_coordinates_and_distances_have_the_same_energies():
    load = Load(frequency=0.8, force=Harmonic(0.4), lift=Harmonic(1.5))
    one, other = (
        saltus.energies(
            saltus.find_orbit(
                System(model=model, load=load, impact=NewtonImpact(0.3)), x=0.1, y=0.1
            )
        )
        for model in (RubsOnAFloor(), RubsAtADistance())
    )
    assert one.part.values.tolist() == other.part.values.tolist()
    np.testing.assert_allclose(other.energy, one.energy, atol=1e-12)


def test_symmetries_of_distances_are_refused():
    with pytest.raises(ParameterError, match="is_symmetric does not follow contacts of a distance"):
        saltus.orbits.is_symmetric(RUBBING)


# --- a reaction that reaches 0 ---


def least_reaction(system, time, state):
    """The least reaction on a rotor that stays at its stator, over the last of eight forcing
    periods from a state: by DOP853 in its angle, from reversal to reversal of what it rubs along.
    """
    model = system.model
    load = system.load
    period = 2.0 * math.pi / load.frequency

    def reaction_and_bend(t, angle, rate, way):
        outward = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-np.sin(angle), np.cos(angle)])
        force = np.array(model.force(t, outward, rate * along, load))
        reaction = force @ outward + rate**2
        return reaction, force @ along - model.mu * way * reaction

    def rates(t, state, way):
        return [state[1], reaction_and_bend(t, *state, way)[1]]

    def reverses(t, state, way):
        return state[1] + model.surface

    reverses.terminal = True
    x, y, u, v = state
    state = np.array([math.atan2(y, x), x * v - y * u])
    least = math.inf
    for number in range(8):
        end = time + period
        while time < end:
            way = np.sign(reverses(time, state, 0.0)) or 1.0
            found = solve_ivp(
                rates,
                (time, end),
                state,
                "DOP853",
                args=(way,),
                events=reverses,
                dense_output=True,
                rtol=1e-12,
                atol=1e-13,
            )
            if number == 7:
                times = np.linspace(time, found.t[-1], 1001)
                for _ in range(2):
                    values = [reaction_and_bend(t, *found.sol(t), way)[0] for t in times.tolist()]
                    least = min(least, *values)
                    inner = np.clip(np.argmin(values), 1, len(times) - 2)
                    times = np.linspace(times[inner - 1], times[inner + 1], 201)
            time = found.t[-1]
            # just beyond the reversal, whose speed is 0 to within rounding
            turned = rates(time, found.y[:, -1], way)[1] if time < end else 0.0
            state = found.y[:, -1] + np.array([0.0, 1e-13 * np.sign(turned)])
    return least


@pytest.mark.parametrize("frequency", [0.9428, pytest.param(0.9429, marks=pytest.mark.thorough)])
def test_a_branch_goes_on_where_a_reaction_on_a_curved_wall_reaches_0(frequency):
    """Beyond it the rotor leaves its stator for as short a time as one likes. Begun from either
    side, the change is where the least reaction of the motion without it is 0.
    """

    def pulled(frequency):
        load = Load(frequency=frequency, pull_x=Harmonic(0.7), pull_y=Harmonic(0.0))
        return System(model=Rotor(), load=load, impact=NewtonImpact(e=0.5))

    orbit = saltus.find_orbit(pulled(frequency), x=0.3, y=0.2, velocity=(0.5, -0.4))
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.9428, 0.9429))
    assert [end.reason.name for end in branch.ends] == ["BOUND", "BOUND"]
    (special,) = branch.special
    assert special.kind == "RL"
    start = special.orbit.motion()
    state = np.concatenate(start.at(start.start))
    before, after = (
        least_reaction(pulled(special.parameter + apart), start.start, state)
        for apart in (-1e-5, 1e-5)
    )
    assert before > 0.0 > after
    assert before + after == pytest.approx(0.0, abs=1e-3 * before)
