from .along_parameter import attractors_along
from .attractor import Attractor, Attractors, Target
from .basins.fractal import BasinEntropy, UncertaintyExponent, Wada, basin_entropy, uncertainty_exponent, wada
from .basins.grid import basins_of_attraction
from .find import find_attractors
from .lyapunov.ensemble import lyapunov_many
from .lyapunov.spectrum import Exponents, lyapunov_spectrum
from .manifolds.equilibria import Equilibrium, equilibria
from .manifolds.phase_plane import Separatrix, separatrices
from .manifolds.saddle_manifolds import Manifold, stable_manifold, unstable_manifold
from .sampled_share import share_interval
from .verdict.classification import classify
from .verdict.tori import excludes_tori
from .verdict.unsettled import JUDGEMENT, Doubt, Earlier, Judged, JudgementSettings, SettledLater, Unsettled, judge_unsettled
from .verdict.verdict import Verdict
from .verdict.zero_one_test import ZeroOne, zero_one_test

__all__ = [
    "JUDGEMENT",
    "Attractor",
    "Attractors",
    "BasinEntropy",
    "Doubt",
    "Earlier",
    "Equilibrium",
    "Exponents",
    "Judged",
    "JudgementSettings",
    "Manifold",
    "Separatrix",
    "SettledLater",
    "Target",
    "UncertaintyExponent",
    "Unsettled",
    "Verdict",
    "Wada",
    "ZeroOne",
    "attractors_along",
    "basin_entropy",
    "basins_of_attraction",
    "classify",
    "equilibria",
    "excludes_tori",
    "find_attractors",
    "judge_unsettled",
    "lyapunov_many",
    "lyapunov_spectrum",
    "separatrices",
    "share_interval",
    "stable_manifold",
    "uncertainty_exponent",
    "unstable_manifold",
    "wada",
    "zero_one_test",
]
