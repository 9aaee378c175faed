"""The signature of a periodic orbit: which impacts it has, in which order, over how many forcing
periods; and the tolerances with which orbits, impacts and instants are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from saltus.flow import EventCode
from saltus.progress import html_table


@dataclass(frozen=True, slots=True)
class ModeChange:
    """An event of an orbit with several contacts: an impact of one of them, or its release."""

    is_impact: bool
    contact: int  # its number
    closed: int  # the contacts that are closed after it, as bits

    def image(self, images: Sequence[int]) -> ModeChange:
        """The mirror image, with the number of the image of each contact."""
        closed = sum(1 << image for i, image in enumerate(images) if self.closed >> i & 1)
        return ModeChange(self.is_impact, images[self.contact], closed)

    @property
    def kind(self) -> int:
        """The number of this kind of event in the flow."""
        return int(EventCode.IMPACT if self.is_impact else EventCode.RELEASE)


@dataclass(frozen=True, slots=True)
class Signature:
    """The signature of a family of periodic orbits: all that stays the same along it.

    A symmetric orbit is its own mirror image half a period later; only the impacts, or events, of
    its first half are listed, and its equations cover this half.

    Attributes
    ----------
    sides
        The side that each impact ends, in order; empty for an orbit without impacts.
    period
        The period q, in forcing periods.
    symmetric
        Whether the second half is the mirror image of the first one.
    side
        The side of an orbit without impacts.
    events
        For an orbit with several contacts, in place of `sides`: its impacts and releases in order.
    closed
        For such an orbit without events: the contacts that are closed all the time, as bits. For
        one with a section and contacts that multipliers hold: those that are closed there, and
        behind them the frictions that stick.
    section
        For an orbit that is followed through its events: the phase at which its state is the
        unknown. None for all others.
    through
        For a cycle of a system on which nothing acts that varies with time: the state through which
        its section passes, and the direction of its flow there, to which the section is orthogonal
        in natural units. Empty for all others.
    relays
        Of a model with relays: the side of each at the section, +1 or -1. Empty for all others.

    Examples
    --------
    >>> orbit.signature.sides
    (-1,)
    """

    sides: tuple[int, ...]
    period: int
    symmetric: bool = False
    side: int = 1
    events: tuple[ModeChange, ...] = ()
    closed: int = 0
    section: float | None = None
    through: tuple[float, ...] = ()
    relays: tuple[int, ...] = ()

    def _repr_html_(self) -> str:
        events = self.sides or " ".join(map(str, self.events)) or "none"
        facts = {
            "period": self.period,
            "symmetric": self.symmetric,
            "impacts": self.impact_count,
            "sides or events": events,
        }
        return html_table("Signature", facts)

    @property
    def impact_count(self) -> int:
        """The number of impacts in one period of the orbit; 0 if it has a section, as its impacts
        are not part of the signature."""
        return (len(self.sides) + sum(event.is_impact for event in self.events)) * (
            2 if self.symmetric else 1
        )

    @property
    def span(self) -> float:
        """The number of forcing periods that the equations cover: q, or q / 2 for a symmetric
        orbit.
        """
        return self.period / 2 if self.symmetric else float(self.period)

    def along(self) -> tuple[int, ...]:
        """The side of each segment: segment i follows impact i and ends with the next one."""
        if not self.sides:
            return (self.side,)
        closing = -self.sides[0] if self.symmetric else self.sides[0]
        return (*self.sides[1:], closing)

    def halved(self) -> Signature:
        """The signature, over half the period, of an orbit of this one that is its own image:
        symmetric if the period is odd, else of half the period."""
        odd = bool(self.period % 2)
        sides = self.sides[: len(self.sides) // 2]
        events = self.events[: len(self.events) // 2]
        return replace(
            self,
            sides=sides,
            events=events,
            period=self.period if odd else self.period // 2,
            symmetric=odd,
        )

    def over_full_period(self, images: Sequence[int]) -> Signature:
        """That of a symmetric orbit over its full period.

        Parameters
        ----------
        images
            The number of the image of each contact.
        """
        sides = (*self.sides, *(-side for side in self.sides))
        events = (*self.events, *(event.image(images) for event in self.events))
        return replace(self, sides=sides, events=events, symmetric=False)

    def repeated(self) -> Signature:
        """That of an orbit which goes round twice."""
        return replace(
            self,
            sides=2 * self.sides,
            events=2 * self.events,
            period=2 * self.period,
            symmetric=False,
        )

    def part(self, periods: int) -> Signature | None:
        """That of an orbit of a shorter period which is gone round several times; None if it cannot
        be.

        Parameters
        ----------
        periods
            Forcing periods of the shorter period.
        """
        changes = self.sides or self.events
        n = len(changes)
        if self.period % periods or (n * periods) % self.period:
            return None
        part = n * periods // self.period
        if changes and (part == 0 or changes[:part] != changes[part : 2 * part]):
            return None
        return replace(
            self,
            sides=self.sides[:part],
            events=self.events[:part],
            period=periods,
            symmetric=False,
        )


@dataclass(frozen=True)
class OrbitTolerances:
    """Differences below which two things are the same."""

    # A gap or a speed below this is 0, at a grazing; grazings are located more precisely than that.
    touch: float = 1e-9
    # Phases and speeds of two impacts that vanish together: they fall as a square root of the
    # parameter.
    pair: float = 1e-4
    # States a period apart of an orbit that touches: they are known to the root of rounding only.
    touching_state: float = 1e-7
    grazing_orbits: float = 1e-5  # The unknowns of two orbits that coincide where both graze.
    same_orbit: float = 1e-6  # Extrema and speeds of impact of one orbit that was found twice.
    image: float = 1e-6  # An orbit and its own image: rounding alone makes a smaller difference.
    # The halves of a symmetric orbit: solved to 1e-12, but near a grazing Newton's method leaves
    # more.
    halves: float = 1e-7
    # Phases of two events of one contact that vanish together: speeds fall as the third power of
    # these.
    switching: float = 1e-5
    # Instants of a release, in forcing periods: releases are isolated, and known to rounding.
    release: float = 1e-9
    # Moduli of multipliers on the unit circle: those without damping, and at a special point that
    # is located to rounding.
    on_circle: float = 1e-9
    # Moduli of two multipliers that differ by rounding alone, relatively; a double one is split by
    # the root of rounding.
    same_modulus: float = 1e-9
    # Only with a multiplier this near to 1 may an orbit belong to a continuum of orbits at one
    # value of the parameter, such as those of a mass that no wall and no spring holds. Near a fold
    # it is as near only within 1e-14 of the fold's parameter.
    isolated: float = 1e-7
    # A multiplier this near to 1 may be that of a motion that creeps to sticking for good.
    creeping: float = 1e-3
    # How much farther than its residual says an orbit may be from the one that is meant.
    doubt: float = 10.0
    # A direction that sticking keeps has the multiplier 1 but for the rounding of eigenvalues.
    kept: float = 1e-13
    load: float = 1e-12  # Values of a load and of its mirror image half a period later.


TOLERANCES = OrbitTolerances()
