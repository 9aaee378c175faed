"""The classes of models: what their base class says of them, and what is refused when a system is
made of one.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import Contact, ContactModel, Friction, Model, OneContactModel, ParameterError, System
from saltus.flow import PortableMotion
from saltus.systems import MODELS
from saltus.web.description import description, notice_undeclared


def fall(self, t, q, velocity, side, load):
    return -1.0 + 0.0 * q


def pulled(self, t, q, velocity, load):
    return -1.0 + 0.0 * q


def bounce(self, t, velocity, side, load, impact):
    return side, -impact.velocity_after(self, t, velocity, side, side, load)


def made(base, **parts):
    """A model of one coordinate x with these parts."""
    return dataclass(frozen=True)(type("Own", (base,), {"coordinates": ("x",), **parts}))()


FLOOR = (Contact(name="floor", coordinate="x"),)


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        (made(Model), "Own must define acceleration"),
        (made(OneContactModel), "Own must define acceleration"),
        (made(ContactModel, contacts=FLOOR), "Own must define force"),
        (
            made(Model, acceleration=fall, sides=(1, -1)),
            "sides, so its base class must be saltus.OneContactModel, not Model",
        ),
        (
            made(Model, acceleration=fall, gap=lambda self, x, side: x),
            "gap, so its base class must be saltus.OneContactModel",
        ),
        (
            made(OneContactModel, acceleration=fall, contacts=FLOOR),
            "contacts, so its base class must be saltus.ContactModel",
        ),
        (made(Model, force=pulled), "defines force, so its base class must be saltus.ContactModel"),
        (
            made(ContactModel, force=pulled, sides=(1,)),
            "defines sides, so its base class must be saltus.OneContactModel",
        ),
        (
            made(OneContactModel, acceleration=fall, sides=(1, -1), coordinates=("x", "y")),
            "coordinates x, y, but it must have one",
        ),
        (made(OneContactModel, acceleration=fall, sides=(1,)), "define reset"),
        (made(OneContactModel, acceleration=fall, sides=(-1,)), r"sides must be \(1, -1\)"),
        (
            made(OneContactModel, acceleration=fall, contact=1.0),
            "gap must be 0 at Own.contact = 1, got 1 on side 1",
        ),
        (
            made(
                OneContactModel,
                acceleration=fall,
                reset=bounce,
                sides=(1,),
                gap=lambda self, x, side: 1.0,
            ),
            "gap must depend",
        ),
        (
            made(
                OneContactModel,
                acceleration=fall,
                reset=lambda self, t, v, side, load, impact: (side, v),
            ),
            "beyond the contact",
        ),
        (
            made(Model, acceleration=lambda self, t, x, velocity, load: -x),
            "acceleration must take the arguments self, t",
        ),
        (
            made(Model, acceleration=lambda self, t, x, v, side, load: (x, v)),
            r"acceleration must return 1 value\(s\)",
        ),
        (
            made(Model, acceleration=lambda self, t, x, v, side, load: -self.stiffness * x),
            "fails: AttributeError",
        ),
        (
            made(Model, acceleration=lambda self, t, x, v, side, load: -undefined * x),  # noqa: F821
            "fails: NameError",
        ),
        (
            made(ContactModel, force=pulled, contacts=FLOOR + FLOOR),
            "must have names of their own, got floor, floor",
        ),
        (
            made(ContactModel, force=pulled, contacts=(Contact(name="a", coordinate="y"),)),
            "holds 'y', but Own has x",
        ),
        (
            made(
                ContactModel,
                force=pulled,
                contacts=FLOOR,
                frictions=(Friction(name="f", coordinate="x", kinetic=0.1, contact="floor"),),
            ),
            "along whose coordinate x a friction acts",
        ),
    ],
)
def test_a_model_that_cannot_work_is_refused_when_a_system_is_made_of_it(model, sentence):
    with pytest.raises(ParameterError, match=sentence):
        System(model=model)


def with_two(mass, force=lambda self, t, q, velocity, load: (-q[0], -q[1])):
    return made(ContactModel, coordinates=("x", "y"), mass_matrix=lambda self, q: mass, force=force)


@dataclass(frozen=True, kw_only=True)
class NamedForce(ContactModel):
    mass_matrix: float = 0.1
    coordinates = ("x",)
    force = pulled


class NoDataclass(ContactModel):
    stiffness: float = 1.0
    coordinates = ("x",)
    force = pulled


class OwnInit(ContactModel):
    coordinates = ("x",)
    force = pulled

    def __init__(self, stiffness=1.0):
        self.stiffness = stiffness


UNIT = [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        (
            NamedForce(),
            (
                "NamedForce has a number named mass_matrix, which is the name of a method of "
                "saltus.ContactModel: rename it"
            ),
        ),
        (
            NoDataclass(),
            (
                r"NoDataclass is not a dataclass, so stiffness would not be a parameter: write "
                r"@dataclass\(frozen"
            ),
        ),
        (
            OwnInit(),
            r"OwnInit is not a dataclass, so stiffness .* such as stiffness: float, in place of",
        ),
        (
            with_two(UNIT, lambda self, t, q, v, load: (1.0, 2.0, 3.0)),
            "force must return 2 numbers, for x, y, got 3 numbers",
        ),
        (
            with_two(UNIT, lambda self, t, q, v, load: -q[0]),
            "force must return 2 numbers, for x, y, got a number",
        ),
        (
            made(ContactModel, force=lambda self, t, q, v, load: (q, v)),
            "force must return a number, for x, got 2 numbers",
        ),
        (
            with_two([[1.0]]),
            "mass_matrix must return 2 rows of 2 numbers, for x, y, got 1 row of 1 number$",
        ),
        (
            with_two([[1.0], [0.0, 1.0]]),
            "mass_matrix must return 2 rows of 2 numbers, for x, y, got 2 rows of 1 and 2 numbers",
        ),
        (with_two(2.0), "mass_matrix must return 2 rows of 2 numbers, for x, y, got a number"),
        (
            with_two([[1.0, 0.1], [0.2, 1.0]]),
            "mass_matrix must be symmetric, got 0.1 for x, y and 0.2 for y, x",
        ),
    ],
)
def test_what_a_newcomer_gets_wrong_in_a_model_is_said_when_a_system_is_made_of_it(model, sentence):
    with pytest.raises(ParameterError, match=sentence):
        System(model=model)


def test_a_model_without_numbers_needs_no_decorator():
    system = System(model=type("Own", (Model,), {"coordinates": ("x",), "acceleration": fall})())
    assert system.to_dict()["model"] == {"type": "Own"}
    assert saltus.simulate(system, x=0.0, duration=2.0).x == pytest.approx(-2.0, rel=1e-14)


def test_a_mass_matrix_that_is_symmetric_but_for_rounding_is_taken():
    System(model=with_two([[1.0, 0.1 + 0.2], [0.3, 1.0]]))


def test_a_misspelt_channel_is_refused_when_a_system_is_made():
    model = made(
        Model, channels=("force",), acceleration=lambda self, t, x, v, side, load: load.forse(t) - x
    )
    with pytest.raises(
        saltus.TraceError,
        match=r"reads load\.forse, which is not one of its channels; did you mean 'force'",
    ):
        System(model=model)


def test_what_a_law_needs_of_a_model_is_refused_when_a_system_is_made():
    with pytest.raises(ParameterError, match="WallOscillator defines no inelastic_factor"):
        System(model=saltus.WallOscillator(), impact=saltus.InelasticImpact())
    with pytest.raises(
        ParameterError,
        match=r"passes its contact and does not bounce there, so that impact\.e must be 0",
    ):
        System(model=saltus.RockingBlock(alpha=0.2), impact=saltus.NewtonImpact(e=0.5))
    with pytest.raises(
        ParameterError, match=r"impact.e must have 1 value for a WallOscillator, got 2"
    ):
        System(model=saltus.WallOscillator(), impact=saltus.NewtonImpact(e=(0.5, 0.4)))


@pytest.mark.parametrize("e", [0.5, (0.5,)])
def test_newtons_law_at_a_wall_is_restitution(e):
    """A ball falls from 2 under the acceleration 1 and loses half of its speed: t = 2, then flights
    of 2 v with each speed v.
    """
    ball = System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0),
        load=saltus.Load(force=1.0),
        impact=saltus.NewtonImpact(e=e),
    )
    times = saltus.simulate(ball, x=-2.0, duration=5.6).impacts.time
    assert times == pytest.approx([2.0, 4.0, 5.0, 5.5], abs=1e-13)


def test_newtons_transfer_at_a_contact_that_is_passed_is_a_reduction_of_the_velocity():
    block = System(model=saltus.RockingBlock(alpha=0.2), impact=saltus.NewtonImpact(transfer=0.9))
    same = block.with_(impact=saltus.VelocityReduction(0.9))
    one, other = (saltus.simulate(system, theta=0.1, duration=8.0) for system in (block, same))
    assert len(one.impacts) > 2
    assert (one.theta, one.velocity) == (other.theta, other.velocity)


ANSWERS = {  # holds_coordinates, has_one_contact, names_its_contacts, has_state_plane, every_side
    "Metainterface": (False, True, False, True, (1, -1)),
    "RockingBlock": (False, True, False, True, (1, -1)),
    "WallOscillator": (False, True, False, True, (1,)),
    "TwoStops": (True, False, True, False, (1,)),
    "BeltOscillator": (True, False, False, False, (1,)),
    "TwoLayer": (True, False, True, False, (1,)),
    "ImpactPair": (True, False, True, False, (1,)),
    "CellChain": (True, False, True, False, (1,)),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_a_model_answers_what_its_callers_want_to_know(name):
    kind = MODELS[name]
    model = kind(**{key: 1.4 for key in ("beta0", "alpha") if key in kind.__dataclass_fields__})
    found = (
        model.holds_coordinates,
        model.has_one_contact,
        model.names_its_contacts,
        model.has_state_plane,
        model.every_side,
    )
    assert found == ANSWERS[name]
    assert isinstance(model, OneContactModel) is model.has_one_contact
    assert isinstance(model, ContactModel) is model.holds_coordinates
    assert set(model.margin_kinds) <= set(model.margin_names(saltus.Load()))


def test_smoothing_takes_the_contact_away():
    model = saltus.Metainterface(beta0=1.4, smoothing=100.0)
    assert (model.has_one_contact, model.every_side, model.has_state_plane) == (False, (1,), True)


def test_a_coordinate_reaches_what_its_contacts_let_it_reach():
    at = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    assert saltus.WallOscillator(wall=1.0).reaches("x", at).tolist() == [
        True,
        True,
        True,
        True,
        False,
    ]
    assert saltus.Metainterface(beta0=1.4).reaches("theta", at).all()
    assert saltus.TwoStops().reaches("x", at).tolist() == [False, True, True, True, False]
    assert saltus.ImpactPair(clearance=1.0).reaches("z", at).all()
    assert saltus.TwoLayer(beta0=1.4).reaches("theta_2", at).tolist() == [
        True,
        True,
        True,
        False,
        False,
    ]
    assert saltus.BeltOscillator().reaches("x", at).all()


def test_the_direction_into_a_mode_is_that_in_which_the_gap_opens():
    assert saltus.WallOscillator(wall=3.0).inward(1) == -1.0
    assert [saltus.RockingBlock(alpha=0.2).inward(side) for side in (1, -1)] == [1.0, -1.0]


def test_energy_cannot_be_restituted_to_more_than_there_was():
    assert saltus.EnergyRestitution(r=1.0).r == 1.0
    for r in (1.1, 0.0, math.nan):
        with pytest.raises(ParameterError, match="r must lie in"):
            saltus.EnergyRestitution(r=r)


@dataclass(frozen=True, kw_only=True)
class OwnChecks(OneContactModel):
    """A model that refuses numbers as a newcomer writes it."""

    stiffness: float = 1.0
    sides = (1,)

    def acceleration(self, t, theta, velocity, side, load):
        return -self.stiffness * theta

    def reset(self, t, velocity, side, load, impact):
        return bounce(self, t, velocity, side, load, impact)

    def __post_init__(self):
        if self.stiffness < 0.0:
            raise ValueError("stiffness must be >= 0")
        if self.stiffness > 5.0:
            raise ValueError("that spring is too stiff")


def test_what_the_class_of_a_user_refuses_is_said_with_its_path_and_value():
    system = System(model=OwnChecks(), impact=saltus.NewtonImpact(0.8))
    with pytest.raises(ParameterError) as refused:
        system.with_({"model.stiffness": -1.5})
    assert refused.value.parameter == "model.stiffness"
    assert str(refused.value) == "model.stiffness must be >= 0, got -1.5"
    with pytest.raises(
        ParameterError, match=r"^model\.stiffness: that spring is too stiff, got 7\.0$"
    ):
        system.with_({"model.stiffness": 7.0})
    with pytest.raises(ParameterError, match=r"model\.stiffness must be >= 0, got -2\.0"):
        saltus.simulate_many(
            system, theta=0.1, duration=1.0, parameters={"model.stiffness": [1.0, -2.0]}
        )
    # a page cannot know it, and says so; its slider goes to 2 * 4 here
    far = system.with_({"model.stiffness": 4.0})
    entries = description(PortableMotion(far))["numbers"]
    with pytest.warns(
        UserWarning, match=r"model\.stiffness: that spring is too stiff.*number_range"
    ):
        notice_undeclared(far, entries)


@dataclass(frozen=True, kw_only=True)
class Declared(OneContactModel):
    """An oscillator whose numbers declare what they may be."""

    stiffness: float = field(default=1.0, metadata=saltus.number_range(above=0.0, at_most=5.0))
    stop: float = field(default=0.5, metadata=saltus.number_range(below="far"))
    far: float = field(default=2.0, metadata=saltus.number_range())
    cells: int = field(default=2, metadata=saltus.number_range(at_least=1, whole=True))

    coordinates = ("theta",)
    channels = ()

    def acceleration(self, t, theta, velocity, side, load):
        return -self.stiffness * theta


@pytest.mark.parametrize(
    ("number", "value", "sentence"),
    [
        ("stiffness", 0.0, "model.stiffness must lie in (0, 5], got 0.0"),
        ("stiffness", 5.5, "model.stiffness must lie in (0, 5], got 5.5"),
        ("stiffness", None, "model.stiffness must be a number in (0, 5], got None"),
        ("stop", 2.0, "model.stop must lie below far = 2, got 2"),
        ("far", -1.0, "model.stop must lie below far = -1, got 0.5"),
        ("cells", 0, "model.cells must lie in [1, 1e+07], got 0"),
        ("cells", 1.5, "model.cells must be a whole number, got 1.5"),
    ],
)
def test_declared_ranges_are_checked_where_a_system_is_made(number, value, sentence):
    with pytest.raises(ParameterError) as refused:
        System(model=Declared(**{number: value}))
    assert str(refused.value) == sentence
    system = System(model=Declared(stiffness=5))
    assert (type(system.model.stiffness), system.model.stiffness) == (float, 5.0)
    with pytest.raises(ParameterError, match="must lie in"):
        system.with_({"model.stiffness": 5.1})


NO_NUMBERS = (math.nan, math.inf, -math.inf, 1j, "1", [1.0], np.array([1.0, 2.0]), np.ma.masked, {})
PARTS = {
    saltus.Contact: (
        {"name": "stop", "coordinate": "x"},
        {"position": (), "restitution": (-0.5, 1.5), "sign": (0, 0.5)},
    ),
    saltus.Surface: (
        {"name": "stop", "coordinate": "x"},
        {"position": (), "stiffness": (), "damping": (), "sign": (0, 2)},
    ),
    saltus.Friction: (
        {"name": "belt", "coordinate": "x", "kinetic": 0.2},
        {
            "kinetic": (-0.1,),
            "static": (0.1, -0.3),
            "ground_speed": (),
            "stribeck_speed": (0.0, -1),
        },
    ),
}


@pytest.mark.parametrize("kind", PARTS)
def test_parts_of_models_check_their_numbers(kind):
    """A restitution of nan, or below 0, gave a motion without a word."""
    fitting, fields = PARTS[kind]
    for name, outside in fields.items():
        for value in (*NO_NUMBERS, *outside):
            with pytest.raises(saltus.ParameterError) as refusal:
                kind(**{**fitting, name: value})
            assert refusal.value.parameter == name
            assert fitting["name"] in str(refusal.value)
    for name in ("name", *(("group",) if kind is saltus.Contact else ())):
        with pytest.raises(saltus.ParameterError, match="must be a text"):
            kind(**{**fitting, name: 1.0})


def test_a_parameter_of_a_model_may_be_a_number_of_its_contact():
    """While its equations are traced it is a symbol; as a number it is checked."""

    @dataclass(frozen=True, kw_only=True)
    class Stopped(saltus.ContactModel):
        place: float = 0.5
        bounce: float = 0.8
        coordinates = ("x",)

        @property
        def contacts(self):
            return (
                saltus.Contact(
                    name="stop",
                    coordinate="x",
                    position=self.place,
                    sign=-1,
                    restitution=self.bounce,
                ),
            )

        def force(self, t, x, v, load):
            return 0.0

    system = saltus.System(model=Stopped(), impact=saltus.NewtonImpact())
    motion = saltus.simulate(system, x=0.0, velocity=1.0, duration=1.0)
    # it arrives at 0.5, and comes back with 0.8 of its speed
    assert (motion.x, motion.velocity) == (pytest.approx(0.5 - 0.8 * 0.5), pytest.approx(-0.8))
    for path, value in (("model.bounce", 1.5), ("model.bounce", -0.1)):
        with pytest.raises(saltus.ParameterError, match="restitution of the contact 'stop'"):
            system.with_({path: value})


@pytest.mark.parametrize("name", ["nope", "coordinates", "acceleration"])
def test_a_range_that_reads_no_number_is_refused(name):
    @dataclass(frozen=True, kw_only=True)
    class Spring(saltus.Model):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        k: float = field(default=1.0, metadata=saltus.number_range(above=name))

        def acceleration(self, t, x, velocity, side, load):
            return -self.k * x

    with pytest.raises(
        saltus.ParameterError, match=f"reads '{name}', which is no number of Spring"
    ):
        saltus.System(model=Spring())
