"""The belt oscillator: a mass on a spring, pressed on a moving belt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from saltus.checks import settle_numbers
from saltus.errors import ParameterError
from saltus.systems.contact import Friction
from saltus.systems.contact_model import ContactModel
from saltus.systems.load import Load, reversed_load


@dataclass(frozen=True, slots=True, kw_only=True)
class BeltOscillator(ContactModel):
    """x'' + c x' + k x = F(tau) + f, a mass pressed with N(tau) on a belt of speed w; the friction f (named `belt`) is

        f = -mu_k N sign(x' - w) while it slides,    abs(f) <= mu_s N while it sticks, x' = w.

    A belt that stands still, w = 0, makes it an oscillator with Coulomb friction.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    kinetic
        mu_k, at least 0.
    static
        mu_s, at least mu_k.
    normal_force
        N without the load's channel `normal`, above 0.
    belt_speed
        w, the speed of the belt.

    Examples
    --------
    >>> motion = saltus.simulate(saltus.System(model=saltus.BeltOscillator()), x=0.0, velocity=0.1, duration=5.0)
    >>> round(motion.events[0].time, 9), str(motion.events[0].kind)  # the spring pulls with mu_s N = 0.3 at x = 0.3
    (3.0, 'slip')
    """

    stiffness: float = 1.0
    damping: float = 0.0
    kinetic: float = 0.2
    static: float = 0.3
    normal_force: float = 1.0
    belt_speed: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force", "normal")

    def __post_init__(self) -> None:
        settle_numbers(self, "stiffness", "damping", "kinetic", "static", at_least=0.0)
        settle_numbers(self, "normal_force", above=0.0)
        settle_numbers(self, "belt_speed")
        if self.static < self.kinetic:
            raise ParameterError(f"static must be at least kinetic = {self.kinetic:g}, got {self.static:g}", "static")

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The friction of the belt."""
        given = {"kinetic": self.kinetic, "static": self.static, "ground_speed": self.belt_speed}
        return (Friction(name="belt", coordinate="x", **given),)

    def normal_forces(self, t: Any, x: Any, velocity: Any, load: Load) -> tuple[Any, ...]:
        """N plus the load's `normal`."""
        return (self.normal_force + load.normal(t),)

    def force(self, t: Any, x: Any, velocity: Any, load: Load) -> Any:
        """F - c x' - k x."""
        return load.force(t) - self.damping * velocity - self.stiffness * x

    def mirror(self, load: Load) -> Load | None:
        """The load with the force reversed, if the belt stands still; None otherwise."""
        return reversed_load(load, "force") if self.belt_speed == 0.0 else None

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'^2 / 2."""
        return velocity * velocity / 2
