"""The contracts of models that are smooth or have one contact, written once, as plain Python."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from enum import StrEnum
from pathlib import PurePath
from traceback import walk_tb
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from saltus.errors import ParameterError, SaltusError, TraceError, near, shown

if TYPE_CHECKING:
    from saltus.systems.contracts.contact_model import Contact, Friction, Relay, Surface


class MarginKind(StrEnum):
    """The meaning of a margin: what it says of the mechanism that a motion passes it.

    Examples
    --------
    >>> str(system.model.margin_kind("reaction"))
    'assumption'
    """

    LANDMARK = "landmark"  #: a place worth a mark: the mechanism goes on through it
    # : an assumption of the model fails: the mechanism does something else
    ASSUMPTION = "assumption"
    LIMIT = "limit"  #: the mechanism has no such positions


# Numbers of mirror images may differ by this, relatively: through rounding alone.
IMAGE_ROUNDING = 1e-11


class Count(int):
    """A whole number of a part of a system that says how many of something there are, such as
    cells: it belongs to the structure, as names do, and is none of the numbers that have dotted
    paths and vary."""

    __slots__ = ()


class Model:
    """A smooth oscillator, and what all models share. Subclass it as a frozen, keyword-only
    dataclass of numbers and give it:

    1. `coordinates`, the names of its degrees of freedom, their `units` ("1" where it gives none),
       and `channels`, the load
       channels that it reads; in `first_order` those of the coordinates, the last ones, whose rates
       follow from the state, as those of a voltage or a temperature: what the model returns for
       such a coordinate is its rate in place of an acceleration;
    2. `acceleration`, an expression of numbers, NumPy functions, load channels and `abs` of the
       coordinate. It is traced
       once with symbols into a Taylor recurrence, so it may not branch on the state;
    3. optionally `mirror` (the symmetry that maps motions to motions), `kinetic_energy` (for impact
       laws that need
       it), `margins` (what must stay positive), `margin_kinds` (what it means to pass them; an
       assumption that fails where a margin has none), `stops` (the margins that end a motion
       unasked), `check_load`, and `damping`, the coefficient of the velocity in the equation of
       motion.

    A model whose motion crosses a contact or is turned back by a wall is an `OneContactModel`. One
    with several contacts, with contacts that hold single coordinates, or with dry friction is a
    `ContactModel`. Each has a contract of its own.

    Every argument may be a number, an array or a symbol. With one degree of freedom the coordinate,
    the velocity and the acceleration are scalars; with several they are tuples.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Pendulum(saltus.Model):
    ...     coordinates = ("angle",)
    ...     def acceleration(self, t, angle, velocity, side, load):
    ...         return -np.sin(angle)
    >>> motion = saltus.simulate(saltus.System(model=Pendulum()), angle=0.5, duration=10.0)
    >>> bool(abs(motion.velocity**2 / 2 - np.cos(motion.angle) + np.cos(0.5)) < 1e-12)  # its energy
    True
    """

    __slots__ = ()

    coordinates: ClassVar[tuple[str, ...]] = ("theta",)
    first_order: ClassVar[tuple[str, ...]] = ()
    units: ClassVar[tuple[str, ...]] = ()
    # whether its equations are without units of time, so that 1 is the natural unit
    dimensionless: ClassVar[bool] = False
    channels: ClassVar[tuple[str, ...]] = ()
    margin_kinds: ClassVar[Mapping[str, MarginKind]] = {}
    stops: ClassVar[tuple[str, ...]] = ()
    # a name for the states in which the acceleration is infinite, if there are such
    singularity: ClassVar[str] = ""
    damping: float = 0.0  # small vibrations decay as exp(-damping tau / 2)
    # the impact law of a `System` that is given none; None keeps the velocity
    usual_impact: ClassVar[Any] = None

    def unit_of(self, coordinate: str) -> str:
        """The unit of one of the coordinates, such as "rad".

        Parameters
        ----------
        coordinate
            Its name.
        """
        if coordinate not in self.coordinates:
            raise ParameterError(
                f"no coordinate {shown(coordinate)}; {near(coordinate, self.coordinates)}",
                "coordinate",
            )
        return self.units[self.coordinates.index(coordinate)] if self.units else "1"

    def shown_coordinate(self, load: Any) -> str | None:
        """The coordinate, or the point, whose amplitude results and pictures show; None for the one
        that the load drives (`driven_displacement`).

        Parameters
        ----------
        load
            The load of the system.
        """
        return None

    @property
    def point_names(self) -> tuple[str, ...]:
        """The names of its points, sums of coordinates whose displacements results have too."""
        return ()

    def weights_of(self, displacement: str) -> np.ndarray | None:
        """The weight of each coordinate in a displacement, (n,); None if no displacement is called
        so.

        Parameters
        ----------
        displacement
            The name of a coordinate or of a point.
        """
        names = list(self.coordinates)
        return np.eye(len(names))[names.index(displacement)] if displacement in names else None

    def margin_kind(self, margin: str) -> MarginKind:
        """The meaning of one of the margins.

        Parameters
        ----------
        margin
            Its name.
        """
        return self.margin_kinds.get(margin, MarginKind.ASSUMPTION)

    @property
    def sides(self) -> tuple[int, ...]:
        """The numbers of its smooth modes; none without a contact that the motion crosses or
        bounces from.
        """
        return ()

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts that hold single coordinates; a `ContactModel` may have some."""
        return ()

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The dry frictions; a `ContactModel` may have some."""
        return ()

    @property
    def rubs_in_contacts(self) -> bool:
        """Whether the reaction of any of its contacts presses a friction."""
        return any(friction.contact is not None for friction in self.frictions)

    @property
    def has_multipliers(self) -> bool:
        """Whether a contact is a `distance`, or a friction's speed a `rate`, so that multipliers
        hold its contacts and frictions in its own coordinates."""
        return any(part.distance is not None for part in self.contacts) or any(
            part.rate is not None for part in self.frictions
        )

    @property
    def has_switches(self) -> bool:
        """Whether its equations differ on the sides of functions of the state, of surfaces or in its
        force; a `ContactModel` may have some.
        """
        return False

    @property
    def force_jumps(self) -> bool:
        """Whether its force has switches of its own at which it may jump."""
        return False

    @property
    def relays(self) -> tuple[Relay, ...]:
        """Those of its surfaces that are relays; a `ContactModel` may have some."""
        return ()

    @property
    def resets(self) -> tuple[str, ...]:
        """The names of the surfaces at whose events its state jumps; a `ContactModel` may have
        some.
        """
        return ()

    @property
    def friction_limits(self) -> tuple[str, ...]:
        """The limits at which its frictions end a motion."""
        return ()

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces on whose sides the equations differ; a `ContactModel` may have some."""
        return ()

    @property
    def contact(self) -> Any:
        """The coordinate at contact; 0 without one."""
        return 0.0

    @property
    def has_one_contact(self) -> bool:
        """Whether its motion crosses a contact or bounces from it, and so has sides."""
        return bool(self.sides)

    @property
    def every_side(self) -> tuple[int, ...]:
        """The values of `side` in the equations: its sides or, if it has none, 1."""
        return self.sides or (1,)

    @property
    def holds_coordinates(self) -> bool:
        """Whether contacts or frictions may hold its coordinates one by one, while the others move
        on, or it has surfaces.

        A perturbation of a coordinate that is held is lost. Such a model may be at rest in many
        states.
        """
        return bool(self.contacts or self.frictions or self.surfaces)

    @property
    def names_its_contacts(self) -> bool:
        """Whether its impacts are at contacts with names; the extrema of a motion then do not tell
        which of them it hits.
        """
        return bool(self.contacts)

    @property
    def has_state_plane(self) -> bool:
        """Whether its state is a point of a plane on which areas change smoothly: one coordinate,
        which nothing holds.
        """
        return len(self.coordinates) == 1 and not self.holds_coordinates and not self.first_order

    @property
    def moving(self) -> tuple[str, ...]:
        """Its coordinates that have velocities of their own: all but those of first order."""
        return self.coordinates[: len(self.coordinates) - len(self.first_order)]

    def reaches(self, coordinate: str, values: Any) -> Any:
        """Whether a coordinate can have these values, an array of their shape: a contact keeps it
        from others.

        Parameters
        ----------
        coordinate
            Its name.
        values
            The values, an array.
        """
        return np.ones(np.shape(values), dtype=bool)

    @property
    def images(self) -> tuple[str, ...]:
        """For each coordinate of a mirror image, the original one whose negative it is: the same,
        unless the mirror swaps two.
        """
        return self.coordinates

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """The acceleration.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        side
            The mode, one of `sides`; 1 where there are none.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        """
        raise NotImplementedError(
            f"{type(self).__name__} must define acceleration(t, theta, velocity, side, load)"
        )

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """The kinetic energy; `saltus.energies` and impact laws that restitute energy need it.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        side
            The mode, one of `sides`.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        """
        name = type(self).__name__
        several = len(self.coordinates) > 1
        raise ParameterError(
            f"{name} defines no kinetic_energy, which this needs: add kinetic_energy(self, t,"
            " theta, velocity, side, load), such as return"
            f" {'0.5 * sum(v**2 for v in velocity)' if several else '0.5 * velocity**2'} where the"
            " mass is 1",
            "model",
        )

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any
    ) -> dict[str, Any]:
        """Named quantities that must stay positive for the motion to be one of the real mechanism.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            The coordinate q; a tuple where there are several.
        velocity
            Its rate, of the same kind.
        acceleration
            The second derivative of the coordinate, of the same kind.
        side
            The mode, one of `sides`.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        """
        return {}

    def margin_names(self, load: Any) -> tuple[str, ...]:
        """The names of its margins.

        Parameters
        ----------
        load
            A load of the model.
        """
        size = len(self.coordinates)
        at, still = ((x if size == 1 else (x,) * size) for x in (0.1, 0.0))
        return tuple(self.margins(0.0, at, still, still, self.every_side[0], load))

    def check_load(self, load: Any) -> None:
        """Refuse, with a ParameterError, a load whose channels are known but cannot act on this
        model as it is.

        Parameters
        ----------
        load
            The load that a `System` is given.
        """

    def mirror(self, load: Any) -> Any:
        """The load under which -theta(t) is a motion wherever theta(t) is one under `load`, or None
        without such a symmetry.

        A class that does not define it has its symmetry found from its equations
        (`saltus.systems.mirror_of`).

        a(t, -theta, -theta', -side, mirrored load) = -a(t, theta, theta', side, load) must hold,
        and the same for the reset; this is checked at one state, and a mirror for which it does not
        hold is refused.

        The mirror turns the signs of all coordinates, velocities and sides; it does not shift the
        time. Of several coordinates it may swap some, see `images`.

        Parameters
        ----------
        load
            A load of the model.
        """
        return None


