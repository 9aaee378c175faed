from .cell_chain import FourCells, ThreeCells, TwoCells
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
from .load import Channel, DeclaredLoad, Load
from .metainterface import Metainterface
from .mirror import contact_images, image_of
from .model import MarginKind, Model, OneContactModel
from .oscillators import BeltOscillator, ImpactPair, TwoStops, WallOscillator
from .parameter_tables import (
    broadcast_arrays,
    check_along,
    check_parameters,
    check_path,
    distinct_rows,
    finite_array,
    parameter_table,
)
from .parameters import children, is_number, numbers, substitute
from .pulses import Chirp, HalfSine, MavroeidisPapageorgiou, OneCosine, OneSine, Pulse, Ramp, Ricker
from .registry import IMPACTS, MODELS, register
from .reversed import reversed_system
from .rocking_block import RockingBlock
from .scenarios import LayerState, Scenario, name_impact, other_impulse, table_1
from .serial import signal_class
from .si_units import PhysicalCell
from .signals import Constant, Harmonic, Record, Signal, Sum
from .start_state import arguments_of, read_start, read_starts, state_of
from .states import (
    Box,
    Window,
    before_impacts,
    check_reached,
    check_window,
    even_steps,
    held_by_contacts,
    initial_states,
    is_still,
    on_this_side,
    rest_state,
    states_beside,
    within_window,
)
from .system import System, check_system
from .two_layer import TwoLayer
from .unit_cell import UnitCell

__all__ = [
    "IMPACTS",
    "MODELS",
    "BeltOscillator",
    "Box",
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
    "ThreeCells",
    "TwoCells",
    "TwoLayer",
    "TwoStops",
    "UnitCell",
    "VelocityReduction",
    "WallOscillator",
    "Window",
    "apart",
    "arguments_of",
    "before_impacts",
    "broadcast_arrays",
    "check_along",
    "check_parameters",
    "check_path",
    "check_reached",
    "check_system",
    "check_window",
    "children",
    "constrained_acceleration",
    "contact_images",
    "distinct_rows",
    "energy_gain",
    "energy_gains",
    "even_steps",
    "finite_array",
    "held_by_contacts",
    "image_of",
    "initial_states",
    "is_number",
    "is_still",
    "mass_and_force",
    "name_impact",
    "normal_forces",
    "numbers",
    "on_this_side",
    "other_impulse",
    "parameter_table",
    "reactions",
    "read_start",
    "read_starts",
    "register",
    "rest_state",
    "reversed_system",
    "signal_class",
    "state_of",
    "states_beside",
    "stick_margins",
    "substitute",
    "table_1",
    "within_window",
]
