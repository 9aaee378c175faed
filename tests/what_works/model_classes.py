"""One system of each class of models, for what is tested of all of them: their pages, and the table
of what works with what.

Each class has one system, so that what is compiled for one verb serves the others. Their numbers
are those of ordinary motions: a load that repeats itself, some damping, and impacts or switches in
the first periods.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

import saltus
from saltus import Contact, Friction, Harmonic, Load, NewtonImpact, Relay, Surface, System


@saltus.register
@dataclass(frozen=True, kw_only=True)
class TwoMasses(saltus.Model):
    """A smooth model: two masses, of which one has a cubic spring."""

    damping: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, position, velocity, side, load):
        (x, y), (u, v) = position, velocity
        pull = 0.3 * (x - y)
        push = load.force(t) - self.damping * u - x - 0.4 * x**3 - pull
        return push, -self.damping * v - y + pull

    def kinetic_energy(self, t, position, velocity, side, load):
        return 0.5 * sum(v**2 for v in velocity)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class TwoBodies(saltus.ContactModel):
    """Two masses on springs which hit each other: the gap is a sum of coordinates."""

    clearance: float = 0.2
    damping: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        return (
            Contact(name="between", coordinate={"y": 1.0, "x": -1.0}, position=-self.clearance),
        )

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        return load.force(t) - self.damping * u - x, -self.damping * v - 2.0 * y


@saltus.register
@dataclass(frozen=True, kw_only=True)
class SoftStop(saltus.ContactModel):
    """A mass with a soft stop, which is a surface, and a second mass on a spring to it."""

    place: float = 0.3
    damping: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def surfaces(self):
        return (Surface(name="stop", coordinate="x", position=self.place),)

    def force(self, t, q, velocity, load, sides):
        (x, y), (u, v) = q, velocity
        back = (1.0 + sides.stop) / 2.0 * (5.0 * (x - self.place) + 0.1 * u)
        pull = 0.3 * (y - x) + 0.1 * (v - u)
        return load.force(t) - x - self.damping * u - back + pull, -y - self.damping * v - pull


@saltus.register
@dataclass(frozen=True, kw_only=True)
class RubbingBlock(saltus.ContactModel):
    """A block on a spring, pressed on a floor on which it rubs: friction in a contact."""

    friction: float = 0.1
    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="floor", coordinate="y"),)

    @property
    def frictions(self):
        return (Friction(name="rub", coordinate="x", kinetic=self.friction, contact="floor"),)

    def force(self, t, q, velocity, load):
        return load.force(t) - q[0] - self.damping * velocity[0], -1.0


@saltus.register
@dataclass(frozen=True, kw_only=True)
class CurvedGround(saltus.ContactModel):
    """A mass on springs over a valley: the gap is a function of the coordinates."""

    depth: float = 0.2
    damping: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="valley", coordinate={"y": 1.0, "ground": -1.0}),
    )

    def ground(self, q):
        return -self.depth * np.cos(q[0])

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        return load.force(t) - x - self.damping * u, 0.5 * load.force(t) - y - self.damping * v


@saltus.register
@dataclass(frozen=True, kw_only=True)
class RockingTable(saltus.ContactModel):
    """A table on a spring, with two feet that hit a floor and rub: contacts of distances."""

    friction: float = 0.3
    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "tilt")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="left", distance="left"),
        Contact(name="right", distance="right"),
    )

    @property
    def frictions(self):
        return tuple(
            Friction(name=f"{side} foot", rate=f"{side}_slip", contact=side, kinetic=self.friction)
            for side in ("left", "right")
        )

    def left(self, t, q, load):
        return q[1] - 0.5 * np.sin(q[2]) - 0.8 * np.cos(q[2])

    def right(self, t, q, load):
        return q[1] + 0.5 * np.sin(q[2]) - 0.8 * np.cos(q[2])

    def left_slip(self, t, q, velocity, load):
        return velocity[0] + velocity[2] * (0.8 * np.cos(q[2]) + 0.5 * np.sin(q[2]))

    def right_slip(self, t, q, velocity, load):
        return velocity[0] + velocity[2] * (0.8 * np.cos(q[2]) - 0.5 * np.sin(q[2]))

    def mass_matrix(self, q):
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.3]]

    def force(self, t, q, velocity, load):
        return load.force(t) - self.damping * velocity[0] - 0.4 * q[0], -1.0, 0.0


@saltus.register
@dataclass(frozen=True, kw_only=True)
class AsymmetricDamper(saltus.ContactModel):
    """A mass x with quadratic drag, and a mass y on a damper with two slopes to it."""

    drag: float = 0.1
    damping: float = 0.1
    bump: float = 0.1
    rebound: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="rebound", function="stretching"),)

    def stretching(self, t, q, velocity, load):
        return velocity[1] - velocity[0]

    def force(self, t, q, velocity, load, sides):
        (x, y), (u, v) = q, velocity
        slope = self.bump + (self.rebound - self.bump) * (1.0 + sides.rebound) / 2.0
        pull = y - x + slope * (v - u)
        return load.force(t) - 2.0 * x - self.drag * u * abs(u) - self.damping * u + pull, -pull


@saltus.register
@dataclass(frozen=True, kw_only=True)
class SwitchedMass(saltus.ContactModel):
    """A mass that a relay pushes back, and slows down as it goes on."""

    damping: float = 0.2
    push: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[tuple[Relay, ...]] = (
        Relay(name="valve", on="high", off="low", after_event="slowed"),
    )

    def high(self, t, x, velocity, load):
        return x - 0.1

    def low(self, t, x, velocity, load):
        return -0.1 - x

    def slowed(self, t, x, velocity, load):
        return x, 0.9 * velocity

    def force(self, t, x, velocity, load, sides):
        return load.force(t) - x - self.damping * velocity - self.push * sides.valve


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Harvester(saltus.ContactModel):
    """A mass before a stop with a voltage, which is a coordinate of first order."""

    damping: float = 0.1
    coupling: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x", "voltage")
    first_order: ClassVar[tuple[str, ...]] = ("voltage",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="stop", coordinate="x", position=0.4, sign=-1),
    )

    def force(self, t, q, velocity, load):
        (x, voltage), v = q, velocity[0]
        push = load.force(t) - x - self.damping * v - self.coupling * voltage
        return push, self.coupling * v - voltage / 1.4


def _row_of_masses(**parts: Any) -> saltus.Structure:
    stiffness = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    return saltus.Structure(
        mass=np.eye(3),
        damping=0.1 * np.eye(3),
        stiffness=stiffness,
        forces={"force": 0},
        names=("a", "b", "c"),
        **parts,
    )


def _pushed(amplitude: float = 0.4, frequency: float = 0.8) -> Load:
    return Load(frequency=frequency, force=Harmonic(amplitude))


@dataclass(frozen=True)
class ModelClass:
    """A class of models: its system, the state at the start, and what a reader calls it."""

    name: str
    # what the documentation calls it
    label: str
    system: Callable[[], System]
    start: dict[str, Any]
    # a number of the model or of its law, for derivatives and fits
    parameter: str = "model.damping"
    # the coordinate that is observed
    observed: str = "x"
    # half the width of the window in which attractors are looked for
    reach: float = 0.3

    @property
    def whole_start(self) -> dict[str, Any]:
        """The start with the amplitudes of a structure's modes."""
        model = self.system().model
        if not isinstance(model, saltus.Structure):
            return self.start
        sides = {name: self.start[name] for name in ("relays",) if name in self.start}
        place = {name: value for name, value in self.start.items() if name not in sides}
        return {**model.start(**place), **sides}


