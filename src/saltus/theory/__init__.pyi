from .bouncing import Peaks, peaks, reciprocal, unloaded_half_periods, unloaded_peak_ratio, unloaded_period
from .energy import potential_energy, potential_slope, total_energy
from .high_frequency import high_frequency_onset
from .impact_oscillator import WallOrbit, WallOrbits, wall_orbits
from .layer import Layer, layers, open_layer
from .loaded_equilibria import LoadedEquilibrium, Stability, equilibria, undeformed_stability
from .mechanism_limits import AmplitudeLimit, amplitude_limits
from .pendulum import pendulum_acceleration
from .piecewise_linear import LinearMotion, linear_motion
from .quasi_static import (
    critical_horizontal,
    equivalent_angle,
    fold_curve,
    fold_horizontal,
    is_monostable,
    paper_monostable,
    static_angle,
    subcritical_vertical,
    unloaded_fold,
)
from .restitution import InelasticContact, energy_factor, energy_jump, inelastic_contact, velocity_factor
from .rocking import (
    housner_restitution,
    rocking_energy_decreases,
    rocking_energy_jump,
    rocking_period,
    short_rocking_period,
    slender_rocking_period,
)
from .small_vibrations import (
    Vibration,
    decayed_amplitude,
    decayed_period,
    final_time,
    linear_period,
    short_period,
    upright_period,
    vibrations,
)
from .static_border import QuasiStaticBorder, quasi_static_border
from .static_divergence import Divergence, divergence, linear_equilibria

__all__ = [
    "AmplitudeLimit",
    "Divergence",
    "InelasticContact",
    "Layer",
    "LinearMotion",
    "LoadedEquilibrium",
    "Peaks",
    "QuasiStaticBorder",
    "Stability",
    "Vibration",
    "WallOrbit",
    "WallOrbits",
    "amplitude_limits",
    "critical_horizontal",
    "decayed_amplitude",
    "decayed_period",
    "divergence",
    "energy_factor",
    "energy_jump",
    "equilibria",
    "equivalent_angle",
    "final_time",
    "fold_curve",
    "fold_horizontal",
    "high_frequency_onset",
    "housner_restitution",
    "inelastic_contact",
    "is_monostable",
    "layers",
    "linear_equilibria",
    "linear_motion",
    "linear_period",
    "open_layer",
    "paper_monostable",
    "peaks",
    "pendulum_acceleration",
    "potential_energy",
    "potential_slope",
    "quasi_static_border",
    "reciprocal",
    "rocking_energy_decreases",
    "rocking_energy_jump",
    "rocking_period",
    "short_period",
    "short_rocking_period",
    "slender_rocking_period",
    "static_angle",
    "subcritical_vertical",
    "total_energy",
    "undeformed_stability",
    "unloaded_fold",
    "unloaded_half_periods",
    "unloaded_peak_ratio",
    "unloaded_period",
    "upright_period",
    "velocity_factor",
    "vibrations",
    "wall_orbits",
]
