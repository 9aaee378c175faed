"""Where it ends: verdicts on motions, their Lyapunov exponents, and whether a torus is possible at all."""

from saltus.attractors.classification import classify
from saltus.attractors.exponents import Exponents, lyapunov_spectrum
from saltus.attractors.exponents_many import lyapunov_many
from saltus.attractors.tori import excludes_tori
from saltus.attractors.verdict import Verdict
from saltus.attractors.zero_one import ZeroOne, zero_one_test

__all__ = [
    "Exponents",
    "Verdict",
    "ZeroOne",
    "classify",
    "excludes_tori",
    "lyapunov_many",
    "lyapunov_spectrum",
    "zero_one_test",
]
