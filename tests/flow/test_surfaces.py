"""Switching surfaces: motions, derivatives, ensembles and orbits, against closed forms and an
independent integrator.
"""

import dataclasses
import itertools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import Contact, NewtonImpact, Surface
from saltus.flow import sensitivities, simulate, simulate_many
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class SoftStop(ContactModel):
    """A mass x with a soft stop at d (spring and damper, whose force jumps) and a mass y on a
    bilinear spring to it.
    """

    stop: float = 0.5
    stiffness: float = 20.0
    damping: float = 0.3
    mass: float = 0.6

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def surfaces(self):
        apart = {"y": 1.0, "x": -1.0}
        return Surface(name="stop", coordinate="x", position=self.stop), Surface(
            name="tight", coordinate=apart, position=0.8
        )

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, self.mass]]

    def force(self, t, q, velocity, load, sides):
        pressed, tight = (1.0 + sides.stop) / 2.0, (1.0 + sides["tight"]) / 2.0
        pull = q[1] - q[0] + tight * 2.0 * (q[1] - q[0] - 0.8)
        back = pressed * (self.stiffness * (q[0] - self.stop) + self.damping * velocity[0])
        return load.force(t) - 0.1 * velocity[0] - q[0] - back + pull, -pull - 0.05 * velocity[1]


SOFT = System(model=SoftStop(), load=Load(frequency=0.9, force=Harmonic(0.7)))


def by_dop853(end):
    """The state of SOFT at the end and the times of its crossings, by SciPy's DOP853 from one event
    to the next.
    """
    state, t, sides, times = np.zeros(4), 0.0, [-1.0, -1.0], []

    def rates(t, z, pressed, tight):
        pull = z[1] - z[0] + (1 + tight) * (z[1] - z[0] - 0.8)
        back = (1 + pressed) / 2 * (20.0 * (z[0] - 0.5) + 0.3 * z[2])
        first = 0.7 * math.sin(0.9 * t) - 0.1 * z[2] - z[0] - back + pull
        return [z[2], z[3], first, (-pull - 0.05 * z[3]) / 0.6]

    def at_stop(t, z, *_):
        return z[0] - 0.5

    def at_tight(t, z, *_):
        return z[1] - z[0] - 0.8

    at_stop.terminal = at_tight.terminal = True
    while t < end:
        at_stop.direction, at_tight.direction = -sides[0], -sides[1]
        found = solve_ivp(
            rates,
            (t, end),
            state,
            "DOP853",
            rtol=1e-13,
            atol=1e-14,
            events=(at_stop, at_tight),
            args=(*sides,),
        )
        t, state = found.t[-1], found.y[:, -1]
        for i in range(2):
            if found.t_events[i].size:
                sides[i] = -sides[i]
                times.append(t)
    return state, np.array(times), sides


def test_a_soft_stop_with_two_coordinates_moves_as_dop853_with_events_says():
    motion = simulate(SOFT, x=0.0, y=0.0, duration=40.0)
    state, times, sides = by_dop853(40.0)
    assert {str(event.kind) for event in motion.events} == {"crossing"}
    assert {event.contact for event in motion.events} == {"stop", "tight"}
    assert len(motion.events) == times.size > 30
    np.testing.assert_allclose(motion.events.times, times, rtol=0, atol=1e-11)
    np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-11)
    assert list(motion.sides.values()) == sides
    data = motion.to_xarray()
    inside = np.abs(data.x - 0.5) > 1e-9
    np.testing.assert_array_equal(
        data.side_stop.values[inside], np.sign(data.x - 0.5).values[inside]
    )


