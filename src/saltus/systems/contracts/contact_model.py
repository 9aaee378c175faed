"""The contract of a model with several contacts or dry friction, what may hold its coordinates, and
its accelerations then.

The accelerations take numbers, arrays or symbols.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from decimal import Decimal
from importlib import import_module
from numbers import Complex
from typing import Any, ClassVar, NamedTuple

import numpy as np

from saltus.checks import LIMITS, ManyNumbers, number_problem
from saltus.errors import ParameterError, shown
from saltus.number_ranges import number_range, ranges_of
from saltus.systems.contracts.model import Jet, Model, ask, is_zero
from saltus.systems.loads.load import LoadOnSides, Sides

Number = Any  # a float, or a parameter of the model while its equations are traced


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """A contact that keeps a coordinate q on one side of a position p: its gap is sign (q - p) >=
    0.

    While it is closed, q stays at p. Its reaction, the impulse or force on q times the sign, is not
    negative.

    Between bodies q is a sum of coordinates with constant coefficients, such as the distance y - x,
    and its reaction acts on each of them with its coefficient. A channel of the load that displaces
    the ground may be one of them: a wall that moves, or a table that shakes, q = x - zeta(t). So
    may functions h(q) of the coordinates, which are methods of the model: a corner, or a wall that
    is curved.

    Any other gap is a `distance`, a method of the model. A multiplier then holds it at 0, in the
    model's own coordinates, so that several corners of one body may rub.

    Parameters
    ----------
    name
        Its name, such as "lower", in events and in the names of stops.
    coordinate
        The name of the model's coordinate; or a dictionary of the coefficients of several, {"y":
        1.0, "x": -1.0} for y - x, and of load channels whose names begin with "ground", and of
        methods h(q) of the model. One coordinate at least must be read by none of these; where none
        is, a method h_inverse(value) is needed that gives the single coordinate of which h is.
    sign
        +1 where the coordinate stays above the position, -1 where it stays below.
    position
        p, a number, which may be one of the model's parameters.
    group
        The contact's group: an impact passes speed on to the other contacts of its group
        (`transfer`).
    restitution
        e of the impacts that close it, in [0, 1]; by default that of the system's impact law.
    distance
        In place of a coordinate: the name of the model's method that gives the gap, as
        `height(t, q, load)`.

    Examples
    --------
    >>> right = saltus.Contact(name="right", coordinate="x", position=1.0, sign=-1)
    >>> right.gap(0.25)
    0.75
    >>> between = saltus.Contact(name="between", coordinate={"y": 1.0, "x": -1.0}, position=0.2)  # y - x >= 0.2
    >>> corner = saltus.Contact(name="corner", coordinate={"y": 1.0, "depth": -1.0})  # y >= depth(q), a method of the model
    """

    name: str
    coordinate: Any = None
    sign: int = 1
    position: Number = 0.0
    group: str = ""
    restitution: Number | None = field(
        default=None, metadata=number_range(at_least=0.0, at_most=1.0)
    )
    distance: str | None = None

    def __post_init__(self) -> None:
        if (
            self.distance is None
            and self.coordinate is not None
            and type(self.position) is float
            and -LIMITS.value <= self.position <= LIMITS.value
            and self.restitution is None
            and type(self.sign) is int
            and self.sign in (1, -1)
            and type(self.name) is str
            and self.name
            and type(self.group) is str
        ):
            return  # as nearly always; a model makes its contacts at each call
        _check_texts(self, "name", "group")
        _check_function(self, "distance", sign=1, position=0.0)
        _check_sign(self)
        _check_numbers(self, "position")
        if self.restitution is not None:
            _check_numbers(self, "restitution")

    def gap(self, position: Any) -> Any:
        """sign (q - p), at a position q.

        Parameters
        ----------
        position
            The coordinate q, or the distance.
        """
        return self.sign * (position - self.position)


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Coulomb friction along a coordinate q on a ground that moves with the speed w, under a normal
    force N:

        it slides, and the force on q is -mu N sign(q' - w), or it sticks, q' = w, and the force is
        at most mu_s N.

    N is the reaction of a contact, if one is named, and else the model's `normal_forces`, of time,
    state and load. mu is mu_k, or falls with u = abs(q' - w) as Stribeck has it: mu_k + (mu_s -
    mu_k) exp(-u / v_s). A friction in a contact acts along another coordinate, while it is closed
    and at its impacts J, with impulses of at most mu_k J.

    Parameters
    ----------
    name
        Its name, such as "belt", in events.
    coordinate
        The name of the model's coordinate, or a dictionary of the coefficients of several, as of a
        `Contact`.
    kinetic
        mu_k, a number, which may be one of the model's parameters.
    static
        mu_s, at least mu_k; by default mu_k.
    ground_speed
        w, the speed of the ground.
    contact
        The name of the contact whose reaction is N; by default N is given by the model.
    stribeck_speed
        v_s, above 0; by default mu = mu_k at all speeds.
    rate
        In place of a coordinate: the name of the model's method that gives the sliding speed, as
        `slip(t, q, velocity, load)`, in which the velocities are linear.

    Examples
    --------
    >>> saltus.Friction(name="belt", coordinate="x", kinetic=0.2, static=0.3, ground_speed=0.5).static
    0.3
    >>> falling = saltus.Friction(name="belt", coordinate="x", kinetic=0.2, static=0.3, stribeck_speed=0.1)
    >>> round(float(falling.coefficient(0.1)), 6)
    0.236788
    """

    name: str
    coordinate: Any = None
    kinetic: Number = field(metadata=number_range(at_least=0.0))
    static: Number | None = field(default=None, metadata=number_range(at_least="kinetic"))
    ground_speed: Number = 0.0
    contact: str | None = None
    stribeck_speed: Number | None = field(default=None, metadata=number_range(above=0.0))
    rate: str | None = None

    def __post_init__(self) -> None:
        _check_texts(self, "name", *(() if self.contact is None else ("contact",)))
        _check_function(self, "rate")
        _check_numbers(self, "kinetic", "ground_speed")
        if self.static is not None:
            _check_numbers(self, "static")
            lowest = _real(self.kinetic)
            highest = _real(self.static)
            if _is_number(lowest) and _is_number(highest) and highest < lowest:
                raise ParameterError(
                    f"static of {called_part(self)} must be at least kinetic = {lowest:g}, got"
                    f" {highest:g}",
                    "static",
                )
        if self.stribeck_speed is not None:
            _check_numbers(self, "stribeck_speed")

    @property
    def limit(self) -> str:
        """The name of the limit at which a motion ends: no normal force presses, or more than one
        reaction is possible.
        """
        return (
            f"normal force of {self.name}"
            if self.contact is None
            else f"Painleve's paradox at {self.contact}"
        )

    @property
    def most(self) -> Any:
        """mu_s."""
        return self.kinetic if self.static is None else self.static

    def coefficient(self, speed: Any) -> Any:
        """mu at a sliding speed.

        Parameters
        ----------
        speed
            u, not negative.
        """
        if self.stribeck_speed is None:
            return self.kinetic
        return self.kinetic + (self.most - self.kinetic) * np.exp(-speed / self.stribeck_speed)

    def slipping(self, velocity: Any, direction: Any) -> Any:
        """mu sign(q' - w) at a velocity q' along which it slides in a direction, +1 or -1; 0 if it
        sticks, 0.

        Parameters
        ----------
        velocity
            q'.
        direction
            The sign.
        """
        return direction * self.coefficient(direction * (velocity - self.ground_speed))


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """A surface q = p of the state space that motions pass, and on whose two sides the right-hand
    side may differ:

        M(q) q'' = r(t, q, v, s),    s = sign (q - p) / abs(q - p) = +1 or -1.

    A soft stop, a backlash, a spring with two stiffnesses or a preload are such; q may be a sum of
    coordinates as that of a `Contact`. At a crossing coordinates and velocities are continuous. The
    model's `force` reads s by the surface's name.

    Any other surface is a `function`, a method of the model, and s is its sign: a damper with two
    slopes, a spring that never pulls.

    Parameters
    ----------
    name
        Its name, such as "stop", in events and in the argument `sides` of `force`.
    coordinate
        The name of the model's coordinate, or a dictionary of the coefficients of several.
    position
        p, a number, which may be one of the model's parameters.
    sign
        +1 where s is +1 above the position, -1 where it is +1 below.
    stiffness, damping
        k and c of the force -k (q - p) - c q' that acts on the side +1, of a `Structure`; another
        model has it in its `force`.
    function
        In place of a coordinate: the name of the model's method whose sign is s, as `rebound(t, q,
        velocity, load)`.
    after_event
        The name of the model's method by which the state is reset where s becomes +1, as
        `fired(t, q, velocity, load)`. It returns all coordinates and all velocities after the
        event, of the kinds that it takes; velocities of coordinates of first order are not read.
        By default nothing jumps. A reset in the other direction is that of another surface, whose
        function has the other sign.

    Examples
    --------
    >>> saltus.Surface(name="stop", coordinate="x", position=1.0).side([0.5, 1.5])
    array([-1.,  1.])
    """

    name: str
    coordinate: Any = None
    position: Number = 0.0
    sign: int = 1
    stiffness: Number = 0.0
    damping: Number = 0.0
    function: str | None = None
    after_event: str | None = None

    # answers to the questions of parts (`flow/contacts/parts.py`)
    kind: ClassVar[str] = "function"  # of one that is a function
    remembered: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _check_texts(self, "name", *(() if self.after_event is None else ("after_event",)))
        _check_function(self, "function", position=0.0, sign=1, stiffness=0.0, damping=0.0)
        _check_sign(self)
        _check_numbers(self, "position", "stiffness", "damping")

    def side(self, position: Any, below: bool = False) -> Any:
        """s, +1 or -1, at a position q.

        Parameters
        ----------
        position
            The coordinate q, or the value of the function.
        below
            Whether q = p itself counts as below the position; by default it counts as above.
        """
        value = np.asarray(position.value if isinstance(position, Jet) else position)
        above = value > self.position if below else value >= self.position
        return self.sign * np.where(above, 1.0, -1.0)[()]

    @property
    def methods(self) -> tuple[str, ...]:
        """The names of the model's methods that its guard calls."""
        return () if self.function is None else (self.function,)

    def guard(self, owner: Any, own_side: Any, *at: Any) -> Any:
        """The value of its function, whose sign is its side.

        Parameters
        ----------
        owner
            The model that has it.
        own_side
            Its side, which says nothing.
        at
            The time, the coordinates, their velocities and the load.
        """
        return owner.value_of_function(self, *at)

    def marks(self, owner: Any) -> dict[str, int]:
        """Columns of its row in the table of parts, with their numbers.

        Parameters
        ----------
        owner
            The model that has it.
        """
        return _mark_of_reset(self, owner)


