"""What is known: closed forms of the metainterface and its relatives, each beside the equation of the paper it states.

Under constant loads: energies, equilibria and divergence, small vibrations and their decay, the piecewise-linear motion impact
by impact, and the two peaks of conservative motion. Beyond them: the quasi-static borders, the onset at high frequency, the
restitution of inelastic contact, the rocking block's periods, the upright pendulum, and the periodic orbits of the impact
oscillator with their folds, period doublings and grazings. Nothing here integrates an equation
of motion; what lies outside a formula's range is refused with a ParameterError.
"""

from saltus.theory.bouncing import (
    Peaks,
    peaks,
    reciprocal,
    unloaded_half_periods,
    unloaded_peak_ratio,
    unloaded_period,
)
from saltus.theory.divergence import Divergence, divergence, linear_equilibria
from saltus.theory.energy import potential_energy, potential_slope, total_energy
from saltus.theory.equilibria import Equilibrium, Stability, equilibria, undeformed_stability
from saltus.theory.high_frequency import high_frequency_onset
from saltus.theory.layer import Layer, layers, open_layer
from saltus.theory.pendulum import pendulum_acceleration
from saltus.theory.piecewise_linear import LinearMotion, linear_motion
from saltus.theory.quasi_static import (
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
from saltus.theory.restitution import Contact, energy_factor, energy_jump, inelastic_contact, velocity_factor
from saltus.theory.rocking import (
    housner_restitution,
    rocking_energy_decreases,
    rocking_energy_jump,
    rocking_period,
    short_rocking_period,
    slender_rocking_period,
)
from saltus.theory.small_vibrations import (
    Vibration,
    decayed_amplitude,
    decayed_period,
    final_time,
    linear_period,
    short_period,
    upright_period,
    vibrations,
)
from saltus.theory.wall_orbits import WallOrbit, WallOrbits, wall_orbits

__all__ = [
    "Contact",
    "Divergence",
    "Equilibrium",
    "Layer",
    "LinearMotion",
    "Peaks",
    "Stability",
    "Vibration",
    "WallOrbit",
    "WallOrbits",
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
