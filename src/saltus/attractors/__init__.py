"""Where it ends: verdicts on motions and their Lyapunov exponents, the set of attractors, their basins and what parts them."""

from saltus.attractors.along import attractors_along
from saltus.attractors.attractor import Attractor, Attractors, Target
from saltus.attractors.basins import basins, cell_arguments
from saltus.attractors.classification import classify
from saltus.attractors.exponents import Exponents, lyapunov_spectrum
from saltus.attractors.exponents_many import lyapunov_many
from saltus.attractors.found import attractors
from saltus.attractors.fractal import BasinEntropy, UncertaintyExponent, Wada, basin_entropy, uncertainty_exponent, wada
from saltus.attractors.manifolds import Manifold, stable_manifold, unstable_manifold
from saltus.attractors.separatrices import Separatrix, separatrices
from saltus.attractors.tori import excludes_tori
from saltus.attractors.verdict import Verdict
from saltus.attractors.zero_one import ZeroOne, zero_one_test

__all__ = [
    "Attractor",
    "Attractors",
    "BasinEntropy",
    "Exponents",
    "Manifold",
    "Separatrix",
    "Target",
    "UncertaintyExponent",
    "Verdict",
    "Wada",
    "ZeroOne",
    "attractors",
    "attractors_along",
    "basin_entropy",
    "basins",
    "cell_arguments",
    "classify",
    "excludes_tori",
    "lyapunov_many",
    "lyapunov_spectrum",
    "separatrices",
    "stable_manifold",
    "uncertainty_exponent",
    "unstable_manifold",
    "wada",
    "zero_one_test",
]
