from .along_parameter import attractors_along
from .attractor import Attractor, Attractors, Target, share_interval
from .attractor_search import find_attractors
from .basins.fractal import BasinEntropy, UncertaintyExponent, Wada, basin_entropy, uncertainty_exponent, wada
from .basins.grid import basins_of_attraction
from .classification import Verdict, classify
from .judgement import JUDGEMENT, EarlierJudgement, Judged, JudgementSettings, SettledLater, judge
from .lyapunov.many_exponents import lyapunov_many
from .lyapunov.spectrum import Exponents, lyapunov_spectrum
from .manifolds.phase_plane import Equilibrium, Separatrix, equilibria, separatrices
from .manifolds.saddle_manifolds import Manifold, stable_manifold, unstable_manifold
from .reason import Reason
from .tori import excludes_tori
from .zero_one import ZeroOne, zero_one_test

__all__ = [
    "JUDGEMENT",
    "Attractor",
    "Attractors",
    "BasinEntropy",
    "EarlierJudgement",
    "Equilibrium",
    "Exponents",
    "Judged",
    "JudgementSettings",
    "Manifold",
    "Reason",
    "Separatrix",
    "SettledLater",
    "Target",
    "UncertaintyExponent",
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
    "judge",
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