class OneContactModel(Model):
    """An oscillator of one coordinate whose motion crosses a contact, or is turned back by a wall.
    Besides what a `Model` has (`coordinates`, `channels`, optional parts) give it:

    1. `acceleration` on each side: it may use `side`, which is fixed along an arc, in place of a
       branch on the state (the sign of
       the coordinate is ambiguous at contact);
    2. `sides`, the numbers of its smooth modes: (+1, -1), the default, for a motion that crosses
       the contact, or (+1,) for a wall
       that turns it back. A contact that some numbers of a model take away has () then;
    3. `gap`, positive inside a mode: its first zero, reached from above, ends the mode; and
       `contact`, the coordinate at which
       the gaps of all sides are zero. By default they are side * theta and 0. While the system
       rests there the accelerations at contact decide when it leaves;
    4. `reset`, the next side and the velocity after an impact, given the impact law; a wall must
       define it. By default the motion
       passes through the contact;
    5. optionally `inelastic_factor`, for impact laws that need it.

    Rest, release, infinitely many impacts and grazing follow from the accelerations at contact.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Rocker(saltus.OneContactModel):
    ...     coordinates = ("angle",)
    ...     def acceleration(self, t, angle, velocity, side, load):
    ...         return -side * 1.0
    >>> rocker = saltus.simulate(saltus.System(model=Rocker()), angle=0.5, duration=10.0)
    >>> float(rocker.impacts.time[0])  # the fall from 0.5
    1.0
    """

    __slots__ = ()

    @property
    def sides(self) -> tuple[int, ...]:
        """The numbers of the smooth modes."""
        return (1, -1)

    def gap(self, theta: Any, side: Any) -> Any:
        """The gap, which is positive inside the mode `side` and zero at contact.

        Parameters
        ----------
        theta
            The coordinate q; a tuple where there are several.
        side
            The mode, one of `sides`.
        """
        return side * theta

    def reaches(self, coordinate: str, values: Any) -> Any:
        """Whether the coordinate can have these values: where the gap of a side is not negative.

        Parameters
        ----------
        coordinate
            Its name.
        values
            The values, an array.
        """
        return (
            np.max(
                [np.asarray(self.gap(values, side)) for side in self.sides]
                or [np.zeros(np.shape(values))],
                axis=0,
            )
            >= 0.0
        )

    def inward(self, side: int) -> float:
        """+1 or -1: the direction of the coordinate from the contact into a mode.

        Parameters
        ----------
        side
            The mode, one of `sides`.
        """
        into = float(self.gap(self.contact + 1.0, side)) - float(self.gap(self.contact, side))
        return 1.0 if into > 0.0 else -1.0

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> tuple[Any, Any]:
        """The side on which the motion goes on, and its velocity there, after an impact that ends
        the mode `side`.

        Both velocities are rates of the coordinate, positive towards larger coordinates, and not
        speeds of approach. Here the motion passes through the contact and the sign of the velocity
        stays; a model with a wall turns the sign itself.

        Parameters
        ----------
        t
            The dimensionless time tau.
        velocity
            The rate of the coordinate before the impact.
        side
            The mode that the impact ends.
        load
            The load, whose channels are called with the time: `load.horizontal(t)`.
        impact
            The impact law, whose `velocity_after` gives the velocity after the impact without a
            change of sign.
        """
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def inelastic_factor(self, side: Any) -> Any:
        """The velocity factor of a frictionless, perfectly inelastic impact that ends the mode
        `side`.

        Parameters
        ----------
        side
            The mode that the impact ends.
        """
        raise ParameterError(
            f"{type(self).__name__} defines no inelastic_factor, so InelasticImpact() cannot be"
            " used with it",
            "impact",
        )


