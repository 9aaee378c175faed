"""The linear oscillator between two stops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from saltus.checks import settle_numbers
from saltus.errors import ParameterError
from saltus.systems.contact import Contact
from saltus.systems.contact_model import ContactModel
from saltus.systems.load import Load, reversed_load


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoStops(ContactModel):
    """x'' + c x' + k x = F(tau) for d_1 <= x <= d_2: contacts `left` and `right`, with an impact law such as `NewtonImpact`.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    left
        d_1, the coordinate of the left stop.
    right
        d_2, the coordinate of the right stop, above d_1.

    Examples
    --------
    >>> [contact.name for contact in saltus.TwoStops(left=-1.0, right=2.0).contacts]
    ['left', 'right']
    """

    stiffness: float = 1.0
    damping: float = 0.0
    left: float = -1.0
    right: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def __post_init__(self) -> None:
        settle_numbers(self, "stiffness", "damping", at_least=0.0)
        settle_numbers(self, "left", "right")
        if not self.left < self.right:
            raise ParameterError(f"left must lie below right = {self.right:g}, got {self.left:g}", "left")

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """x >= d_1 and x <= d_2."""
        left = Contact(name="left", coordinate="x", position=self.left)
        return left, Contact(name="right", coordinate="x", sign=-1, position=self.right)

    def force(self, t: Any, x: Any, velocity: Any, load: Load) -> Any:
        """F - c x' - k x."""
        return load.force(t) - self.damping * velocity - self.stiffness * x

    def mirror(self, load: Load) -> Load | None:
        """The load with the force reversed, for d_1 = -d_2; None otherwise."""
        return reversed_load(load, "force") if self.left == -self.right else None

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'^2 / 2."""
        return velocity * velocity / 2
