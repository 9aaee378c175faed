from .averages_over_time import mean_dissipated_power, transmissibility
from .branches.branch import Branch
from .branches.branch_continuation import STEP, continue_orbit, follow_stable
from .branches.from_dataset import orbits_of
from .branches.special_curve import SpecialCurve
from .branches.special_curve_continuation import continue_special
from .branches.special_point import OrbitEnd, SpecialKind, SpecialPoint
from .branches.switching import Cascade, doubling_cascade, switch_branch
from .equations.kinds import equations_of
from .equations.one_contact import OneContactEquations
from .finding.from_motion import find_orbit, orbit_from
from .finding.near_returns import orbits_near_returns, solved_near
from .finding.search import Search, search_orbits
from .free_orbits import FreeOrbit, NoFreeOrbit, backbone, free_orbit
from .orbit import PeriodicOrbit, solve
from .orbits_as_json import as_json, from_json
from .signature import Signature
from .symmetry import is_symmetric, keeps_symmetry
from .verify import closing_distances, closing_rows, defects, same_orbit

__all__ = [
    "STEP",
    "Branch",
    "Cascade",
    "FreeOrbit",
    "NoFreeOrbit",
    "OneContactEquations",
    "OrbitEnd",
    "PeriodicOrbit",
    "Search",
    "Signature",
    "SpecialCurve",
    "SpecialKind",
    "SpecialPoint",
    "as_json",
    "backbone",
    "closing_distances",
    "closing_rows",
    "continue_orbit",
    "continue_special",
    "defects",
    "doubling_cascade",
    "equations_of",
    "find_orbit",
    "follow_stable",
    "free_orbit",
    "from_json",
    "is_symmetric",
    "keeps_symmetry",
    "mean_dissipated_power",
    "orbit_from",
    "orbits_near_returns",
    "orbits_of",
    "same_orbit",
    "search_orbits",
    "solve",
    "solved_near",
    "switch_branch",
    "transmissibility",
]
