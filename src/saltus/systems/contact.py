"""A contact of a model with several: the gap of one coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from saltus.errors import ParameterError

MOST = 12  # The most contacts: which of them are closed is found by trying, with 2^n choices at worst.


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


def check_contacts(model: Any) -> None:
    """Refuse contacts of a model that have no meaning.

    Raises
    ------
    ParameterError
        Two contacts of one name, an unknown coordinate, a model with sides, two contacts that leave a coordinate no room.
    """
    contacts, kind = model.contacts, type(model).__name__
    names = [contact.name for contact in contacts]
    if len(contacts) > MOST:
        raise ParameterError(f"{kind} has {len(contacts)} contacts, and at most {MOST} can be followed", "model")
    if len(set(names)) < len(names):
        raise ParameterError(f"{kind}.contacts must have names of their own, got {', '.join(names)}", "model")
    if model.sides:
        raise ParameterError(f"{kind} has contacts, so it must have no sides: give it `sides = ()`", "model")
    for contact in contacts:
        if contact.coordinate not in model.coordinates:
            known = ", ".join(model.coordinates)
            raise ParameterError(f"the contact {contact.name!r} holds {contact.coordinate!r}, but {kind} has {known}", "model")
    for a in contacts:
        for b in contacts:
            if a is not b and a.coordinate == b.coordinate and not (a.sign != b.sign and b.gap(a.position) > 0.0):
                raise ParameterError(f"the contacts {a.name!r} and {b.name!r} leave {a.coordinate} no room between them", "model")
