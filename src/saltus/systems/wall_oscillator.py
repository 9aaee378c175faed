"""The linear oscillator with a one-sided wall: the impact oscillator of the grazing literature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from saltus.checks import settle_numbers
from saltus.systems.load import Load
from saltus.systems.one_contact_model import OneContactModel


@dataclass(frozen=True, slots=True, kw_only=True)
class WallOscillator(OneContactModel):
    """x'' + c x' + k x = F(tau), free while x < d; at the wall x = d the velocity turns round, v+ = -e v-.

    It has one mode, which an impact at the wall ends and begins anew. It can rest at the wall while F - k d > 0.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    wall
        d, the coordinate of the wall.

    Examples
    --------
    >>> ball = saltus.System(model=saltus.WallOscillator(stiffness=0.0, wall=0.0), load=saltus.Load(force=1.0))
    >>> saltus.simulate(ball, x=-2.0, duration=3.0).impacts.time  # the fall from a height of 2 under an acceleration of 1
    array([2.])
    """

    stiffness: float = 1.0
    damping: float = 0.0
    wall: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def __post_init__(self) -> None:
        settle_numbers(self, "stiffness", "damping", at_least=0.0)
        settle_numbers(self, "wall")

    @property
    def sides(self) -> tuple[int, ...]:
        """One side, as the wall turns every motion back."""
        return (1,)

    @property
    def contact(self) -> Any:
        """x = d."""
        return self.wall

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'' = F - c x' - k x."""
        return load.force(t) - self.damping * velocity - self.stiffness * x

    def gap(self, x: Any, side: Any) -> Any:
        """d - x."""
        return self.wall - x

    def reset(self, t: Any, velocity: Any, side: Any, load: Load, impact: Any) -> tuple[Any, Any]:
        """The same side, with the velocity turned round."""
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """v^2 / 2."""
        return velocity * velocity / 2
