"""What moves: the contract of a model, the models, their loads and impact laws, and the system that joins them.

Every class here is frozen, dimensionless and pure; `UnitCell` converts from and to SI. Nothing here integrates anything.
"""

from saltus.systems.cell_layout import CellLayout
from saltus.systems.impact import EnergyRestitution, ImpactLaw, InelasticImpact, VelocityReduction
from saltus.systems.load import Channel, Load
from saltus.systems.metainterface import Metainterface
from saltus.systems.model import Model
from saltus.systems.registry import IMPACTS, MODELS, register
from saltus.systems.reversed import reversed_system
from saltus.systems.rocking_block import RockingBlock
from saltus.systems.scenarios import Impact, LayerState, Scenario, TableRow, name_impact, other_impulse, table_1
from saltus.systems.si_units import PhysicalCell
from saltus.systems.signals import Constant, Harmonic, Record, Signal, Sum
from saltus.systems.system import System
from saltus.systems.two_layer import TwoLayer
from saltus.systems.unit_cell import UnitCell
from saltus.systems.wall_oscillator import WallOscillator

__all__ = [
    "IMPACTS",
    "MODELS",
    "CellLayout",
    "Channel",
    "Constant",
    "EnergyRestitution",
    "Harmonic",
    "Impact",
    "ImpactLaw",
    "InelasticImpact",
    "LayerState",
    "Load",
    "Metainterface",
    "Model",
    "PhysicalCell",
    "Record",
    "RockingBlock",
    "Scenario",
    "Signal",
    "Sum",
    "System",
    "TableRow",
    "TwoLayer",
    "UnitCell",
    "VelocityReduction",
    "WallOscillator",
    "name_impact",
    "other_impulse",
    "register",
    "reversed_system",
    "table_1",
]