def test_derivatives_jump_with_the_field_alone():
    paths = ("model.stop", "model.stiffness", "model.mass", "load.frequency")
    given = {"x": 0.1, "y": 0.3, "velocity": (0.2, 0.1), "periods": 4}
    found, step, columns, times = sensitivities(SOFT, parameters=paths, **given), 1e-6, [], []
    for j in range(4 + len(paths)):
        pair = []
        for sign in (step, -step):
            at = np.array([0.1, 0.3, 0.2, 0.1]) + sign * (np.arange(4) == j)
            system = SOFT if j < 4 else SOFT.with_({paths[j - 4]: SOFT.get(paths[j - 4]) + sign})
            motion = simulate(
                system, **{**given, "x": at[0], "y": at[1], "velocity": tuple(at[2:])}
            )
            pair.append((motion.final_state, motion.events.times))
        columns.append((pair[0][0] - pair[1][0]) / (2 * step))
        times.append((pair[0][1] - pair[1][1]) / (2 * step))
    assert len(found.motion.events) > 15
    np.testing.assert_allclose(
        np.hstack([found.state, found.parameters]), np.array(columns).T, rtol=0, atol=1e-7
    )
    np.testing.assert_allclose(found.event_times, np.array(times).T, rtol=0, atol=1e-7)
    # M is constant, so that volumes shrink by the damping alone, wherever it acts
    pressed = (
        found.motion.to_xarray(np.linspace(0.0, found.motion.time, 400_001)).side_stop.values > 0
    )
    rate = 0.1 + 0.05 / 0.6 + 0.3 * pressed.mean()
    assert found.determinant == pytest.approx(math.exp(-rate * found.motion.time), rel=1e-4)


def test_motions_in_lanes_pass_the_same_surfaces():
    x = np.linspace(0.0, 0.8, 6)
    many = simulate_many(SOFT, x=x, y=0.3, periods=5)
    for i in range(6):
        one = simulate(SOFT, x=float(x[i]), y=0.3, periods=5)
        np.testing.assert_allclose(
            [many.x.values[i], many.y.values[i]], one.position, rtol=0, atol=1e-11
        )
    # on whichever side of the stop, and whichever kernel ended it, it is not at rest
    assert many.side.values.tolist() == [1] * 6


def test_orbits_of_a_soft_stop_are_found_and_followed():
    orbit = saltus.find_orbit(SOFT, x=0.0, y=0.0)
    assert orbit.stable
    assert orbit.defect < 1e-12
    motion = orbit.motion()
    assert len(motion.events) == 6
    tangent = sensitivities(SOFT, **orbit.start(), periods=1)
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers),
        np.sort_complex(np.linalg.eigvals(tangent.state)),
        atol=1e-9,
    )
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.88, 0.92))
    assert max(point.orbit.residual for point in branch.points) < 1e-11
    assert abs(saltus.energies(orbit).defect) < 1e-12


def test_a_branch_goes_on_where_crossings_appear_beside_its_section():
    """With the section there no step would lead on: the new crossings are nearer to it than orbits
    may have events. At the touches where they appear nothing happens: where a surface has no speed,
    the forces on both sides are equal, as that of the stop is 20 (x - d) + 0.3 x' beyond it, and
    that of the bilinear spring 2 (y - x - 0.8).
    """
    near = {"x": -0.959, "y": -0.762, "velocity": (-1.372, 0.459)}
    orbit = saltus.find_orbit(SOFT.with_({"load.frequency": 1.00074}), **near, settle=0, period=1)
    branch = saltus.continue_orbit(orbit, "load.frequency", (1.0, 1.0008))
    assert [str(end.reason.code) for end in branch.ends] == ["bound", "bound"]
    assert {len(orbit.motion().events) for orbit in branch.orbits[::10]} == {6, 8}
    assert sorted(str(point.kind) for point in branch.special) == ["LP", "NS"]
    assert max(point.defect for point in branch.special) < 1e-10
    for kind, measured in (
        ("LP", lambda values: np.abs(values - 1.0).min()),
        ("NS", lambda values: np.abs(np.abs(values) - 1).min()),
    ):
        (point,) = [each for each in branch.special if each.kind == kind]
        tangent = sensitivities(point.orbit.system, **point.orbit.start(), periods=1)
        assert measured(np.linalg.eigvals(tangent.state)) < 1e-6


