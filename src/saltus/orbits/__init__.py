"""What repeats: periodic orbits of the exact system, their branches and special points."""

from saltus.orbits.branch import Branch, continue_orbit
from saltus.orbits.codimension import CodimensionTwo
from saltus.orbits.confirm import defects
from saltus.orbits.find import find_orbit
from saltus.orbits.loci import continue_special
from saltus.orbits.locus import Locus
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.releases import Release, load_releases
from saltus.orbits.reload import orbits_of
from saltus.orbits.resting import RestingOrbit
from saltus.orbits.search import Search, same_orbit, search_orbits
from saltus.orbits.signature import Signature
from saltus.orbits.special import Evidence, SpecialPoint
from saltus.orbits.switching import Cascade, doubling_cascade, switch_branch

__all__ = [
    "Branch",
    "Cascade",
    "CodimensionTwo",
    "Evidence",
    "Locus",
    "PeriodicOrbit",
    "Release",
    "RestingOrbit",
    "Search",
    "Signature",
    "SpecialPoint",
    "continue_orbit",
    "continue_special",
    "defects",
    "doubling_cascade",
    "find_orbit",
    "load_releases",
    "orbits_of",
    "same_orbit",
    "search_orbits",
    "switch_branch",
]
