"""What docs/not_possible.md lists is refused in one sentence, or ends in one."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from what_works.model_classes import RubbingBlock

import saltus
from saltus import Contact, Friction, Load, NewtonImpact, Surface, System


@dataclass(frozen=True, kw_only=True)
class Falling(saltus.Model):
    """A smooth model whose force is given by its subclasses."""

    coordinates = ("x",)
    channels = ("push",)


class Dragged(Falling):
    """Quadratic drag."""

    def acceleration(self, t, x, velocity, side, load):
        return load.push(t) - abs(velocity) * velocity


class Timed(Falling):
    """A force that depends on the time other than by a load."""

    def acceleration(self, t, x, velocity, side, load):
        return load.push(t) - np.exp(-t)


class Hertzian(Falling):
    """Hertz's contact force, which has no series where it begins."""

    def acceleration(self, t, x, velocity, side, load):
        return load.push(t) - x**1.5


class HertzianStop(saltus.ContactModel):
    """Hertz's force behind a surface, where it begins, without a switch of its own."""

    coordinates = ("x",)
    surfaces = (Surface(name="sphere", coordinate="x", position=0.2),)

    def force(self, t, x, velocity, load, sides):
        return -0.5 * (1.0 + sides["sphere"]) * self.law(x - 0.2)

    def law(self, depth):
        return depth**1.5


class RootedStop(HertzianStop):
    """The same with a root."""

    def law(self, depth):
        return np.sqrt(depth)


class RoundedStop(HertzianStop):
    """The same, rounded off at the surface."""

    def law(self, depth):
        return (depth**2 + 1e-12) ** 0.75


@dataclass(frozen=True, kw_only=True)
class Switching(saltus.ContactModel):
    """A force that switches by a formula of its subclasses."""

    coordinates = ("x",)
    channels = ("push",)

    def force(self, t, x, velocity, load):
        return load.push(t) - x - self.law(x, velocity)


class DraggedByForce(Switching):
    """Quadratic drag in a `force`, which is possible."""

    def law(self, x, velocity):
        return 0.2 * abs(velocity) * velocity


class RootedDrag(Switching):
    """A root of the speed, whose slope is infinite where the motion turns."""

    def law(self, x, velocity):
        return 3.0 * x + 0.1 * np.sign(velocity) * np.sqrt(abs(velocity))


class WithMax(Switching):
    """Python's own max, which branches while the model is traced."""

    def law(self, x, velocity):
        return max(x, 0.0)


class WithIf(Switching):
    """Python's own if."""

    def law(self, x, velocity):
        return x if x > 0.0 else 0.0


class WithMaximum(Switching):
    """NumPy's maximum, of which the model keeps both branches."""

    def law(self, x, velocity):
        return np.maximum(x, 0.0)


class WithSign(Switching):
    """A jump that has no name."""

    def law(self, x, velocity):
        return 0.1 * np.sign(velocity)


class Sliding(saltus.ContactModel):
    """Dry friction as a surface that is a function."""

    coordinates = ("x",)
    channels = ("push",)
    surfaces = (Surface(name="turn", function="speed"),)

    def speed(self, t, x, velocity, load):
        return velocity

    def force(self, t, x, velocity, load, sides):
        return load.push(t) - x - 0.1 * velocity - 0.45 * sides.turn


class Relay(saltus.ContactModel):
    """A threshold that reads its own side."""

    coordinates = ("x",)
    first_order = ("x",)
    surfaces = (Surface(name="off", function="threshold"),)

    def threshold(self, t, x, velocity, load, sides):
        return x - 1.0 - 0.2 * sides.off

    def force(self, t, x, velocity, load, sides):
        return 1.0 - sides.off - x


class TwiceRubbing(RubbingBlock):
    """Two frictions in one contact."""

    @property
    def frictions(self):
        one = Friction(name="rub", coordinate="x", kinetic=0.1, contact="floor")
        return one, replace(one, name="again")


class FastSide(saltus.ContactModel):
    """A surface of a velocity."""

    coordinates = ("x",)
    surfaces = (Surface(name="fast", coordinate="x_velocity"),)

    def force(self, t, x, velocity, load, sides):
        return -x