@dataclass(frozen=True, slots=True, kw_only=True)
class Relay:
    """A relay with hysteresis, one of a model's `surfaces`: its side s is remembered, and does not
    follow from the state alone.

        s becomes +1 where the function `on` rises through 0, and -1 where `off` does.

    Between the two it keeps its side: a thermostat, a valve, a controller that is held at its
    limit. The model's `force` reads s by the relay's name, +1 while it is on and -1 while it is
    off. A motion is told its side at the start, `relays={"heater": True}`, unless one of the
    functions is positive there.

    Parameters
    ----------
    name
        Its name, such as "heater", in events and in the argument `sides` of `force`.
    on, off
        The names of two methods of the model, as `too_cold(t, q, velocity, load)`. They are not
        positive at one state both.
    after_event
        The name of the model's method by which the state is reset where the relay goes on, as that
        of a `Surface`.

    Examples
    --------
    >>> saltus.Relay(name="heater", on="too_cold", off="too_warm").off
    'too_warm'
    """

    name: str
    on: str
    off: str
    after_event: str | None = None

    # what every surface has
    coordinate: ClassVar[None] = None
    position: ClassVar[float] = 0.0
    sign: ClassVar[int] = 1
    stiffness: ClassVar[float] = 0.0
    damping: ClassVar[float] = 0.0

    # answers to the questions of parts (`flow/contacts/parts.py`)
    kind: ClassVar[str] = "relay"
    remembered: ClassVar[bool] = True

    def __post_init__(self) -> None:
        own = () if self.after_event is None else ("after_event",)
        _check_texts(self, "name", "on", "off", *own)

    @property
    def function(self) -> str:
        """The function at which it goes on."""
        return self.on

    @property
    def methods(self) -> tuple[str, ...]:
        """The names of the model's methods that its guard calls."""
        return (self.on, self.off)

    def guard(self, owner: Any, own_side: Any, *at: Any) -> Any:
        """What changes its sign at its event on a side: while it is off `on`, and while it is on
        minus `off`.

        Parameters
        ----------
        owner
            The model that has it.
        own_side
            Its side, +1 or -1, or the symbol of it.
        at
            The time, the coordinates, their velocities and the load.
        """
        on, off = (owner.value_of_function(self, *at, name) for name in (self.on, self.off))
        return 0.5 * (1.0 - own_side) * on - 0.5 * (1.0 + own_side) * off

    def start_side(self, owner: Any, given: bool | None, *at: Any) -> int:
        """Its side at the start, as its functions set it or, between these, as it is given.

        Parameters
        ----------
        owner
            The model that has it.
        given
            Whether it is on, or None.
        at
            The time, the coordinates, their velocities and the load.

        Raises
        ------
        ParameterError
            Both functions are positive, or neither is and it is not given.
        """
        on, off = (float(owner.value_of_function(self, *at, name)) for name in (self.on, self.off))
        if on > 0.0 and off > 0.0:
            raise ParameterError(
                f"{self.on} and {self.off}, by which the relay {self.name!r} goes on and off,"
                f" are both positive at the start ({on:g} and {off:g}): one state can set it to one"
                " side only",
                "relays",
            )
        if given is None and on <= 0.0 and off <= 0.0:
            raise ParameterError(
                f"the start does not say whether the relay {self.name!r} is on: give"
                f" relays={{{self.name!r}: True}}, or False",
                "relays",
            )
        return 1 if on > 0.0 or (off <= 0.0 and given) else -1

    def marks(self, owner: Any) -> dict[str, int]:
        """Columns of its row in the table of parts, with their numbers.

        Parameters
        ----------
        owner
            The model that has it.
        """
        return _mark_of_reset(self, owner)