def _metainterface() -> System:
    return System(
        model=saltus.Metainterface(beta0=1.4, damping=0.2),
        load=Load(frequency=1.0, horizontal=Harmonic(0.4), vertical=-0.5),
        impact=saltus.VelocityReduction(0.9),
    )


def _rocking_block() -> System:
    return System(
        model=saltus.RockingBlock(alpha=0.25),
        load=Load(frequency=4.0, ground_horizontal=Harmonic(0.02)),
        impact=saltus.InelasticImpact(),
    )


def _wall() -> System:
    return System(
        model=saltus.WallOscillator(damping=0.2, wall=0.3),
        load=_pushed(),
        impact=saltus.VelocityReduction(0.6),
    )


def _smooth_under_a_square_wave() -> System:
    return System(
        model=TwoMasses(), load=Load(frequency=0.8, force=saltus.Square(0.4, phase=0.3, duty=0.4))
    )


def _wall_under_pulses() -> System:
    pulses = saltus.Table([0.0, 1.0, 1.0, 3.0], [0.4, 0.4, -0.2, -0.2])
    return System(
        model=saltus.WallOscillator(damping=0.2, wall=0.3),
        load=Load(frequency=0.8, force=pulses),
        impact=saltus.VelocityReduction(0.6),
    )


def _two_stops() -> System:
    return System(
        model=saltus.TwoStops(damping=0.2, left=-0.5, right=0.4),
        load=_pushed(),
        impact=NewtonImpact(0.6),
    )


