"""The impact pair: a case on a spring, and a mass that slides freely between the case's two walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from saltus.checks import settle_numbers
from saltus.systems.contact import Contact
from saltus.systems.contact_model import ContactModel
from saltus.systems.load import Load, reversed_load


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpactPair(ContactModel):
    """An impact damper: a case on a spring, at z, and a mass in it at the distance x from the case's middle, |x| <= d:

        z'' + c z' + k z + mu (z'' + x'') = F(tau),    mu (z'' + x'') = 0 while no wall pushes.

    The coordinates are those of T = (z'^2 + mu (z' + x')^2) / 2, so that an impact at a wall acts on x alone, and the balance of
    momentum gives the jump of z'. Contacts `left` at x = -d and `right` at x = d.

    Parameters
    ----------
    mass_ratio
        mu, the ratio of the mass to the case, above 0.
    stiffness
        k of the case, at least 0.
    damping
        c of the case, at least 0.
    clearance
        d, above 0.

    Examples
    --------
    >>> [contact.name for contact in saltus.ImpactPair(clearance=0.5).contacts]
    ['left', 'right']
    """

    mass_ratio: float = 0.1
    stiffness: float = 1.0
    damping: float = 0.0
    clearance: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("z", "x")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def __post_init__(self) -> None:
        settle_numbers(self, "mass_ratio", "clearance", above=0.0)
        settle_numbers(self, "stiffness", "damping", at_least=0.0)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """x >= -d and x <= d."""
        left = Contact(name="left", coordinate="x", position=-self.clearance)
        return left, Contact(name="right", coordinate="x", sign=-1, position=self.clearance)

    def mass_matrix(self, q: Any) -> Any:
        """[[1 + mu, mu], [mu, mu]]."""
        return [[1.0 + self.mass_ratio, self.mass_ratio], [self.mass_ratio, self.mass_ratio]]

    def force(self, t: Any, q: Any, velocity: Any, load: Load) -> tuple[Any, Any]:
        """(F - c z' - k z, 0)."""
        return load.force(t) - self.damping * velocity[0] - self.stiffness * q[0], 0.0 * q[1]

    def mirror(self, load: Load) -> Load:
        """The load with the force reversed."""
        return reversed_load(load, "force")

    def kinetic_energy(self, t: Any, q: Any, velocity: Any, side: Any, load: Load) -> Any:
        """(z'^2 + mu (z' + x')^2) / 2."""
        together = velocity[0] + velocity[1]
        return (velocity[0] * velocity[0] + self.mass_ratio * together * together) / 2