def check_one_contact(model: OneContactModel | type[OneContactModel]) -> None:
    """Refuse sides that no contact has, several coordinates, and a wall without a reset that turns
    the motion round.

    A class whose sides depend on its numbers is not refused, as its sides are not known yet.
    """
    name = getattr(model, "__name__", type(model).__name__)
    sides = model.sides
    if isinstance(sides, property):
        return
    if sides not in ((1, -1), (1,), ()):
        raise ParameterError(
            f"{name}.sides must be (1, -1) for a motion that passes the contact, (1,) for a wall or"
            f" () for none, got {sides!r}",
            "model",
        )
    if sides and len(model.coordinates) != 1:
        raise ParameterError(
            f"{name} has one contact and the coordinates {', '.join(model.coordinates)}, but it "
            f"must have one coordinate; a model of several coordinates is a saltus.Model if it "
            f"has no contact, or a"
            " saltus.ContactModel",
            "model",
        )
    if sides == (1,) and getattr(model.reset, "__func__", model.reset) is OneContactModel.reset:
        raise ParameterError(
            f"{name} has one side, so an impact must turn the motion round: define reset(self, t,"
            " velocity, side, load, impact), such as return side, -impact.velocity_after(self, t,"
            " velocity, side, side, load)",
            "model",
        )