@dataclass(frozen=True, kw_only=True)
class Backlash(ContactModel):
    """Two equal masses whose spring acts where abs(y - x) > b: r'' = -2 k (r -+ b) there, and r'' =
    0 between.
    """

    room: float = 0.25
    stiffness: float = 8.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")

    @property
    def surfaces(self):
        apart = {"y": 1.0, "x": -1.0}
        right = Surface(name="right", coordinate=apart, position=self.room)
        return right, Surface(name="left", coordinate={"x": 1.0, "y": -1.0}, position=self.room)

    def force(self, t, q, velocity, load, sides):
        apart, right, left = q[1] - q[0], (1.0 + sides.right) / 2.0, (1.0 + sides.left) / 2.0
        pull = self.stiffness * (right * (apart - self.room) + left * (apart + self.room))
        return pull, -pull


def test_a_backlash_pair_follows_its_piecewise_linear_closed_form():
    motion = simulate(
        System(model=Backlash()), x=0.0, y=0.0, velocity=(-0.2, 0.8), duration=150.0, tol=1e-15
    )
    # across the room with the speed 1, and half a period of sqrt(2 k) = 4
    free, pressed = 2 * 0.25 / 1.0, math.pi / 4.0
    times = np.cumsum(
        [free / 2, *itertools.islice(itertools.cycle((pressed, free)), len(motion.events) - 1)]
    )
    assert len(motion.events) > 200
    np.testing.assert_allclose(motion.events.times, times, rtol=0, atol=1e-11)
    assert [event.contact for event in motion.events[:5]] == [
        "right",
        "right",
        "left",
        "left",
        "right",
    ]
    np.testing.assert_allclose((motion.x + motion.y) / 2, 0.3 * 150.0, rtol=0, atol=1e-11)


def model_of(force, surfaces, contacts=(), names=("x",)):
    space = {
        "coordinates": names,
        "channels": ("force",),
        "surfaces": surfaces,
        "contacts": contacts,
        "force": force,
    }
    return dataclasses.make_dataclass(
        "Made", [], bases=(ContactModel,), namespace=space, frozen=True
    )()


WELL = System(
    model=model_of(
        lambda self, t, x, v, load, sides: -2.0 * sides.middle,
        (Surface(name="middle", coordinate="x"),),
    )
)


def test_a_force_that_turns_its_sign_swings_as_a_fall_does():
    motion = simulate(WELL, x=1.0, duration=200.5)  # x'' = -+2: a quarter of the period takes 1
    np.testing.assert_allclose(motion.events.times, np.arange(1.0, 201.0, 2.0), rtol=0, atol=1e-12)
    assert motion.x == pytest.approx(1.0 - 0.25, abs=1e-11)


@pytest.mark.parametrize("velocity", [0.5, -0.5])
def test_a_start_on_a_surface_goes_to_the_side_of_its_velocity(velocity):
    motion = simulate(WELL, x=0.0, velocity=velocity, duration=0.75)
    assert motion.events.times == pytest.approx([0.5], abs=1e-15)
    assert np.sign(motion.at(0.25)[0]) == np.sign(velocity)
    assert motion.sides["middle"] == -np.sign(velocity)


def test_a_start_at_rest_on_a_surface_follows_the_field_or_is_refused():
    def away(self, t, x, v, load, sides):
        return 1.0 * sides.middle - 2.0

    surfaces = (Surface(name="middle", coordinate="x"),)
    motion = simulate(System(model=model_of(away, surfaces)), x=0.0, duration=1.0)
    assert (motion.x, motion.sides) == (pytest.approx(-1.5, abs=1e-14), {"middle": -1})
    with pytest.raises(saltus.MotionError, match="push a start on it back to it"):
        simulate(WELL, x=0.0, duration=1.0)


