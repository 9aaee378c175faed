from .averages_over_time import mean_dissipated_power, transmissibility
from .branch import Branch
from .branch_continuation import STEP, continue_orbit, follow_stable
from .contact_problem import problem_of
from .find import find_orbit, orbit_from
from .free_orbits import FreeOrbit, FreeOutcome, backbone, free_orbit
from .from_dataset import orbits_of
from .near_returns import orbits_near_returns, solved_near
from .newton import solve
from .orbit import PeriodicOrbit
from .orbits_as_bytes import as_bytes, from_bytes
from .problem import Problem
from .resting import RestingOrbit
from .search import Search, search_orbits
from .signature import Signature
from .special_curve import SpecialCurve
from .special_curve_continuation import continue_special
from .special_point import OrbitEnd, SpecialKind, SpecialPoint
from .starts import (
    before_impacts,
    even_steps,
    initial_states,
    is_still,
    rest_state,
    start_at,
    state_vector,
    states_beside,
    within_window,
)
from .switching import Cascade, doubling_cascade, switch_branch
from .symmetry import is_symmetric, keeps_symmetry
from .verify import closing_distances, closing_rows, defects, same_orbit

__all__ = [
    "STEP",
    "Branch",
    "Cascade",
    "FreeOrbit",
    "FreeOutcome",
    "OrbitEnd",
    "PeriodicOrbit",
    "Problem",
    "RestingOrbit",
    "Search",
    "Signature",
    "SpecialCurve",
    "SpecialKind",
    "SpecialPoint",
    "as_bytes",
    "backbone",
    "before_impacts",
    "closing_distances",
    "closing_rows",
    "continue_orbit",
    "continue_special",
    "defects",
    "doubling_cascade",
    "even_steps",
    "find_orbit",
    "follow_stable",
    "free_orbit",
    "from_bytes",
    "initial_states",
    "is_still",
    "is_symmetric",
    "keeps_symmetry",
    "mean_dissipated_power",
    "orbit_from",
    "orbits_near_returns",
    "orbits_of",
    "problem_of",
    "rest_state",
    "same_orbit",
    "search_orbits",
    "solve",
    "solved_near",
    "start_at",
    "state_vector",
    "states_beside",
    "switch_branch",
    "transmissibility",
    "within_window",
]
