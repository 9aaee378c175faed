"""Exact non-smooth dynamics of a buckling-based metainterface and of its relatives.

The public names are loaded at their first use, so that `import saltus` stays light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from saltus import flow, systems, theory
    from saltus.attractors import (  # type: ignore[no-redef]  # functions, which hide the modules that they are in
        Exponents,
        Verdict,
        attractors_along,
        basins,
        classify,
        excludes_tori,
        lyapunov_many,
        lyapunov_spectrum,
        separatrices,
        stable_manifold,
        zero_one_test,
    )
    from saltus.config import load_study
    from saltus.errors import MotionError, ParameterError, SaltusError, SweepError, TraceError
    from saltus.flow import EventKind, Motion, Sensitivities, Stop, capture_speed, sensitivities, simulate, simulate_many
    from saltus.orbits import (
        Branch,
        Locus,
        PeriodicOrbit,
        SpecialPoint,
        continue_orbit,
        continue_special,
        doubling_cascade,
        find_orbit,
        search_orbits,
        switch_branch,
    )
    from saltus.studies import bifurcation_diagram, chaotic_bands, phase_portrait, response_spectrum, stability_chart
    from saltus.systems import (
        EnergyRestitution,
        Harmonic,
        InelasticImpact,
        Load,
        Metainterface,
        Model,
        PhysicalCell,
        Record,
        RockingBlock,
        System,
        TwoLayer,
        UnitCell,
        VelocityReduction,
        WallOscillator,
        register,
    )

_HOMES = {
    "saltus.errors": ("MotionError", "ParameterError", "SaltusError", "SweepError", "TraceError"),
    "saltus.attractors": (
        "Exponents",
        "Verdict",
        "attractors_along",
        "basins",
        "classify",
        "excludes_tori",
        "lyapunov_many",
        "lyapunov_spectrum",
        "separatrices",
        "stable_manifold",
        "zero_one_test",
    ),
    "saltus.config": ("load_study",),
    "saltus.flow": (
        "EventKind",
        "Motion",
        "Sensitivities",
        "Stop",
        "capture_speed",
        "sensitivities",
        "simulate",
        "simulate_many",
    ),
    "saltus.orbits": (
        "Branch",
        "Locus",
        "PeriodicOrbit",
        "SpecialPoint",
        "continue_orbit",
        "continue_special",
        "doubling_cascade",
        "find_orbit",
        "search_orbits",
        "switch_branch",
    ),
    "saltus.studies": ("bifurcation_diagram", "chaotic_bands", "phase_portrait", "response_spectrum", "stability_chart"),
    "saltus.systems": (
        "EnergyRestitution",
        "Harmonic",
        "InelasticImpact",
        "Load",
        "Metainterface",
        "Model",
        "PhysicalCell",
        "Record",
        "RockingBlock",
        "System",
        "TwoLayer",
        "UnitCell",
        "VelocityReduction",
        "WallOscillator",
        "register",
    ),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_ROOMS = ("attractors", "flow", "orbits", "studies", "sweep", "systems", "theory")

__all__ = [
    "Branch",
    "EnergyRestitution",
    "EventKind",
    "Exponents",
    "Harmonic",
    "InelasticImpact",
    "Load",
    "Locus",
    "Metainterface",
    "Model",
    "Motion",
    "MotionError",
    "ParameterError",
    "PeriodicOrbit",
    "PhysicalCell",
    "Record",
    "RockingBlock",
    "SaltusError",
    "Sensitivities",
    "SpecialPoint",
    "Stop",
    "SweepError",
    "System",
    "TraceError",
    "TwoLayer",
    "UnitCell",
    "VelocityReduction",
    "Verdict",
    "WallOscillator",
    "attractors",
    "attractors_along",
    "basins",
    "bifurcation_diagram",
    "capture_speed",
    "chaotic_bands",
    "classify",
    "continue_orbit",
    "continue_special",
    "doubling_cascade",
    "excludes_tori",
    "find_orbit",
    "flow",
    "load_study",
    "lyapunov_many",
    "lyapunov_spectrum",
    "orbits",
    "phase_portrait",
    "register",
    "response_spectrum",
    "search_orbits",
    "sensitivities",
    "separatrices",
    "simulate",
    "simulate_many",
    "stability_chart",
    "stable_manifold",
    "studies",
    "sweep",
    "switch_branch",
    "systems",
    "theory",
    "zero_one_test",
]


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        return getattr(import_module(_HOME_OF[name]), name)
    if name in _ROOMS:
        return import_module(f"saltus.{name}")
    raise AttributeError(f"saltus has no {name!r}; see dir(saltus)")


def __dir__() -> list[str]:
    return __all__