def _mark_of_reset(part: Surface | Relay, model: Any) -> dict[str, int]:
    """The number of the reset in the row of a surface that resets the state where its side becomes
    +1."""
    if part.after_event is None:
        return {}
    return {"RESETS": part.sign * (1 + model.resets.index(part.name))}


# the largest imaginary part by which derivatives to a number of a model are taken
COMPLEX_STEP = 1e-100


def _is_number(value: Any) -> bool:
    """Whether a value is given, and is not a parameter of a model whose equations are traced: such
    a symbol can be computed with, and is no array but that of many motions.
    """
    if isinstance(value, ManyNumbers):
        return False
    symbol = hasattr(value, "__radd__") and not hasattr(value, "__array__")
    return not symbol or isinstance(value, (Complex, Decimal, timedelta))


def _real(value: Any) -> Any:
    """A value without the imaginary part by which a derivative is taken, which is no part of it."""
    small = isinstance(value, complex) and 0.0 < abs(value.imag) <= COMPLEX_STEP
    return value.real if small else value


def _check_numbers(part: Contact | Friction | Surface, *names: str) -> None:
    """Refuse anything but finite numbers within their declared ranges in the fields of a part of a
    model.
    """
    kind: Any = type(part)
    ranges = ranges_of(kind)
    for name in names:
        value = getattr(part, name)
        bounds: dict[str, Any] = dict(ranges[name].bounds) if name in ranges else {}
        if type(value) is float and not bounds and -LIMITS.value <= value <= LIMITS.value:
            continue
        value = _real(value)
        problem = number_problem(value, **bounds) if _is_number(value) else None
        if problem is not None:
            raise ParameterError(f"{name} of {called_part(part)} {problem}", name)


