"""The contract of a model: a hybrid automaton written once, as plain Python."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, ClassVar

from saltus.errors import ParameterError, near, shown
from saltus.systems.constrained import constrained_acceleration
from saltus.systems.contact import Contact
from saltus.systems.friction import Friction


class MarginKind(StrEnum):
    """The meaning of a margin: what it says of the mechanism that a motion passes it.

    Examples
    --------
    >>> str(system.model.margin_kind("reaction"))
    'assumption'
    """

    LANDMARK = "landmark"  #: a place worth a mark: the mechanism goes on through it
    ASSUMPTION = "assumption"  #: an assumption of the model fails: the mechanism does something else
    LIMIT = "limit"  #: the mechanism has no such positions


class Model:
    """A piecewise-smooth oscillator. Subclass it as a frozen, keyword-only dataclass of numbers and give it:

    1. `coordinates`, the names of its degrees of freedom, their `units` ("1" where it gives none), and `channels`, the load
       channels that it reads;
    2. `sides`, the numbers of its smooth modes: (+1, -1) for a motion that crosses the contact, (+1,) for a wall that
       turns it back, () for a motion without contact;
    3. `acceleration`, an expression of numbers, NumPy functions, load channels and `abs` of the coordinate. It is traced
       once with symbols into a Taylor recurrence, so it may not branch on the state: use `side`, which is fixed along an
       arc (the sign of the coordinate is ambiguous at contact);
    4. `gap`, positive inside a mode: its first zero, reached from above, ends the mode; and `contact`, the coordinate
       at which the gaps of all sides are zero. While the system rests there the accelerations at contact decide when it leaves;
    5. `reset`, the next side and the velocity after an impact, given the impact law; a model with one side must define it;
       a model with several contacts, or with contacts that hold single coordinates, gives instead of 2 to 5 its `contacts`, a
       tuple of `Contact`, the `force` r(t, q, v) of M(q) q'' = r, `mass_matrix`, M(q), where that is not the identity, and
       maybe a `singularity`, a name for where M(q) has no inverse: a motion that gets there ends with this name as `limit`;
       a model with dry friction gives its `frictions`, a tuple of `Friction`, likewise, and their `normal_forces`;
    6. optionally `mirror` (the symmetry that maps motions to motions), `kinetic_energy` (for impact laws that need
       it), `margins` (what must stay positive), `margin_kinds` (what it means to pass them; an assumption that fails where
       a margin has none), `stops` (the margins that end a motion unasked), `check_load`, and `damping`, the coefficient of
       the velocity in the equation of motion.

    Every argument may be a number, an array or a symbol. With one degree of freedom the coordinate, the velocity and the
    acceleration are scalars; with several they are tuples.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Pendulum(saltus.Model):
    ...     coordinates, channels, sides = ("angle",), (), ()
    ...     def acceleration(self, t, angle, velocity, side, load):
    ...         return -np.sin(angle)
    >>> motion = saltus.simulate(saltus.System(model=Pendulum()), angle=0.5, duration=10.0)
    >>> bool(abs(motion.velocity**2 / 2 - np.cos(motion.angle) + np.cos(0.5)) < 1e-12)  # its energy
    True
    """

    __slots__ = ()

    coordinates: ClassVar[tuple[str, ...]] = ("theta",)
    units: ClassVar[tuple[str, ...]] = ()
    channels: ClassVar[tuple[str, ...]] = ()
    margin_kinds: ClassVar[Mapping[str, MarginKind]] = {}
    stops: ClassVar[tuple[str, ...]] = ()
    singularity: ClassVar[str] = ""
    transfers: ClassVar[bool] = False  # whether an impact that closes one contact may open the others, as a crossing does
    damping: float = 0.0  # small vibrations decay as exp(-damping tau / 2)

    def unit_of(self, coordinate: str) -> str:
        """The unit of one of the coordinates, such as "rad".

        Parameters
        ----------
        coordinate
            Its name.
        """
        if coordinate not in self.coordinates:
            raise ParameterError(f"no coordinate {shown(coordinate)}; {near(coordinate, self.coordinates)}", "coordinate")
        return self.units[self.coordinates.index(coordinate)] if self.units else "1"

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
        """The numbers of the smooth modes; none if the model has `contacts`, which determine what is free."""
        return (1, -1) if type(self).contacts is Model.contacts else ()

    @property
    def contact(self) -> Any:
        """The coordinate at contact."""
        return 0.0

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """The acceleration on the given side; for a model that gives its `force`, that without contacts and frictions.

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
        if type(self).force is Model.force:
            raise NotImplementedError(f"{type(self).__name__} must define acceleration(t, theta, velocity, side, load)")
        size = len(self.coordinates)
        still = [0.0] * len(self.frictions)
        solved = constrained_acceleration(self, t, theta, velocity, load, [1.0] * size, still)
        return solved[0] if size == 1 else tuple(solved)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts of a model that gives its `force`."""
        return ()

    @property
    def images(self) -> tuple[str, ...]:
        """For each coordinate of a mirror image, the original one whose negative it is: the same, unless the mirror swaps two."""
        return self.coordinates

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The dry frictions of a model that gives its `force`."""
        return ()

    @property
    def held(self) -> bool:
        """Whether there are contacts or frictions that may hold its coordinates, one by one."""
        return bool(self.contacts or self.frictions)

    def normal_forces(self, t: Any, theta: Any, velocity: Any, load: Any) -> tuple[Any, ...]:
        """The normal force N of each friction; the motion ends where one is not positive. By default it is 1, so that mu N is mu.

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

    def mass_matrix(self, theta: Any) -> Any:
        """M(q): a number, or rows of numbers, symmetric and positive definite.

        Parameters
        ----------
        theta
            The coordinate q; a tuple where there are several.
        """
        size = len(self.coordinates)
        return 1.0 if size == 1 else [[float(i == j) for j in range(size)] for i in range(size)]

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
        raise NotImplementedError(f"{type(self).__name__} has contacts, so it must define force(t, theta, velocity, load)")

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

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> tuple[Any, Any]:
        """The side on which the motion goes on, and its velocity there, after an impact that ends the mode `side`.

        Both velocities are rates of the coordinate, positive towards larger coordinates, and not speeds of approach. Here the
        motion passes through the contact and the sign of the velocity stays; a model with a wall turns the sign itself.

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
            The impact law, whose `velocity_after` gives the velocity after the impact without a change of sign.
        """
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """The kinetic energy; impact laws that conserve or restitute energy need it.

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
        raise ParameterError(
            f"{type(self).__name__} defines no kinetic_energy, so this impact law cannot be used with it", "impact"
        )

    def inelastic_factor(self, side: Any) -> Any:
        """The velocity factor of a frictionless, perfectly inelastic impact that ends the mode `side`.

        Parameters
        ----------
        side
            The mode that the impact ends.
        """
        raise ParameterError(
            f"{type(self).__name__} defines no inelastic_factor, so InelasticImpact() cannot be used with it", "impact"
        )

    def margins(self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any) -> dict[str, Any]:
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

    def check_load(self, load: Any) -> None:
        """Refuse, with a ParameterError, a load whose channels are known but cannot act on this model as it is.

        Parameters
        ----------
        load
            The load that a `System` is given.
        """

    def mirror(self, load: Any) -> Any:
        """The load under which -theta(t) is a motion wherever theta(t) is one under `load`, or None without such a symmetry.

        a(t, -theta, -theta', -side, mirrored load) = -a(t, theta, theta', side, load) must hold, and the same for the reset; this
        is checked at one state, and a mirror for which it does not hold is refused.

        The mirror turns the signs of all coordinates, velocities and sides; it does not shift the time. Of several coordinates
        it may swap some, see `images`.

        Parameters
        ----------
        load
            A load of the model.
        """
        return None


def check_sides(model: Model | type[Model]) -> None:
    """Refuse sides that no contact has, and a wall without a reset that turns the motion round.

    A class whose sides depend on its numbers is not refused, as its sides are not known yet.
    """
    name, sides = getattr(model, "__name__", type(model).__name__), model.sides
    if isinstance(sides, property):
        return
    if sides not in ((1, -1), (1,), ()):
        raise ParameterError(
            f"{name}.sides must be (1, -1) for a motion that passes the contact, (1,) for a wall or () for none, got {sides!r}"
        )
    if sides == (1,) and getattr(model.reset, "__func__", model.reset) is Model.reset:
        raise ParameterError(
            f"{name} has one side, so an impact must turn the motion round: define reset(self, t, velocity, side, load, impact), "
            "such as return side, -impact.velocity_after(self, t, velocity, side, side, load)"
        )
