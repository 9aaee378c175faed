"""Friction pressed by a contact's own reaction: closed forms, impacts case by case, balances,
derivatives, refusals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, cos, sin, sqrt
from typing import ClassVar

import numpy as np
import pytest

import saltus


@dataclass(frozen=True, kw_only=True)
class Slider(saltus.ContactModel):
    """A block on an incline: x along it, y away from it, with a wall across it."""

    mu: float = 0.3
    static: float = 0.4
    angle: float = 0.2
    wall: float = 1e3
    speed: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("push", "lift")

    @property
    def contacts(self):
        floor = saltus.Contact(name="floor", coordinate="y")
        return floor, saltus.Contact(name="wall", coordinate="x", sign=-1, position=self.wall)

    @property
    def frictions(self):
        given = {"kinetic": self.mu, "static": self.static, "ground_speed": self.speed}
        return (saltus.Friction(name="rub", coordinate="x", contact="floor", **given),)

    def force(self, t, q, v, load):
        return np.sin(self.angle) + load.push(t), load.lift(t) - np.cos(self.angle)


@dataclass(frozen=True, kw_only=True)
class Rod(saltus.ContactModel):
    """A body whose normal and tangential motions are coupled by its inertia, as those of a rod's
    tip.
    """

    mu: float = 0.3
    more: float = 0.0  # mu_s - mu_k
    coupling: float = 0.6
    push: float = 0.0
    speed: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    contacts = (saltus.Contact(name="floor", coordinate="y"),)

    @property
    def frictions(self):
        given = {"kinetic": self.mu, "static": self.mu + self.more, "ground_speed": self.speed}
        return (saltus.Friction(name="rub", coordinate="x", contact="floor", **given),)

    def mass_matrix(self, q):
        return [[1.5, self.coupling], [self.coupling, 1.0]]

    def force(self, t, q, v, load):
        return self.push - 0.2 * q[0], -1.0


def slider(e: float = 0.5, law=saltus.NewtonImpact, load=None, **numbers: float) -> saltus.System:
    return saltus.System(model=Slider(**numbers), impact=law(e=e), load=load or saltus.Load())


def kinds(motion) -> list[str]:
    return [str(event.kind) for event in motion.events]


def test_a_block_slides_down_and_stops():
    motion = saltus.simulate(slider(), x=0.0, y=0.0, velocity=(1.0, 0.0), duration=20.0)
    slows = 0.3 * cos(0.2) - sin(0.2)
    assert kinds(motion) == ["stick", "rest"]
    assert abs(motion.events[0].time - 1.0 / slows) < 1e-12 * 10
    assert abs(motion.x - 0.5 / slows) < 1e-12
    assert (motion.closed, motion.sliding) == (("floor",), {"rub": 0})


@pytest.mark.parametrize("law", [saltus.NewtonImpact, saltus.PoissonImpact])
def test_a_block_falls_and_bounces_while_it_slides(law):
    """Whatever its impacts, x + mu y = mu h + v t + a t^2 / 2 while it slides forwards, as the
    forces along x are mu times R.
    """
    motion = saltus.simulate(slider(law=law), x=0.0, y=1.0, velocity=(1.0, 0.0), duration=20.0)
    slows, t = 0.3 * cos(0.2) - sin(0.2), np.linspace(0.0, 1.0 / (0.3 * cos(0.2) - sin(0.2)), 300)
    x, y = motion.at(t)[0]
    assert np.abs(x + 0.3 * y - 0.3 - t + slows * t**2 / 2).max() < 1e-11
    assert kinds(motion)[-3:] == ["held", "stick", "rest"]
    assert abs(motion.x - 0.3 - 0.5 / slows) < 1e-12 * 10
    assert abs(motion.events[-1].time - 1.0 / slows) < 1e-11
    assert abs(motion.impacts.time[0] - sqrt(2.0 / cos(0.2))) < 1e-12


def test_a_block_hits_a_wall_and_slides_back():
    """v1^2 = v0^2 - 2 mu d before the wall, e v1 after it, and it stops e^2 v1^2 / (2 mu) before
    it.
    """
    motion = saltus.simulate(
        slider(angle=0.0, wall=1.0), x=0.0, y=0.0, velocity=(1.0, 0.0), duration=20.0
    )
    assert kinds(motion) == ["impact", "reversal", "stick", "rest"]
    assert abs(motion.x - (1.0 - 0.25 * (1.0 - 0.6) / 0.6)) < 1e-12
    assert abs(motion.events[0].velocity_before[0] - sqrt(0.4)) < 1e-13


def test_a_block_is_pushed_loose_lifted_and_put_down():
    """Slip where the push reaches mu_s R, take-off where the lift takes the weight, and slip
    backwards after it lands.
    """
    load = saltus.Load(frequency=1.0, push=saltus.Harmonic(0.5), lift=saltus.Harmonic(1.5))
    motion = saltus.simulate(slider(angle=0.0, e=0.0, load=load), x=0.0, y=0.0, periods=3)
    assert kinds(motion)[:4] == ["rest", "slip", "release", "impact"]
    slip, release = motion.events[1].time, motion.events[2].time
    assert abs(slip - asin(0.4 / 1.1)) < 1e-12  # 0.5 sin t = 0.4 (1 - 1.5 sin t)
    assert abs(release - asin(1.0 / 1.5)) < 1e-12
    # of 0.5 sin t - 0.3 (1 - 1.5 sin t)
    speed = 0.95 * (cos(slip) - cos(release)) - 0.3 * (release - slip)
    assert abs(motion.events[2].velocity_before[0] - speed) < 1e-12
    t = np.linspace(0.0, motion.time, 4001)
    (_, y), _ = motion.at(t)
    assert y.min() >= 0.0
    data = motion.to_xarray()
    assert set(np.unique(data.sliding_rub.values)) <= {-1, 0, 1, 2}
    assert ((data.sliding_rub.values == 2) == (data.closed_contacts.values & 1 == 0)).all()


# --- impacts case by case ----------------------------------------------------


def moreau(inverse, v, e, mu, w=0.0):
    """v+ by Moreau's law, for a contact on coordinate 1 with friction along coordinate 0: it sticks
    if the cone allows it.
    """
    return v + inverse @ impulses(inverse, v - [w, 0.0], -e * v[1], mu)


def impulses(inverse, v, target, mu, given=0.0):
    """(T, N) that give the normal speed `target`, or N = `given` if that is larger."""
    normal = np.linalg.solve(inverse, [-v[0], target - v[1]])
    if given:
        normal = np.array([-(v[0] + inverse[0, 1] * given) / inverse[0, 0], given])
    if abs(normal[0]) <= mu * normal[1]:
        return normal
    found = []
    for s in (1.0, -1.0):
        along = inverse @ [-mu * s, 1.0]
        size = given or (target - v[1]) / along[1]
        if s * (v[0] + along[0] * size) >= 0.0:
            found.append(np.array([-mu * s * size, size]))
    (only,) = found
    return only


def poisson(inverse, v, e, mu):
    compressed = impulses(inverse, v, 0.0, mu)
    between = v + inverse @ compressed
    after = between + inverse @ impulses(inverse, between, 0.0, mu, given=e * compressed[1])
    return after if after[1] >= 0.0 else between + inverse @ impulses(inverse, between, 0.0, mu)


@pytest.mark.parametrize("speed", [3.0, 0.5, 0.2, 0.0, -0.2, -0.4, -3.0])
@pytest.mark.parametrize("coupling", [0.6, -0.6, 0.0])
def test_impacts_with_friction_stick_or_slide(speed, coupling):
    inverse, v = np.linalg.inv([[1.5, coupling], [coupling, 1.0]]), np.array([speed, -1.0])
    for law, expected in (
        (saltus.NewtonImpact, moreau(inverse, v, 0.5, 0.4)),
        (saltus.PoissonImpact, poisson(inverse, v, 0.5, 0.4)),
    ):
        system = saltus.System(model=Rod(mu=0.4, coupling=coupling), impact=law(e=0.5))
        motion = saltus.simulate(system, x=0.0, y=1e-9, velocity=tuple(v), duration=1e-6, tol=1e-14)
        (event,) = motion.events
        assert np.abs(event.velocity_after - expected).max() < 1e-7
        energy = [
            u @ np.linalg.solve(inverse, u) for u in (event.velocity_before, event.velocity_after)
        ]
        assert energy[1] <= energy[0] + 1e-12


def test_a_moving_ground_drags_along_what_hits_it():
    system = saltus.System(
        model=Rod(mu=0.4, coupling=0.0, speed=2.0), impact=saltus.NewtonImpact(e=0.5)
    )
    motion = saltus.simulate(system, x=0.0, y=0.5, velocity=(0.0, 0.0), duration=1.05, tol=1e-14)
    # mu (1 + e) of the impulse, over the mass
    assert abs(motion.velocity[0] - 0.4 * 1.5 / 1.5) < 5e-2
    event = motion.events[0]
    assert abs(event.velocity_after[0] - event.velocity_before[0] - 0.4) < 1e-12


# --- balances and derivatives ------------------------------------------------


def test_the_energy_balance_closes_on_random_models():
    random = np.random.default_rng(4)
    for _ in range(6):
        model = Rod(
            mu=random.uniform(0.1, 0.6),
            coupling=random.uniform(-0.5, 0.5),
            push=random.uniform(-1.0, 1.0),
        )
        system = saltus.System(
            model=replace(model, speed=random.uniform(-0.5, 0.5)), impact=saltus.NewtonImpact(e=0.6)
        )
        motion = saltus.simulate(
            system,
            x=0.0,
            y=random.uniform(0.0, 0.5),
            velocity=(random.normal(), 0.0),
            duration=12.0,
        )
        found = saltus.energies(motion)
        assert abs(found.attrs["defect"]) < 1e-11
        assert abs(float(found.energy.sel(part="friction.rub"))) > 1e-3


CASES = {
    "slides and stops": (slider(), (0.0, 0.0, 1.0, 0.0), 20.0, ("model.mu", "model.angle")),
    "slides": (slider(), (0.0, 0.0, 1.0, 0.0), 5.0, ("model.mu", "model.angle")),
    "hits a wall": (
        slider(angle=0.0, wall=1.0),
        (0.0, 0.0, 1.0, 0.0),
        2.5,
        ("model.mu", "model.wall", "impact.e"),
    ),
    "impact that slides": (
        saltus.System(model=Rod(), impact=saltus.NewtonImpact(e=0.5)),
        (0.0, 0.5, 2.0, 0.0),
        1.5,
        ("model.mu", "model.coupling", "impact.e"),
    ),
    "impact that sticks": (
        saltus.System(model=Rod(mu=0.7), impact=saltus.NewtonImpact(e=0.5)),
        (0.0, 0.5, 0.3, 0.0),
        1.5,
        ("model.mu", "model.coupling", "impact.e"),
    ),
    "two phases": (
        saltus.System(model=Rod(), impact=saltus.PoissonImpact(e=0.5)),
        (0.0, 0.5, 2.0, 0.0),
        1.5,
        ("model.mu", "model.coupling", "impact.e"),
    ),
    "bounces until it is held": (
        saltus.System(model=Rod(), impact=saltus.NewtonImpact(e=0.4)),
        (0.0, 0.5, 3.0, 0.0),
        5.0,
        ("model.mu", "model.coupling"),
    ),
    "stick and slip": (
        saltus.System(model=Rod(speed=0.3, push=0.2, more=0.1)),
        (0.0, 0.0, 0.3, 0.0),
        25.0,
        ("model.mu", "model.push", "model.more"),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_with_differences(name):
    system, state, duration, paths = CASES[name]

    def end(given, start):
        motion = saltus.simulate(
            given, x=start[0], y=start[1], velocity=tuple(start[2:]), duration=duration, tol=1e-14
        )
        return np.array([*motion.position, *motion.velocity]), kinds(motion)

    found = saltus.sensitivities(
        system,
        x=state[0],
        y=state[1],
        velocity=state[2:],
        duration=duration,
        parameters=paths,
        tol=1e-14,
    )
    h = 1e-5
    assert kinds(found.motion) == end(system, state)[1]
    for column, path in enumerate(paths):
        ends = [end(system.with_({path: system.get(path) + s * h}), state)[0] for s in (-1.0, 1.0)]
        np.testing.assert_allclose(
            found.parameters[:, column], (ends[1] - ends[0]) / (2 * h), rtol=0, atol=2e-6
        )
    inside = state[1] > 0.0  # else y and its rate have one-sided derivatives
    for place in range(4) if inside else (0, 2):
        ends = [end(system, np.array(state) + s * h * np.eye(4)[place])[0] for s in (-1.0, 1.0)]
        np.testing.assert_allclose(
            found.state[:, place], (ends[1] - ends[0]) / (2 * h), rtol=0, atol=5e-5
        )
    assert not inside or abs(found.state).max() > 0.5


# --- refusals ----------------------------------------------------------------


def test_painleves_paradox_is_refused_by_name_with_its_number():
    with pytest.raises(
        saltus.ParameterError, match=r"Painleve's paradox.*1 \+ s mu m_nt / m_tt .* is -0\.2"
    ):
        saltus.System(model=Rod(mu=3.0))


@dataclass(frozen=True, kw_only=True)
class UniformRod(saltus.ContactModel):
    """A rod of half length and mass 1, and of inertia 1/3, at an angle to the floor, by the
    coordinates of its lower end.
    """

    mu: float = 1.5

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "angle")
    contacts = (saltus.Contact(name="floor", coordinate="y"),)

    @property
    def frictions(self):
        return (saltus.Friction(name="rub", coordinate="x", kinetic=self.mu, contact="floor"),)

    def mass_matrix(self, q):
        c, s = np.cos(q[2]), np.sin(q[2])
        return [[1.0, 0.0, -s], [0.0, 1.0, c], [-s, c, 4.0 / 3.0]]

    def force(self, t, q, v, load):
        c, s = np.cos(q[2]), np.sin(q[2])
        return c * v[2] ** 2, s * v[2] ** 2 - 1.0, -c


def painleve(mu: float, angle: float, s: float) -> float:
    """1 - s mu A_nt / A_nn with A_nn = 1 + 3 cos^2 and A_nt = -3 sin cos (Painleve 1895; Genot and
    Brogliato 1999).
    """
    return 1.0 + s * mu * 3.0 * sin(angle) * cos(angle) / (1.0 + 3.0 * cos(angle) ** 2)


# the paradox begins at 4/3, where the tangent of the angle is 2
@pytest.mark.parametrize("mu", [1.32, 1.35, 1.5])
def test_a_rod_that_slides_is_refused_where_painleves_paradox_begins(mu):
    system, refused = saltus.System(model=UniformRod(mu=mu), impact=saltus.NewtonImpact(e=0.5)), []
    for angle in np.arctan([0.3, 0.8, 1.2, 1.6, 1.9, 2.0, 2.1, 3.0, 3.5, -1.0, -2.0]):
        for way in (1.0, -1.0):
            number, least = (
                painleve(mu, angle, way),
                min(painleve(mu, angle, 1.0), painleve(mu, angle, -1.0)),
            )
            # it slides, or hits the floor while it does
            for height, speed in ((0.0, 0.0), (1e-9, -1.0)):
                start = {
                    "x": 0.0,
                    "y": height,
                    "angle": float(angle),
                    "velocity": (way, speed, 0.0),
                }
                try:
                    assert saltus.simulate(system, **start, duration=1e-6).time == pytest.approx(
                        1e-6, abs=1e-18
                    )
                    taken = True
                except saltus.MotionError as error:
                    taken, told = False, str(error)
                    assert told.startswith("Painleve's paradox at floor at time")
                    assert abs(float(told.partition("and is ")[2].split(",")[0]) - least) < 1e-6
                    refused.append(angle)
                assert taken == ((number if height == 0.0 else least) > 0.0)
    assert bool(refused) == (mu > 4.0 / 3.0)


@pytest.mark.parametrize("mu", [1.2, 1.5])
def test_a_start_at_which_several_reactions_are_possible_is_refused(mu):
    """A rod that turns so fast that its end would lift off without a reaction: it does where the
    number is positive, and else a reaction that presses it on the floor is possible besides."""
    model = UniformRod(mu=mu)
    system, angle = (
        saltus.System(model=model, impact=saltus.NewtonImpact(e=0.5)),
        float(np.arctan(2)),
    )
    seen = set()
    for way in (1.0, -1.0):
        q, v = (0.0, 0.0, angle), (way, 0.0, 2.0)
        free = np.linalg.solve(model.mass_matrix(q), model.force(0.0, q, v, None))
        assert free[1] > 0.1
        start = {"x": 0.0, "y": 0.0, "angle": angle, "velocity": v}
        is_unique = painleve(mu, angle, way) > 0.0
        seen.add(is_unique)
        if is_unique:
            motion = saltus.simulate(system, **start, duration=1e-3)
            assert motion.y == pytest.approx(free[1] * 5e-7, rel=1e-2)
        else:
            with pytest.raises(saltus.MotionError, match="no reaction is possible or several are"):
                saltus.simulate(system, **start, duration=1e-3)
    assert seen == ({True, False} if mu > 4.0 / 3.0 else {True})


@pytest.mark.parametrize(("tangent", "way"), [(1.0, -1.0), (3.6, -1.0), (30.0, 1.0)])
def test_the_motion_of_a_rod_ends_by_name_at_the_angle_where_the_paradox_begins(tangent, way):
    """tan^2 - 3 mu tan + 4 = 0, in whichever direction its end would slide if it did not stick."""
    system = saltus.System(model=UniformRod(), impact=saltus.NewtonImpact(e=0.5))
    motion = saltus.simulate(
        system,
        x=0.0,
        y=0.0,
        angle=float(np.arctan(tangent)),
        velocity=(way, 0.0, 0.0),
        duration=5.0,
    )
    assert (str(motion.stop), motion.limit) == ("limit", "Painleve's paradox at floor")
    edges = np.arctan((4.5 + np.array([1.0, -1.0]) * sqrt(4.5**2 - 16.0)) / 2.0)
    assert np.abs(np.concatenate([edges, np.pi - edges, -edges]) - motion.angle).min() < 1e-11


# --- an independent time stepping --------------------------------------------


def stepped(system, law, state, duration, steps):
    """The state at the end by Moreau's midpoint scheme with so many steps: velocities at the ends,
    forces and gaps in the middle, and in a step in which the gap is closed an impact."""
    model, mass = system.model, np.array(system.model.mass_matrix(None))
    h, inverse, q, v = (
        duration / steps,
        np.linalg.inv(mass),
        np.array(state[:2]),
        np.array(state[2:]),
    )
    for _ in range(steps):
        q = q + 0.5 * h * v
        free = v + h * (inverse @ [model.push - 0.2 * q[0], -1.0])
        if q[1] <= 0.0:
            free = law(inverse, free, v, system.impact.e, model.mu)
        v, q = free, q + 0.5 * h * free
    return np.array([*q, *v])


def by_moreau(inverse, free, v, e, mu):
    """The speed of the gap becomes -e times that before the step, unless it is larger without an
    impulse.
    """
    target = max(-e * v[1], 0.0)
    return free if free[1] >= target else free + inverse @ impulses(inverse, free, target, mu)


def by_poisson(inverse, free, v, e, mu):
    return free if free[1] >= 0.0 else poisson(inverse, free, e, mu)


@pytest.mark.parametrize("duration", [1.3, 4.0])  # while it bounces, and after it has come to rest
@pytest.mark.parametrize(
    ("law", "impact"), [(by_moreau, saltus.NewtonImpact), (by_poisson, saltus.PoissonImpact)]
)
def test_a_time_stepping_comes_to_impacts_and_sliding_with_friction_at_first_order(
    law, impact, duration
):
    steps, errors, seen = 200 * 2 ** np.arange(5), np.zeros(5), set()
    system = saltus.System(model=Rod(mu=0.4, coupling=0.6, push=0.3), impact=impact(e=0.5))
    for speed in (2.0, 0.8, 0.3, -0.4, -1.0):
        motion = saltus.simulate(
            system, x=0.0, y=0.3, velocity=(speed, 0.0), duration=duration, tol=1e-14
        )
        seen |= set(kinds(motion))
        ends = [stepped(system, law, (0.0, 0.3, speed, 0.0), duration, int(n)) for n in steps]
        errors += [np.abs(end - motion.final_state).max() for end in ends]
    assert seen == ({"impact"} if duration < 2.0 else {"impact", "held", "stick", "rest"})
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 0.65 < order < 1.35
    assert errors[-1] < 0.02


# --- friction along the coordinate of a contact, and along a sum -------------


@dataclass(frozen=True, kw_only=True)
class Slot(saltus.ContactModel):
    """A mass that rubs in a slot with a wall at x = 0, pushed towards it or away from it."""

    mu: float = 0.3
    static: float = 0.4
    push: float = -1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (saltus.Contact(name="wall", coordinate="x"),)

    @property
    def frictions(self):
        return (saltus.Friction(name="rub", coordinate="x", kinetic=self.mu, static=self.static),)

    def force(self, t, x, velocity, load):
        return self.push + load.force(t)


def test_a_mass_that_rubs_bounces_off_a_wall_until_it_is_held():
    """It falls with c = 1 - mu and rises with b = 1 + mu: u becomes e u sqrt(c / b) in u (1 / b + 1
    / sqrt(b c)).
    """
    motion = saltus.simulate(
        saltus.System(model=Slot(), impact=saltus.NewtonImpact(e=0.6)), x=0.35, duration=10.0
    )
    speeds = np.abs(motion.impacts.velocity_after[:, 0])
    share = 0.6 * sqrt(0.7 / 1.3)
    assert np.abs(speeds[1:6] / speeds[:5] - share).max() < 1e-11
    assert abs(speeds[0] - 0.6 * 0.7) < 1e-13
    ends = 1.0 + 0.42 * (1.0 / 1.3 + 1.0 / sqrt(1.3 * 0.7)) / (1.0 - share)
    assert (
        abs(next(event.time for event in motion.events if str(event.kind) == "held") - ends) < 1e-10
    )
    assert (str(motion.stop), motion.closed) == ("rest", ("wall",))


def test_a_mass_leaves_the_wall_where_it_is_pulled_with_more_than_static_friction():
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(1.0))
    system = saltus.System(model=Slot(push=-0.2), impact=saltus.NewtonImpact(e=0.0), load=load)
    motion = saltus.simulate(system, x=0.0, duration=2.0, tol=1e-14)
    release = asin(0.6)  # sin t - 0.2 = mu_s
    assert kinds(motion)[:3] == ["rest", "release", "slip"]
    assert abs(motion.events[1].time - release) < 1e-12
    t = motion.time
    assert abs(motion.velocity - (cos(release) - cos(t) - 0.5 * (t - release))) < 1e-11


def test_two_bodies_that_rub_each_other_stop_together():
    """Friction along y - x: momentum is kept, and the distance slides (v^2 / 2) / (mu (1 + 1 /
    m)).
    """

    @dataclass(frozen=True, kw_only=True)
    class Pair(saltus.ContactModel):
        mass: float = 0.5
        coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
        frictions = (saltus.Friction(name="rub", coordinate={"y": 1.0, "x": -1.0}, kinetic=0.2),)

        def mass_matrix(self, q):
            return [[1.0, 0.0], [0.0, self.mass]]

        def force(self, t, q, velocity, load):
            return 0.0 * q[0], 0.0 * q[1]

    motion = saltus.simulate(
        saltus.System(model=Pair()), x=0.0, y=0.0, velocity=(0.0, 1.2), duration=5.0
    )
    assert kinds(motion) == ["stick"]
    assert abs(motion.events[0].time - 1.2 / 0.6) < 1e-12
    assert np.abs(np.subtract(motion.velocity, 0.4)).max() < 1e-14
    assert abs(motion.y - motion.x - 1.2) < 1e-12


def test_friction_that_falls_with_the_speed_holds_its_equation():
    """On the belt, x'' + x = (mu_k + (mu_s - mu_k) exp(-u / v_s)) sign u with u = w - x', from its
    dense output.
    """

    @dataclass(frozen=True, kw_only=True)
    class Belt(saltus.ContactModel):
        fall: float = 0.2
        coordinates: ClassVar[tuple[str, ...]] = ("x",)

        @property
        def frictions(self):
            given = {
                "kinetic": 0.15,
                "static": 0.3,
                "ground_speed": 0.3,
                "stribeck_speed": self.fall,
            }
            return (saltus.Friction(name="belt", coordinate="x", **given),)

        def force(self, t, x, velocity, load):
            return -x

    motion = saltus.simulate(saltus.System(model=Belt()), x=-1.5, velocity=0.0, duration=12.0)
    assert {"reversal", "stick", "slip"} & set(kinds(motion))
    data = motion.to_xarray(np.linspace(0.01, 12.0, 2000))
    h = 1e-4
    for t, s in zip(data.time.values[::40], data.sliding_belt.values[::40], strict=True):
        if s and not any(abs(event.time - t) < 2 * h for event in motion.events):
            (v,), bend = motion.at([t])[1], (motion.at(t + h)[1] - motion.at(t - h)[1]) / (2 * h)
            mu = 0.15 + 0.15 * np.exp(-abs(v - 0.3) / 0.2)
            assert abs(bend + motion.at(t)[0] + s * mu) < 1e-6


def test_ensembles_and_orbits_take_friction_in_contacts():
    starts = np.array([0.5, 1.0, 2.0])
    many = saltus.simulate_many(
        slider(), x=0.0, y=1.0, velocity=(starts, np.zeros(3)), duration=6.0
    )
    for place, start in enumerate(starts):
        one = saltus.simulate(slider(), x=0.0, y=1.0, velocity=(float(start), 0.0), duration=6.0)
        assert abs(float(many["x"].values.ravel()[place]) - one.x) < 1e-11
    load = saltus.Load(frequency=1.0, push=saltus.Harmonic(0.6), lift=saltus.Harmonic(1.5))
    orbit = saltus.find_orbit(
        slider(angle=0.0, e=0.3, load=load).with_({"model.wall": 0.8}), x=0.0, y=0.0
    )
    motion = orbit.motion()
    assert np.abs(motion.position[1] - motion.at(motion.start)[0][1]) < 1e-11
    assert {"release", "impact"} <= set(kinds(motion))