# --- derivatives of functions of the coordinates -----------------------------

# of states at which functions are tried; one in their domain is needed
SCALES = (0.21, 0.0, 1.3, -0.4)

# By the name of NumPy's function, its derivatives to its arguments, as functions of these and of
# its value.
SLOPES: dict[str, tuple[Callable[..., Any], ...]] = {
    "add": (lambda a, b, y: 1.0, lambda a, b, y: 1.0),
    "subtract": (lambda a, b, y: 1.0, lambda a, b, y: -1.0),
    "multiply": (lambda a, b, y: b, lambda a, b, y: a),
    "divide": (lambda a, b, y: 1.0 / b, lambda a, b, y: -y / b),
    "power": (lambda a, b, y: b * a ** (b - 1.0), lambda a, b, y: y * np.log(a)),
    "negative": (lambda u, y: -1.0,),
    "absolute": (lambda u, y: np.sign(u),),
    "sign": (lambda u, y: 0.0,),
    "square": (lambda u, y: 2.0 * u,),
    "sqrt": (lambda u, y: 0.5 / y,),
    "exp": (lambda u, y: y,),
    "log": (lambda u, y: 1.0 / u,),
    "sin": (lambda u, y: np.cos(u),),
    "cos": (lambda u, y: -np.sin(u),),
    "tan": (lambda u, y: 1.0 + y * y,),
    "sinh": (lambda u, y: np.cosh(u),),
    "cosh": (lambda u, y: np.sinh(u),),
    "tanh": (lambda u, y: 1.0 - y * y,),
    "arctan": (lambda u, y: 1.0 / (1.0 + u * u),),
}


