from .belt_oscillator import BeltOscillator
from .cell_chain import CellChain, FourCells, ThreeCells, TwoCells
from .cell_layout import CellLayout
from .contact import Contact, Friction
from .contact_model import (
    ContactModel,
    apart,
    constrained_acceleration,
    mass_and_force,
    normal_forces,
    reactions,
    stick_margins,
)
from .impact_laws import (
    EnergyRestitution,
    ImpactLaw,
    InelasticImpact,
    NewtonImpact,
    VelocityReduction,
    energy_gain,
    energy_gains,
)
from .impact_pair import ImpactPair
from .load import Channel, DeclaredLoad, Load
from .metainterface import Metainterface
from .mirror import contact_images, image_of
from .model import MarginKind, Model
from .one_contact_model import OneContactModel
from .parameter_tables import broadcast_arrays, check_parameters, distinct_rows, finite_array, parameter_table
from .parameters import children, is_number, numbers, substitute
from .pulse import Pulse
from .pulses import Chirp, HalfSine, MavroeidisPapageorgiou, OneCosine, OneSine, Ramp, Ricker
from .registry import IMPACTS, MODELS, register
from .reversed import reversed_system
from .rocking_block import RockingBlock
from .scenarios import LayerState, NamedImpact, Scenario, TableRow, name_impact, other_impulse, table_1
from .serial import signal_class
from .si_units import PhysicalCell
from .signals import Constant, Harmonic, Record, Signal, Sum
from .system import System, check_system
from .two_layer import TwoLayer
from .two_stops import TwoStops
from .unit_cell import UnitCell
from .wall_oscillator import WallOscillator

__all__ = [
    "IMPACTS",
    "MODELS",
    "BeltOscillator",
    "CellChain",
    "CellLayout",
    "Channel",
    "Chirp",
    "Constant",
    "Contact",
    "ContactModel",
    "DeclaredLoad",
    "EnergyRestitution",
    "FourCells",
    "Friction",
    "HalfSine",
    "Harmonic",
    "ImpactLaw",
    "ImpactPair",
    "InelasticImpact",
    "LayerState",
    "Load",
    "MarginKind",
    "MavroeidisPapageorgiou",
    "Metainterface",
    "Model",
    "NamedImpact",
    "NewtonImpact",
    "OneContactModel",
    "OneCosine",
    "OneSine",
    "PhysicalCell",
    "Pulse",
    "Ramp",
    "Record",
    "Ricker",
    "RockingBlock",
    "Scenario",
    "Signal",
    "Sum",
    "System",
    "TableRow",
    "ThreeCells",
    "TwoCells",
    "TwoLayer",
    "TwoStops",
    "UnitCell",
    "VelocityReduction",
    "WallOscillator",
    "apart",
    "broadcast_arrays",
    "check_parameters",
    "check_system",
    "children",
    "constrained_acceleration",
    "contact_images",
    "distinct_rows",
    "energy_gain",
    "energy_gains",
    "finite_array",
    "image_of",
    "is_number",
    "mass_and_force",
    "name_impact",
    "normal_forces",
    "numbers",
    "other_impulse",
    "parameter_table",
    "reactions",
    "register",
    "reversed_system",
    "signal_class",
    "stick_margins",
    "substitute",
    "table_1",
]