def test_a_start_at_rest_on_a_surface_from_which_both_sides_lead_away_is_refused():
    """x'' = s goes to +inf or to -inf from there; beside it, and with a speed, it is unique."""
    system = System(
        model=model_of(
            lambda self, t, x, v, load, sides: sides.ridge, (Surface(name="ridge", coordinate="x"),)
        )
    )
    with pytest.raises(
        saltus.MotionError,
        match="both lead away from it, so that it is not unique; start beside it",
    ):
        simulate(system, x=0.0, duration=1.0)
    assert simulate(system, x=1e-12, duration=2.0).x == pytest.approx(2.0, abs=1e-11)
    assert simulate(system, x=-1e-12, duration=2.0).x == pytest.approx(-2.0, abs=1e-11)
    assert simulate(system, x=0.0, velocity=-0.5, duration=2.0).x == pytest.approx(-3.0, abs=1e-14)


def test_a_motion_that_only_touches_a_surface_stays_on_its_side():
    """x = cos t touches 1; the force beyond would throw it far away."""
    model = model_of(
        lambda self, t, x, v, load, sides: -x - 50.0 * (1.0 + sides.top),
        (Surface(name="top", coordinate="x", position=1.0),),
    )
    motion = simulate(System(model=model), x=0.0, velocity=1.0 - 1e-9, duration=30.0)
    assert not len(motion.events)
    assert motion.x == pytest.approx((1.0 - 1e-9) * math.sin(30.0), abs=1e-12)
    assert (
        simulate(System(model=model), x=0.0, velocity=1.0 + 1e-9, duration=30.0).events[0].contact
        == "top"
    )


def test_contacts_and_surfaces_act_in_one_motion():
    """A fall from 3 with the force -1 above 1 and -3 below, to a floor at 0 with e = 1/2."""
    model = model_of(
        lambda self, t, x, v, load, sides: -2.0 + sides.half,
        (Surface(name="half", coordinate="x", position=1.0),),
        (Contact(name="floor", coordinate="x"),),
    )
    motion = simulate(System(model=model, impact=NewtonImpact(e=0.5)), x=3.0, duration=3.4)
    down = math.sqrt(10.0)  # the speed at the floor: 2 g h = 4 + 6
    times = [2.0, 2.0 + (down - 2.0) / 3.0]
    assert [(str(event.kind), event.contact) for event in motion.events[:2]] == [
        ("crossing", "half"),
        ("impact", "floor"),
    ]
    np.testing.assert_allclose(motion.events.times[:2], times, rtol=0, atol=1e-12)
    assert motion.events[1].velocity_after[0] == pytest.approx(down / 2.0, abs=1e-12)


def test_surfaces_without_meaning_are_refused_when_the_system_is_made():
    def two(self, t, x, v, load):
        return -x

    side = Surface(name="a", coordinate="x")
    with pytest.raises(
        saltus.ParameterError,
        match="force must take the arguments self, t, theta, velocity, load, sides",
    ):
        System(model=model_of(two, (side,)))

    def reads(self, t, x, v, load, sides):
        return -x * sides.b

    with pytest.raises(saltus.ParameterError, match="no surface 'b'"):
        System(model=model_of(reads, (side,)))
    for wrong, sentence in (
        (Surface(name="a", coordinate="z"), "the surface 'a' is of 'z', but Made has x"),
        (Surface(name="a", coordinate={"x": 0.0}), "coefficients that are numbers other than 0"),
    ):
        with pytest.raises(saltus.ParameterError, match=sentence):
            System(model=model_of(reads, (wrong,)))
    with pytest.raises(saltus.ParameterError, match="must have names of their own"):
        System(model=model_of(reads, (side, side)))
    with pytest.raises(saltus.ParameterError, match="7 frictions and surfaces, and at most 6"):
        System(
            model=model_of(
                reads,
                tuple(Surface(name=f"a{i}", coordinate="x", position=float(i)) for i in range(7)),
            )
        )
    with pytest.raises(saltus.ParameterError, match="the sign of the surface 'a'"):
        Surface(name="a", coordinate="x", sign=0)
    assert WELL.mirrored() == WELL