class Jet(np.lib.mixins.NDArrayOperatorsMixin):
    """A number, an array or a symbol along a curve, with its first derivative there and, if that is
    asked for, its second one.
    """

    __slots__ = ("first", "second", "value")
    __array_priority__ = 2000  # above that of symbols, which it may hold

    def __init__(self, value: Any, first: Any, second: Any = None) -> None:
        self.value = value
        self.first = first
        self.second = second

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Jet:
        slopes = SLOPES.get(ufunc.__name__)
        if method != "__call__" or kwargs or slopes is None:
            raise TraceError(
                f"np.{ufunc.__name__} of coordinates has no derivative here; allowed are"
                f" {', '.join(SLOPES)}"
            )
        jets = [x if isinstance(x, Jet) else Jet(x, 0.0, 0.0) for x in inputs]
        values = [x.value for x in jets]
        known = all(x.second is not None for x in jets)
        moving = [not (is_zero(x.first) and (x.second is None or is_zero(x.second))) for x in jets]
        y = ufunc(*values)
        firsts = [x.first for x in jets]
        steep = [
            slope(*values, y) if moves else 0.0 for slope, moves in zip(slopes, moving, strict=True)
        ]
        first = weighted(steep, firsts)
        if not known:
            return Jet(y, first)
        along = [*(Jet(x.value, x.first) for x in jets), Jet(y, first)]
        bent = [
            slope(*along) if moves else 0.0 for slope, moves in zip(slopes, moving, strict=True)
        ]
        turned = [x.first if isinstance(x, Jet) else 0.0 for x in bent]
        return Jet(y, first, weighted([*steep, *turned], [*(x.second for x in jets), *firsts]))

    def __float__(self) -> float:
        raise TraceError("a coordinate has no plain number here: use NumPy's functions, not math's")

    __array__ = __float__


def weighted(factors: Sequence[Any], values: Sequence[Any]) -> Any:
    """The sum of products, without those that are 0 for every state."""
    total: Any = 0.0
    for factor, value in zip(factors, values, strict=True):
        if not (is_zero(factor) or is_zero(value)):
            term = value if isinstance(factor, float) and factor == 1.0 else factor * value
            total = term if is_zero(total) else total + term
    return total


def ask(model: Any, method: str, *arguments: Any) -> Any:
    """Call a model's method; a mistake in a user's own code becomes a sentence that says where it
    is.

    Raises
    ------
    TraceError
        The method uses what cannot be traced; or it raised an exception that is not saltus's own:
        the message has its type and text, and it is the cause.
    """
    try:
        return getattr(model, method)(*arguments)
    except TraceError as error:
        error.put_at(_place_of(error, model, method))
        raise
    except (SaltusError, KeyboardInterrupt):
        raise
    except BaseException as error:  # a user's own code may call exit
        place = _place_of(error, model, method)
        single = len(getattr(model, "coordinates", ())) == 1 and "not subscriptable" in str(error)
        hint = "; with one coordinate q and its velocity are numbers: write q, not q[0]" * single
        raise TraceError(f"{place} failed: {type(error).__name__}: {error}{hint}") from error