def _impact_pair() -> System:
    return System(
        model=saltus.ImpactPair(damping=0.2, mass_ratio=0.1, clearance=0.5),
        load=_pushed(0.3, 1.0),
        impact=NewtonImpact(0.6),
    )


def _both_layers() -> System:
    return System(
        model=saltus.TwoLayer(beta0=1.4, damping=0.2),
        load=Load(frequency=1.0, horizontal=Harmonic(0.4), vertical=-0.5),
        impact=NewtonImpact(0.3, transfer=0.5),
    )


def _chain() -> System:
    return System(
        model=saltus.CellChain(cells=2, beta0=1.4, damping=0.2, coupling=0.1),
        load=Load(frequency=1.0, horizontal=Harmonic(0.4), vertical=-0.5),
        impact=NewtonImpact(0.3, transfer=0.5),
    )


def _belt() -> System:
    return System(
        model=saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.2, damping=0.1),
        load=_pushed(0.3),
    )


def _structure() -> System:
    stop = Contact(name="stop", coordinate="c", position=0.3, sign=-1)
    return System(model=_row_of_masses(contacts=[stop]), load=_pushed(), impact=NewtonImpact(0.5))


def _structure_with_soft_stop() -> System:
    stop = Surface(name="stop", coordinate="c", position=0.2, stiffness=5.0, damping=0.1)
    return System(model=_row_of_masses(surfaces=[stop]), load=_pushed())


def _structure_with_relay() -> System:
    """A damper at c is switched on above 0.2 and off below 0.1."""
    model = _row_of_masses(
        surfaces=[saltus.Relay(name="valve", on="high", off="low")],
        functions={
            "high": {"c": 1.0, "constant": -0.2},
            "low": {"c": -1.0, "constant": 0.1},
            "rate": {"c_velocity": 1.0},
        },
        switched=[
            saltus.SwitchedForce(
                name="damper", coordinate="c", surface="valve", function="rate", factor_on=-0.6
            )
        ],
    )
    return System(model=model, load=_pushed())


def _structure_with_function() -> System:
    """A damper between b and c is harder in rebound than in bump."""
    model = _row_of_masses(
        points={"strut": {"c": 1.0, "b": -1.0}},
        surfaces=[Surface(name="bump", function="closing")],
        functions={"closing": {"strut_velocity": -1.0}},
        switched=[
            saltus.SwitchedForce(
                name="damper",
                coordinate="strut",
                surface="bump",
                function="closing",
                factor_on=0.1,
                factor_off=0.6,
            )
        ],
    )
    return System(model=model, load=_pushed())


def _two_bodies() -> System:
    return System(model=TwoBodies(), load=_pushed(), impact=NewtonImpact(0.5))


def _curved() -> System:
    return System(model=CurvedGround(), load=_pushed(0.5), impact=NewtonImpact(0.5))


def _rocking_table() -> System:
    return System(model=RockingTable(), load=_pushed(0.5), impact=NewtonImpact(0.3))


def _harvester() -> System:
    return System(model=Harvester(), load=_pushed(), impact=NewtonImpact(0.6))