def _check_texts(part: Contact | Friction | Surface | Relay, *names: str) -> None:
    """Refuse anything but texts in the fields of a part of a model."""
    for name in names:
        value = getattr(part, name)
        if not isinstance(value, str) or (name == "name" and not value):
            what = type(part).__name__
            raise ParameterError(f"{name} of a {what} must be a text, got {shown(value)}", name)


def _check_function(part: Contact | Friction | Surface, name: str, **usual: Any) -> None:
    """Refuse a part with neither a coordinate nor a function, or with both, and a function beside
    fields that only a coordinate has."""
    function = getattr(part, name)
    if (function is None) == (part.coordinate is None):
        got = "neither" if function is None else "both"
        raise ParameterError(
            f"{called_part(part)} must have a coordinate, or the name of a method of the model as"
            f" its {name}, got {got}",
            name,
        )
    if function is None:
        return
    _check_texts(part, name)
    for other, value in usual.items():
        given = getattr(part, other)
        if isinstance(given, bool) or not isinstance(given, type(value)) or given != value:
            raise ParameterError(
                f"{called_part(part)} has a {name}, which says all: leave its {other} out", other
            )


def _check_sign(part: Contact | Surface) -> None:
    """Refuse a sign that is none."""
    value = part.sign
    if number_problem(value) is not None or value not in (1, -1):
        raise ParameterError(
            f"the sign of {called_part(part)} must be +1 or -1, got {shown(value)}", "sign"
        )


def called_part(part: Contact | Friction | Surface | Relay) -> str:
    """What a part of a model is called in a sentence."""
    return f"the {type(part).__name__.lower()} {shown(part.name)}"


# Those closed are bits of a whole number; a friction or a surface takes two.
MOST_CONTACTS = np.iinfo(np.int64).bits
# Which frictions stick, and which way the others slide, is found by trying 3^n choices at worst.
MOST_FRICTIONS = 6
# Which contacts of a distance close and act is found by trying 2^n choices.
MOST_MULTIPLIERS = 8


