"""The contract of a model, written once, as plain Python: what all models share."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np

from saltus.errors import ParameterError, near, shown
from saltus.systems.contact import Contact, Friction


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
    """A smooth oscillator, and what all models share. Subclass it as a frozen, keyword-only dataclass of numbers and give it:

    1. `coordinates`, the names of its degrees of freedom, their `units` ("1" where it gives none), and `channels`, the load
       channels that it reads;
    2. `acceleration`, an expression of numbers, NumPy functions, load channels and `abs` of the coordinate. It is traced
       once with symbols into a Taylor recurrence, so it may not branch on the state;
    3. optionally `mirror` (the symmetry that maps motions to motions), `kinetic_energy` (for impact laws that need
       it), `margins` (what must stay positive), `margin_kinds` (what it means to pass them; an assumption that fails where
       a margin has none), `stops` (the margins that end a motion unasked), `check_load`, and `damping`, the coefficient of
       the velocity in the equation of motion.

    A model whose motion crosses a contact or is turned back by a wall is an `OneContactModel`. One with several contacts, with
    contacts that hold single coordinates, or with dry friction is a `ContactModel`. Each has a contract of its own.

    Every argument may be a number, an array or a symbol. With one degree of freedom the coordinate, the velocity and the
    acceleration are scalars; with several they are tuples.

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
    units: ClassVar[tuple[str, ...]] = ()
    channels: ClassVar[tuple[str, ...]] = ()
    margin_kinds: ClassVar[Mapping[str, MarginKind]] = {}
    stops: ClassVar[tuple[str, ...]] = ()
    singularity: ClassVar[str] = ""  # a name for the states in which the acceleration is infinite, if there are such
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
        """The numbers of its smooth modes; none without a contact that the motion crosses or bounces from."""
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
        """Whether contacts or frictions may hold its coordinates one by one, while the others move on.

        A perturbation of a coordinate that is held is lost. Such a model may be at rest in many states.
        """
        return bool(self.contacts or self.frictions)

    @property
    def names_its_contacts(self) -> bool:
        """Whether its impacts are at contacts with names; the extrema of a motion then do not tell which of them it hits."""
        return bool(self.contacts)

    @property
    def has_state_plane(self) -> bool:
        """Whether its state is a point of a plane on which areas change smoothly: one coordinate, which nothing holds."""
        return len(self.coordinates) == 1 and not self.holds_coordinates

    def reaches(self, coordinate: str, values: Any) -> Any:
        """Whether a coordinate can have these values, an array of their shape: a contact keeps it from others.

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
        """For each coordinate of a mirror image, the original one whose negative it is: the same, unless the mirror swaps two."""
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
        raise NotImplementedError(f"{type(self).__name__} must define acceleration(t, theta, velocity, side, load)")

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
