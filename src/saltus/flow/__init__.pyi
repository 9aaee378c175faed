from .compiled import load_segments
from .ensemble.compiled_lanes import load_advance, load_driver, load_helpers
from .ensemble.ensemble import compiled_lanes, simulate_many
from .ensemble.ensemble_dataset import Wanted
from .ensemble.inputs import Inputs, broadcast, check_parameters, numeric, parameter_table, read_inputs
from .ensemble.lane_layout import FIRST_PLACE, NEW_SIDE, NEW_TIME, NOW, ORIGIN, SIDE_NOW, STRIDE
from .ensemble.threads import Jobs, Lanes, available_cores
from .kernel_layout import (
    AFTER_IMPACTS,
    AT_A_JUMP,
    AT_A_ROOT,
    AT_NONE,
    AT_ONCE,
    IMPACT,
    LIMIT,
    NEVER_AGAIN,
    RELEASE,
    RESET_SLOPES,
    RESTING,
    STATE,
)
from .load_release import Release, contact_pull, load_releases, peak_near
from .motion import DenseOutput, Event, EventKind, Impacts, Motion, Stop
from .sensitivity import Sensitivities, sensitivities
from .simulation import limits_of, program, simulate, taylor_order
from .validity import Validity

__all__ = [
    "AFTER_IMPACTS",
    "AT_A_JUMP",
    "AT_A_ROOT",
    "AT_NONE",
    "AT_ONCE",
    "FIRST_PLACE",
    "IMPACT",
    "LIMIT",
    "NEVER_AGAIN",
    "NEW_SIDE",
    "NEW_TIME",
    "NOW",
    "ORIGIN",
    "RELEASE",
    "RESET_SLOPES",
    "RESTING",
    "SIDE_NOW",
    "STATE",
    "STRIDE",
    "DenseOutput",
    "Event",
    "EventKind",
    "Impacts",
    "Inputs",
    "Jobs",
    "Lanes",
    "Motion",
    "Release",
    "Sensitivities",
    "Stop",
    "Validity",
    "Wanted",
    "available_cores",
    "broadcast",
    "check_parameters",
    "compiled_lanes",
    "contact_pull",
    "limits_of",
    "load_advance",
    "load_driver",
    "load_helpers",
    "load_releases",
    "load_segments",
    "numeric",
    "parameter_table",
    "peak_near",
    "program",
    "read_inputs",
    "sensitivities",
    "simulate",
    "simulate_many",
    "taylor_order",
]