class ContactModel(Model):
    """An oscillator of one or more coordinates with several contacts, contacts that hold single
    coordinates, or dry friction:

        M(q) q'' = r(t, q, v) + the reactions of closed contacts + the frictions.

    Besides what a `Model` has (`coordinates`, `channels`, optional parts) give it:

    1. `force`, r(t, q, v); its accelerations follow from it;
    2. `mass_matrix`, M(q), symmetric and positive definite, where that is not the identity;
    3. `contacts`, a tuple of `Contact`, each of which keeps one coordinate, or a sum, on one side
       of a position. While
       a contact is closed it holds it as long as its reaction presses; impacts follow the system's
       law (`NewtonImpact`);
    4. `frictions`, a tuple of `Friction`, and their `normal_forces` N(t, q, v), by default 1, of
       those that are in no contact.
       A friction that sticks holds the velocity of its coordinate, or of a sum of several;
    5. `surfaces`, a tuple of `Surface`. Then `force` takes a further argument, r(t, q, v, load,
       sides), and reads `sides.stop`,
       +1 or -1, of the surface "stop". A `Relay` among them remembers its side;
    6. optionally `after_impact`, by which the coordinates of first order jump at impacts,
       `transfers` (whether an impact passes
       speed on to the other contacts of its group, as a crossing does) and `singularity`, a name
       for where M(q) has no inverse: a motion that gets there ends with this name as `limit`.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Ball(saltus.ContactModel):
    ...     coordinates = ("height",)
    ...     contacts = (saltus.Contact(name="floor", coordinate="height"),)
    ...     def force(self, t, height, velocity, load):
    ...         return -1.0
    >>> ball = saltus.System(model=Ball(), impact=saltus.NewtonImpact(e=0.5))
    >>> saltus.simulate(ball, height=2.0, duration=3.0).impacts.time  # the fall from a height of 2
    array([2.])
    """

    __slots__ = ()

    transfers: ClassVar[bool] = False

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """The acceleration M^-1 r without contacts and frictions.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        side
            Any number: there are no sides.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        """
        size = len(self.coordinates)
        solved = solved_motion(self, t, theta, velocity, load, [1.0] * size).acceleration
        return solved[0] if size == 1 else tuple(solved)

    @property
    def friction_limits(self) -> tuple[str, ...]:
        """The limits at which its frictions end a motion: that of one in a contact only where M(q)
        depends on q, as it is else known from the start whether reactions are the only ones."""
        pressed = [friction for friction in self.frictions if friction.contact is not None]
        if pressed and not self.has_multipliers:
            size = len(self.coordinates)
            # any numbers
            one, other = (
                mass_rows(self, tuple(x / (1 + i) for i in range(size))) for x in (0.13, 0.21)
            )
            pressed = pressed if np.not_equal(one, other).any() else []
        return tuple(
            friction.limit
            for friction in self.frictions
            if friction.contact is None or friction in pressed
        )

    def reaches(self, coordinate: str, values: Any) -> Any:
        """Whether a coordinate can have these values: where the gap of none of its contacts is
        negative.

        Parameters
        ----------
        coordinate
            Its name.
        values
            The values, an array.
        """
        gaps = [
            np.asarray(contact.gap(values))
            for contact in self.contacts
            if contact.coordinate == coordinate
        ]
        return np.min(gaps or [np.zeros(np.shape(values))], axis=0) >= 0.0

    def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        """r(t, q, v) of M(q) q'' = r, while no contact and no friction acts.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        """
        raise NotImplementedError(
            f"{type(self).__name__} must define force(t, theta, velocity, load)"
        )

    @property
    def has_switches(self) -> bool:
        """Whether a surface is a function, or the force has switches of its own, such as an absolute
        value.
        """
        given = any(surface.function is not None for surface in self.surfaces)
        return given or bool(switches_of_force(self))

    @property
    def force_jumps(self) -> bool:
        """Whether the force has switches of its own at which it may jump: signs and comparisons."""
        return bool(switches_of_force(self) - CONTINUOUS)

    @property
    def relays(self) -> tuple[Relay, ...]:
        """Those of its surfaces whose side is remembered."""
        parts: tuple[Any, ...] = self.surfaces
        return tuple(part for part in parts if part.remembered)

    @property
    def resets(self) -> tuple[str, ...]:
        """The names of the surfaces at whose events its state jumps."""
        return tuple(part.name for part in self.surfaces if part.after_event is not None)

    @property
    def holds_coordinates(self) -> bool:
        """Whether contacts or frictions may hold its coordinates one by one, while the others move
        on, or it has surfaces, or its force has switches.
        """
        return Model.holds_coordinates.fget(self) or bool(  # type: ignore[attr-defined]
            switches_of_force(self)
        )

    def value_of_function(
        self, surface: Surface | Relay, t: Any, q: Any, v: Any, load: Any, name: str | None = None
    ) -> Any:
        """The value of a surface's function.

        Parameters
        ----------
        surface
            The surface.
        t, q, v, load
            The time, the coordinates, their velocities and the load, as the function takes them.
        name
            The function's name, of a relay, which has two.

        Raises
        ------
        ParameterError
            It is no number.
        """
        name = name or str(surface.function)
        value = ask(self, name, t, q, v, load)
        if value is None or isinstance(value, (tuple, list, str, dict)):
            raise ParameterError(
                f"{name} of {type(self).__name__}, the function of"
                f" {called_part(surface)}, must return one number, got {shown(value)}",
                "function",
            )
        return value

    def mass_matrix(self, theta: Any) -> Any:
        """M(q): rows of numbers, symmetric and positive definite; with one coordinate a number, or
        [[M]].

        Parameters
        ----------
        theta
            The coordinate q; a tuple where there are several.
        """
        size = len(self.coordinates)
        return 1.0 if size == 1 else [[float(i == j) for j in range(size)] for i in range(size)]

    @property
    def jumps(self) -> bool:
        """Whether coordinates of first order jump at impacts."""
        return getattr(self, "own_class", type(self)).after_impact is not ContactModel.after_impact

    def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
        """The coordinates of first order just after an impact, a number or a tuple of several; by
        default those before it.

        Where contacts of one block close together, the last of them counts, and the end of an
        accumulation of impacts counts as one impact.

        Parameters
        ----------
        contact
            The name of the contact that closes.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate before the impact, of the same kind.
        """
        return tuple(theta[len(self.moving) :])

    def normal_forces(self, t: Any, theta: Any, velocity: Any, load: Any) -> tuple[Any, ...]:
        """The normal force N of each friction; the motion ends where one is not positive. By
        default it is 1, so that mu N is mu.

        There is one number for each friction, in their order; that of a friction in a contact is
        not used, as the contact's reaction presses it.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        load
            The load, whose channels are called with the time.
        """
        return (1.0,) * len(self.frictions)


