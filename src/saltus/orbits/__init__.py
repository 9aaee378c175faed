"""What repeats: periodic orbits of the exact system, their branches and special points."""

from saltus.orbits.branch import Branch, continue_orbit
from saltus.orbits.codimension import CodimensionTwo
from saltus.orbits.find import find_orbit
from saltus.orbits.loci import continue_special
from saltus.orbits.locus import Locus
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.special import Evidence, SpecialPoint

__all__ = [
    "Branch",
    "CodimensionTwo",
    "Evidence",
    "Locus",
    "PeriodicOrbit",
    "Signature",
    "SpecialPoint",
    "continue_orbit",
    "continue_special",
    "find_orbit",
]