def _place_of(error: BaseException, model: Any, method: str) -> str:
    """Where a user's own code raised an error, as "Pendulum.force (pendulum.py:12)"; the method
    alone where no line of such code is known.
    """
    name = f"{type(model).__name__}.{method}"
    line = ""
    for frame, number in walk_tb(error.__traceback__):
        package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        file = PurePath(frame.f_code.co_filename).name
        # texts that were executed, and the cells of a notebook, are no files of a user
        if package not in OTHERS_CODE and file.endswith(".py") and not file[:-3].isdigit():
            line = f" ({file}:{number})"
    return name + line


OTHERS_CODE = ("saltus", "numpy")  # packages whose lines no user changes


def is_zero(entry: Any) -> bool:
    """Whether an entry is 0 for every state: the number 0, and not a symbol or an array."""
    return isinstance(entry, (int, float)) and entry == 0


def derivatives_along(function: Any, given: list[list[Any]]) -> list[Any]:
    """A function of a point, and the first and second derivatives of its value where those of the
    point are given too.
    """
    if len(given) == 1:
        return [as_given(function(given[0]))]
    found = function([Jet(*each) for each in zip(*given, strict=True)])
    return [
        as_given([getattr(x, name) for x in found])
        for name in ("value", "first", "second")[: len(given)]
    ]


def is_function(model: Any, name: str) -> bool:
    """Whether a term of a sum is a function of the model."""
    return name not in model.coordinates and name not in model.channels


def reads_of(model: Any, name: str) -> tuple[int, ...]:
    """The places of the coordinates on which a function of a model depends.

    Raises
    ------
    ParameterError
        It has no value, or none at numbers with derivatives.
    """
    size = len(model.coordinates)
    what = f"{type(model).__name__}.{name}"
    try:
        for scale in SCALES:
            q = [scale / (1 + i) for i in range(size)]
            with np.errstate(all="ignore"):
                if np.isfinite(float(getattr(model, name)(as_given(q)))):
                    derivatives_along(
                        lambda x: [getattr(model, name)(as_given(x))],
                        [q, [1.0] * size, [0.0] * size],
                    )
                    beside = [
                        [np.nan if i == j else x for i, x in enumerate(q)] for j in range(size)
                    ]
                    return tuple(
                        j
                        for j, x in enumerate(beside)
                        if np.isnan(float(getattr(model, name)(as_given(x))))
                    )
    except Exception as error:  # a user's own code may raise anything
        raise ParameterError(
            f"{what} fails: {type(error).__name__}: {error}; it takes the coordinates q", "model"
        ) from error
    raise ParameterError(
        f"{what} must return a number at the coordinates q, and has none at {shown(q)}", "model"
    )


def as_given(values: list[Any]) -> Any:
    """One value, or a tuple of several."""
    return values[0] if len(values) == 1 else tuple(values)


def each_of(values: Any) -> list[Any]:
    """The values of all coordinates, of one or of several, whose numbers may be the rows of an
    array.
    """
    return (
        list(values)
        if isinstance(values, (tuple, list)) or (isinstance(values, np.ndarray) and values.ndim > 1)
        else [values]
    )


SHARE_DIGITS = 9  # the last digits of a share are rounding


def first_of_largest(names: Sequence[str], shares: np.ndarray, held: Collection[str] = ()) -> str:
    """The name with the largest share; of equal ones first those that no contact holds, then the
    first by name, so that the order of declaration does not decide.

    Parameters
    ----------
    names, shares
        The names, and the share of each, (n,).
    held
        Names that contacts hold.
    """
    largest = float(np.max(shares, initial=0.0))
    equal = [
        name
        for name, share in zip(names, shares.tolist(), strict=True)
        if round(share / (largest or 1.0), SHARE_DIGITS) == float(largest > 0.0)
    ]
    return min(equal, key=lambda name: (name in held, name))


def less(values: Sequence[Any], others: Sequence[Any]) -> list[Any]:
    """The differences, without those that are 0 for every state."""
    return [x if is_zero(y) else x - y for x, y in zip(values, others, strict=True)]