PUSHED = Load(push=1.0)
SHAKEN = Load(frequency=0.8, push=saltus.Harmonic(0.5))


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: System(model=Dragged(), load=PUSHED), "sign of a velocity"),
        (lambda: System(model=WithMax(), load=PUSHED), "may not branch"),
        (lambda: System(model=WithIf(), load=PUSHED), "may not branch"),
        (lambda: System(model=Relay()), "threshold(t, q, velocity, load)"),
        (lambda: System(model=Timed(), load=PUSHED), "time"),
        (lambda: System(model=TwiceRubbing(), impact=NewtonImpact(0.3)), "a contact can have one"),
        (lambda: System(model=FastSide()), "x_velocity"),
        (lambda: System(model=HertzianStop()), "at the surface 'sphere'"),
        (lambda: System(model=RootedStop()), "has no Taylor series"),
        (lambda: System(model=RootedDrag(), load=PUSHED), "steps shrink to nothing"),
    ],
)
def test_what_is_out_of_scope_is_refused_in_one_sentence(made, words):
    with pytest.raises(saltus.SaltusError) as refusal:
        saltus.simulate(made(), x=0.1, duration=5.0)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("model", "words"),
    [(WithSign(), r"as a method, Surface\(function"), (Sliding(), "slides along a surface")],
)
def test_orbits_that_slide_along_functions_or_jump_without_name_are_refused(model, words):
    """Motions of such a model are followed."""
    system = System(model=model, load=SHAKEN)
    start = {"x": 0.1, "velocity": 0.1}
    assert str(saltus.simulate(system, **start, duration=20.0).stop) == "horizon"
    with pytest.raises(saltus.SaltusError, match=words) as refusal:
        saltus.find_orbit(system, **start)
    assert "\n" not in str(refusal.value)


def test_quadratic_drag_is_taken_in_a_force():
    """u = v^2 has du/dx = -2 x - 2 k u while x rises, which is linear: its solution is known."""
    rate = 2.0 * 0.2
    system = System(model=DraggedByForce(), load=Load(push=0.0))
    motion = saltus.simulate(system, x=0.0, velocity=1.0, duration=1.0)
    x, velocity = motion.x, motion.velocity
    assert velocity > 0.0
    kept = np.exp(rate * x) * (velocity**2 + 2.0 * (x - 1.0 / rate) / rate)
    assert kept == pytest.approx(1.0 - 2.0 / rate**2, abs=1e-12)


def test_numpy_s_maximum_is_taken_where_python_s_is_not():
    """A spring of stiffness 2 on one side and 1 on the other: half periods pi / sqrt(2) and pi."""
    system = System(model=WithMaximum(), load=Load(push=0.0))
    period = np.pi * (1.0 + 1.0 / np.sqrt(2.0))
    motion = saltus.simulate(system, x=0.0, velocity=1.0, duration=period)
    assert (motion.x, motion.velocity) == pytest.approx((0.0, 1.0), abs=1e-12)


@pytest.mark.parametrize(
    "made",
    [
        lambda: saltus.Step(amplitude=-5.0, start=20.0, quantity="displacement"),
        lambda: saltus.Record([0.0, 1.0, 1.0, 2.0], [0.0, 0.0, -5.0, -5.0], quantity="velocity"),
    ],
)
def test_a_ground_that_jumps_is_two_motions(made):
    with pytest.raises(saltus.ParameterError, match="is two motions: end the first one there"):
        made()


def test_a_force_without_a_series_ends_the_motion_in_one_sentence():
    """The mass falls back to x = 0, where x^1.5 has none."""
    with pytest.raises(saltus.SaltusError) as refusal:
        saltus.simulate(System(model=Hertzian(), load=Load(push=-1.0)), x=0.1, duration=5.0)
    assert "\n" not in str(refusal.value)


def test_hertz_s_law_is_taken_where_it_is_rounded_off():
    motion = saltus.simulate(System(model=RoundedStop()), x=0.1, velocity=1.0, duration=1.0)
    assert [str(event.kind) for event in motion.events] == ["crossing"]
    assert motion.events[0].time == pytest.approx(0.1, abs=1e-12)


def test_contacts_hold_coordinates_that_have_a_velocity():
    """A contact of a coordinate of first order has no speed that could stop."""

    class Held(saltus.ContactModel):
        coordinates = ("x", "voltage")
        first_order = ("voltage",)
        contacts = (Contact(name="stop", coordinate="voltage"),)

        def force(self, t, q, velocity, load):
            return -q[0], -q[1]

    with pytest.raises(saltus.SaltusError, match="voltage"):
        System(model=Held())
