"""Exact non-smooth dynamics of a buckling-based metainterface and of its relatives.

The public names are loaded at their first use, so that `import saltus` stays light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from saltus import flow, systems, theory
    from saltus.config import load_study
    from saltus.errors import MotionError, ParameterError, SaltusError, TraceError
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
    from saltus.studies import bifurcation_diagram, response_spectrum
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
    "saltus.errors": ("MotionError", "ParameterError", "SaltusError", "TraceError"),
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
    "saltus.studies": ("bifurcation_diagram", "response_spectrum"),
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
_ROOMS = ("flow", "orbits", "studies", "systems", "theory")

__all__ = [
    "Branch",
    "EnergyRestitution",
    "EventKind",
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
    "System",
    "TraceError",
    "TwoLayer",
    "UnitCell",
    "VelocityReduction",
    "WallOscillator",
    "bifurcation_diagram",
    "capture_speed",
    "continue_orbit",
    "continue_special",
    "doubling_cascade",
    "find_orbit",
    "flow",
    "load_study",
    "orbits",
    "register",
    "response_spectrum",
    "search_orbits",
    "sensitivities",
    "simulate",
    "simulate_many",
    "studies",
    "switch_branch",
    "systems",
    "theory",
]


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        return getattr(import_module(_HOME_OF[name]), name)
    if name in _ROOMS:
        return import_module(f"saltus.{name}")
    raise AttributeError(f"saltus has no {name!r}; see dir(saltus)")


def __dir__() -> list[str]:
    return __all__