CONTINUOUS = {"absolute", "maximum", "minimum"}  # operations across whose switches values go on


def switches_of_force(model: Any) -> frozenset[str]:
    """The operations by which the force of a class of models has switches of its own: absolute
    values, signs, maxima, comparisons.

    The tracer is in a room above this one, which is asked by its name.
    """
    kind = getattr(model, "own_class", type(model))
    if kind not in _switching:
        _switching[kind] = frozenset()  # while it is asked
        own_name = vars(sys.modules.get(kind.__module__, object)).get(kind.__name__)
        if kind.__module__.partition(".")[0] != "saltus" or own_name is not kind:
            _switching[kind] = import_module("saltus.taylor").switches_of_force(model)
    return _switching[kind]


_switching = dict[type, frozenset[str]]()


class SolvedMotion(NamedTuple):
    """What `solved_motion` finds."""

    acceleration: list[Any]
    along: dict[int, Any]  # the force along each dependent sum, by its place among the coordinates
    # and its row for impacts, in the place of that of the mass matrix: minus its coefficients, then
    # 1
    sums: dict[int, list[Any]]


def solved_motion(
    model: Model, t: Any, q: Any, v: Any, load: Any, free: Sequence[Any], slides: Sequence[Any] = ()
) -> SolvedMotion:
    """The accelerations a of (D M D + 1 - D) a = D r, with D = diag(free): 1 where a coordinate is
    free, 0 where it is held.

    r has the force of each friction that slides, -mu N s with its direction s in `slides`, 0 where
    it sticks. Behind them may be +1 or -1 for each surface: whether its coordinate is above the
    position; else the state says so. Where N is the reaction of a contact, plus or minus the row n
    of M a - r, its multiple is added to the row of the friction.

    q and v are scalars where there is one coordinate, else tuples. The matrix is eliminated from
    its first row on, without exchanging rows, as the pivots of a positive definite matrix are
    positive; rows of frictions in contacts come last.

    A dependent sum (`InGapCoordinates`) has a row g of coefficients of the others. While its
    contact is closed, h = 1, and else h = 0, a force l acts along it, which keeps g a = b:

        D M a - h D g' l = D r,    h g D a + (1 - h) l = h b.
    """
    load = on_sides(model, load, slides)
    mass, force = mass_and_force(model, t, q, v, load)
    late: list[int] = []
    if not model.has_multipliers:  # whose frictions are rows (`taylor/multipliers.py`)
        late = _add_frictions(
            model, v, mass, force, (normal_forces(model, t, q, v, load), slides, free)
        )
    size = len(force)
    matrix = [[held_entry(mass[i][j], i, j, free) for j in range(size)] for i in range(size)]
    right = [free[i] * force[i] for i in range(size)]
    sums = dependent_sums(model, t, q, v, load)
    for place, (row, bend) in sums.items():
        held = 1.0 - free[place]
        for j, entry in enumerate(row):
            matrix[place][j] = 0.0 if is_zero(entry) else held * free[j] * entry
            matrix[j][place] = 0.0 if is_zero(entry) else -matrix[place][j]
        matrix[place][place], right[place] = free[place], held * bend
    order = [*(i for i in range(size) if i not in late and i not in sums), *late, *sums]
    solved = eliminated(matrix, right, order)
    along = {place: (1.0 - free[place]) * solved[place] for place in sums}
    rows = {
        i: [1.0 if j == i else 0.0 if is_zero(x) else -x for j, x in enumerate(row)]
        for i, (row, _) in sums.items()
    }
    return SolvedMotion(
        [free[i] * force[i] if i in sums else x for i, x in enumerate(solved)], along, rows
    )


