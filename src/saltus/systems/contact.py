"""What may hold a coordinate of a model: a contact, or a dry friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from saltus.errors import ParameterError

Number = Any  # a float, or a parameter of the model while its equations are traced


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """A contact that keeps a coordinate q on one side of a position p: its gap is sign (q - p) >= 0.

    While it is closed, q stays at p. Its reaction, the impulse or force on q times the sign, is not negative.

    Parameters
    ----------
    name
        Its name, such as "lower", in events and in the names of stops.
    coordinate
        The name of the model's coordinate.
    sign
        +1 where the coordinate stays above the position, -1 where it stays below.
    position
        p, a number, which may be one of the model's parameters.
    group
        The contact's group: an impact passes speed on to the other contacts of its group (`transfer`).
    restitution
        e of the impacts that close it, in [0, 1]; by default that of the system's impact law.

    Examples
    --------
    >>> right = saltus.Contact(name="right", coordinate="x", position=1.0, sign=-1)
    >>> right.gap(0.25)
    0.75
    """

    name: str
    coordinate: str
    sign: int = 1
    position: Any = 0.0
    group: str = ""
    restitution: Any = None

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise ParameterError(f"the sign of the contact {self.name!r} must be +1 or -1, got {self.sign!r}", "sign")

    def gap(self, position: Any) -> Any:
        """sign (q - p), at a position q.

        Parameters
        ----------
        position
            The coordinate q.
        """
        return self.sign * (position - self.position)


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Coulomb friction along a coordinate q on a ground that moves with the speed w, under the normal force N of the model:

        it slides, and the force on q is -mu_k N sign(q' - w), or it sticks, q' = w, and the force is at most mu_s N.

    N is the model's `normal_forces`, a function of time, state and load, but not of accelerations.

    Parameters
    ----------
    name
        Its name, such as "belt", in events.
    coordinate
        The name of the model's coordinate.
    kinetic
        mu_k, a number, which may be one of the model's parameters.
    static
        mu_s, at least mu_k; by default mu_k.
    ground_speed
        w, the speed of the ground.

    Examples
    --------
    >>> saltus.Friction(name="belt", coordinate="x", kinetic=0.2, static=0.3, ground_speed=0.5).static
    0.3
    """

    name: str
    coordinate: str
    kinetic: Number
    static: Number | None = None
    ground_speed: Number = 0.0

    @property
    def limit(self) -> str:
        """The name of the limit at which a motion ends, as the normal force does not press any more."""
        return f"normal force of {self.name}"

    @property
    def most(self) -> Any:
        """mu_s."""
        return self.kinetic if self.static is None else self.static
