"""What repeats: periodic orbits of the exact system, their branches and special points."""

from saltus.orbits.branch import Branch, continue_orbit
from saltus.orbits.find import find_orbit
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.special import Evidence, SpecialPoint

__all__ = ["Branch", "Evidence", "PeriodicOrbit", "Signature", "SpecialPoint", "continue_orbit", "find_orbit"]