def eliminated(matrix: list[list[Any]], right: list[Any], order: Sequence[int]) -> list[Any]:
    """The solution of a linear system whose rows are eliminated in an order, without exchanges;
    both arguments are changed."""
    for number, k in enumerate(order):
        for i in order[number + 1 :]:
            if is_zero(matrix[i][k]):
                continue
            factor = matrix[i][k] / matrix[k][k]
            for j in order[number + 1 :]:
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j]
            right[i] = right[i] - factor * right[k]
    solved: list[Any] = [0.0] * len(right)
    for number, i in reversed([*enumerate(order)]):
        value = right[i]
        for j in order[number + 1 :]:
            if not is_zero(matrix[i][j]):
                value = value - matrix[i][j] * solved[j]
        solved[i] = value / matrix[i][i]
    return solved


def dependent_sums(
    model: Any, t: Any, q: Any, v: Any, load: Any
) -> dict[int, tuple[list[Any], Any]]:
    """The dependent sums of a model in coordinates of its gaps, by their places among these
    (`InGapCoordinates`).
    """
    found = model.dependent_sums(t, q, v, load) if getattr(model, "dependent", 0) else []
    return dict(enumerate(found, len(model.coordinates) - len(found)))


def _add_frictions(
    model: Model, v: Any, mass: list[list[Any]], force: list[Any], given: tuple[Any, ...]
) -> list[int]:
    """Add the forces of frictions that slide to the rows M and r; returns the places of those in
    contacts.
    """
    names = model.coordinates
    normals, slides, free = given
    late = dict[int, None]()
    rates = v if len(names) > 1 else [v]
    for friction, normal, s in zip(model.frictions, normals, slides, strict=False):
        place = names.index(friction.coordinate)
        if friction.contact is None:
            force[place] = force[place] - friction.slipping(rates[place], s) * normal
    for friction, s in zip(model.frictions, slides, strict=False):
        if friction.contact is not None:
            place = names.index(friction.coordinate)
            contact = contact_of(model, friction)
            held = names.index(contact.coordinate)
            share = contact.sign * friction.slipping(rates[place], s) * (1.0 - free[held])
            mass[place] = [
                a if is_zero(b) else a + share * b
                for a, b in zip(mass[place], mass[held], strict=True)
            ]
            force[place] = force[place] + share * force[held]
            late[place] = None
    return list(late)


def contact_of(model: Model, friction: Friction) -> Contact:
    """The contact whose reaction presses a friction."""
    return next(contact for contact in model.contacts if contact.name == friction.contact)


def reactions(
    model: Model,
    t: Any,
    q: Any,
    v: Any,
    a: Sequence[Any],
    load: Any,
    slides: Sequence[Any] = (),
    along: Any = (),
) -> list[Any]:
    """The force of each contact along its sign, sign (M a - r)_i; 0 where its coordinate is free.

    r then has the force of a friction along this coordinate. While it sticks it carries what it
    can, so that the force is sign (M a - r)_i + mu_s N, which vanishes when the friction cannot
    hold the coordinate alone any more. Without `slides` it does what it does in a closed contact.
    `along` has the forces along dependent sums (`solved_motion`), which are reactions.
    """
    slides = (
        slides if len(slides) else [np.sign(-friction.ground_speed) for friction in model.frictions]
    )
    lacking = _lacking(model, t, q, v, a, (on_sides(model, load, slides), along))
    names = model.coordinates
    found = [contact.sign * lacking[names.index(contact.coordinate)] for contact in model.contacts]
    for friction, normal, s in zip(
        model.frictions, _pressing(model, t, q, v, load, lacking), slides, strict=False
    ):
        for i, contact in enumerate(model.contacts):
            if contact.coordinate == friction.coordinate:
                slips = friction.slipping(
                    v[names.index(friction.coordinate)] if len(names) > 1 else v, s
                )
                found[i] = (
                    found[i] + (contact.sign * slips + (1.0 - s * s) * friction.most) * normal
                )
    return found


def stick_margins(
    model: Model,
    t: Any,
    q: Any,
    v: Any,
    a: Sequence[Any],
    load: Any,
    slides: Sequence[Any] = (),
    along: Any = (),
) -> list[Any]:
    """mu_s N - l and mu_s N + l of each friction, one after the other, with the force l = (M a -
    r)_i that makes it stick.
    """
    lacking = _lacking(model, t, q, v, a, (on_sides(model, load, slides), along))
    margins = []
    for friction, normal in zip(
        model.frictions, _pressing(model, t, q, v, load, lacking), strict=True
    ):
        force = lacking[model.coordinates.index(friction.coordinate)]
        most = friction.most * normal
        margins += [most - force, most + force]
    return margins


def _pressing(model: Model, t: Any, q: Any, v: Any, load: Any, lacking: Sequence[Any]) -> list[Any]:
    """The normal force of each friction, from M a - r."""
    forces = list(normal_forces(model, t, q, v, load))
    for k, friction in enumerate(model.frictions):
        if friction.contact is not None:
            contact = contact_of(model, friction)
            forces[k] = contact.sign * lacking[model.coordinates.index(contact.coordinate)]
    return forces