CLASSES = (
    ModelClass(
        "smooth",
        "a smooth model of your own, `Model`",
        lambda: System(model=TwoMasses(), load=_pushed()),
        {"x": 0.1, "y": 0.0},
    ),
    ModelClass(
        "one contact",
        "`Metainterface`, one contact",
        _metainterface,
        {"theta": 0.3},
        observed="theta",
    ),
    ModelClass(
        "rocking block",
        "`RockingBlock`",
        _rocking_block,
        {"theta": 0.05},
        "model.alpha",
        "theta",
        0.05,
    ),
    ModelClass("wall", "`WallOscillator`", _wall, {"x": 0.1}),
    ModelClass(
        "smooth, square wave",
        "a smooth model under a `Square`",
        _smooth_under_a_square_wave,
        {"x": 0.1, "y": 0.0},
    ),
    ModelClass(
        "wall, pulses",
        "`WallOscillator` under a `Table` with jumps",
        _wall_under_pulses,
        {"x": 0.1},
    ),
    ModelClass("two stops", "`TwoStops`", _two_stops, {"x": 0.1}),
    ModelClass("impact pair", "`ImpactPair`", _impact_pair, {"z": 0.1, "x": 0.1}),
    ModelClass(
        "both layers",
        "`TwoLayer`",
        _both_layers,
        {"theta_1": 0.2, "theta_2": 0.0},
        observed="theta_1",
    ),
    ModelClass(
        "chain of cells",
        "`CellChain`",
        _chain,
        {"lower_1": 0.2, "upper_1": 0.0, "lower_2": 0.1, "upper_2": 0.0},
        observed="lower_1",
    ),
    ModelClass("belt", "`BeltOscillator` under a load", _belt, {"x": 0.0, "velocity": 0.05}),
    ModelClass(
        "belt, no load",
        "`BeltOscillator` without a load",
        lambda: System(model=saltus.BeltOscillator()),
        {"x": 0.0, "velocity": 0.05},
        "model.belt_speed",
    ),
    ModelClass(
        "structure with a contact",
        "`Structure` with a contact",
        _structure,
        {"displacement": (0.1, 0.0, 0.0)},
        "model.contacts.stop.position",
        "c",
    ),
    ModelClass(
        "structure with a soft stop",
        "`Structure` with a soft stop",
        _structure_with_soft_stop,
        {"displacement": (0.1, 0.0, 0.0)},
        "model.surfaces.stop.stiffness",
        "c",
    ),
    ModelClass(
        "structure with a relay",
        "`Structure` with a `Relay` and a switched force",
        _structure_with_relay,
        {"displacement": (0.1, 0.0, 0.0), "relays": {"valve": False}},
        "model.functions.high.constant",
        "c",
    ),
    ModelClass(
        "structure with a function",
        "`Structure` with a surface of velocities and a switched force",
        _structure_with_function,
        {"displacement": (0.1, 0.0, 0.0)},
        "model.switched.damper.factor_off",
        "strut",
    ),
    ModelClass(
        "own, gaps between bodies",
        "your own: gaps between bodies",
        _two_bodies,
        {"x": 0.1, "y": 0.0},
    ),
    ModelClass(
        "own, with surfaces",
        "your own: surfaces",
        lambda: System(model=SoftStop(), load=_pushed()),
        {"x": 0.1, "y": 0.0},
    ),
    ModelClass(
        "own, friction in a contact",
        "your own: friction in a contact",
        lambda: System(model=RubbingBlock(), load=_pushed(), impact=NewtonImpact(0.3)),
        {"x": 0.1, "y": 0.1},
    ),
    ModelClass("own, curved gaps", "your own: curved gaps", _curved, {"x": 0.1, "y": 0.1}),
    ModelClass(
        "own, first order",
        "your own: a coordinate of first order",
        _harvester,
        {"x": 0.1, "voltage": 0.0},
    ),
    ModelClass(
        "own, two feet that rub",
        "your own: a contact of a `distance`",
        _rocking_table,
        {"x": 0.1, "y": 0.9, "tilt": 0.1},
    ),
    ModelClass(
        "own, switches",
        "your own: surfaces of velocities, and `abs` in a force",
        lambda: System(model=AsymmetricDamper(), load=_pushed()),
        {"x": 0.1, "y": 0.0},
    ),
    ModelClass(
        "own, relays",
        "your own: a `Relay` that resets the state",
        lambda: System(model=SwitchedMass(), load=_pushed()),
        {"x": 0.0, "relays": {"valve": False}},
    ),
)
NAMES = tuple(each.name for each in CLASSES)


@cache
def system_of(name: str) -> System:
    """The system of a class, made once."""
    return model_class(name).system()


def model_class(name: str) -> ModelClass:
    """A class by its name."""
    return CLASSES[NAMES.index(name)]