def normal_forces(model: Any, t: Any, q: Any, v: Any, load: Any) -> tuple[Any, ...]:
    """The normal force N of each friction.

    Raises
    ------
    ParameterError
        The model does not give as many as it has frictions.
    """
    given = ask(model, "normal_forces", t, q, v, load) if model.frictions else ()
    if len(given) != len(model.frictions):
        kind = type(model).__name__
        count = len(model.frictions)
        raise ParameterError(
            f"{kind}.normal_forces must return {count} value(s), one for each friction, got "
            f"{given!r}",
            "model",
        )
    return tuple(given)


def _lacking(
    model: Model, t: Any, q: Any, v: Any, a: Sequence[Any], given: tuple[Any, Any]
) -> list[Any]:
    """M a - r, the force that must act on each coordinate besides r, and besides those along
    dependent sums, for these accelerations; of a dependent sum the force along it."""
    load, along = given
    mass, force = mass_and_force(model, t, q, v, load)
    found = [
        sum(m * x for m, x in zip(row, a, strict=True) if not is_zero(m)) - r
        for row, r in zip(mass, force, strict=True)
    ]
    for place, (row, _) in dependent_sums(model, t, q, v, load).items():
        found[place] = along[place]
        for j, entry in enumerate(row):
            found[j] = found[j] if is_zero(entry) else found[j] - entry * along[place]
    return found


def mass_and_force(
    model: Any, t: Any, q: Any, v: Any, load: Any
) -> tuple[list[list[Any]], list[Any]]:
    """M(q) as rows and r(t, q, v) as a list, for any number of coordinates."""
    force = ask(model, "force", t, q, v, load, *sides_for(model, t, q, v, load))
    return mass_rows(model, q, t, load), [force] if len(model.coordinates) == 1 else list(force)


def mass_rows(model: Any, q: Any, t: Any = 0.0, load: Any = None) -> list[list[Any]]:
    """M(q) as rows, for any number of coordinates; where walls move it depends on time, without a
    load as if none moved.
    """
    mass = (
        ask(model, "mass_matrix", q, t, load)
        if getattr(model, "has_moving_walls", False)
        else ask(model, "mass_matrix", q)
    )
    if len(model.coordinates) == 1:
        return [[single_mass(mass)]]
    return [list(row) for row in mass]


def single_mass(mass: Any) -> Any:
    """M of one coordinate, which may be given as [[M]]."""
    while isinstance(mass, (tuple, list)) or (isinstance(mass, np.ndarray) and mass.ndim):
        (mass,) = mass
    return mass


def on_sides(model: Any, load: Any, slides: Sequence[Any]) -> Any:
    """The load together with the sides of surfaces, if these are given behind the directions of the
    frictions.
    """
    above = slides[len(model.frictions) :]
    if not (model.surfaces and len(above)):
        return load
    return LoadOnSides(
        load,
        Sides({each.name: each.sign * s for each, s in zip(model.surfaces, above, strict=True)}),
    )


def sides_for(
    model: Any, t: Any, q: Any, v: Any, load: Any, below: bool = False
) -> tuple[Sides, ...]:
    """The argument `sides` of a model's force, if it takes one: those that come with the load, else
    those of the state. At a surface itself they are those above it, or `below` it.
    """
    if not model.surfaces:
        return ()
    if isinstance(load, LoadOnSides):
        return (load.sides,)
    known = dict(zip(model.coordinates, q if len(model.coordinates) > 1 else (q,), strict=True))

    def value_of(name: str) -> Any:
        """The value of a term of a sum: a coordinate, a displacement of the ground or a function of
        the model.
        """
        return (
            known[name]
            if name in known
            else getattr(load, name)(t)
            if name in model.channels
            else getattr(model, name)(q)
        )

    def kept(surface: Surface) -> Any:
        """The coordinate of a surface, its sum, or its function."""
        if surface.function is not None:
            return model.value_of_function(surface, t, q, v, load)
        if isinstance(surface.coordinate, str):
            return known[surface.coordinate]
        return sum(factor * value_of(name) for name, factor in surface.coordinate.items())

    def side_of(surface: Any) -> Any:
        """The side of a surface; a relay, whose side no state tells, is on where `on` sets it."""
        if surface.remembered:
            value = surface.guard(model, -1.0, t, q, v, load)
            return np.where(np.asarray(getattr(value, "value", value)) >= 0.0, 1.0, -1.0)[()]
        return surface.side(kept(surface), below)

    return (Sides({each.name: side_of(each) for each in model.surfaces}),)


def held_entry(entry: Any, i: int, j: int, free: Sequence[Any]) -> Any:
    """An entry of D M D + 1 - D."""
    if i != j:
        return 0.0 if is_zero(entry) else free[i] * free[j] * entry
    return 1.0 if isinstance(entry, float) and entry == 1.0 else free[i] * entry + (1.0 - free[i])
