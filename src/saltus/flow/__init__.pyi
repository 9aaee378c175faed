from .compiled import load_segments
from .ensemble.compiled_lanes import load_advance, load_driver, load_helpers
from .ensemble.dataset_reading import stop_names, stroboscopic
from .ensemble.ensemble import compiled_lanes, simulate_many
from .ensemble.ensemble_dataset import Wanted
from .ensemble.inputs import Inputs, read_inputs
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
from .motion import DenseOutput, Event, EventKind, Impacts, Motion
from .sensitivity import Sensitivities, sensitivities
from .simulation import limits_of, program, simulate, taylor_order
from .stops import Stop
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
    "compiled_lanes",
    "contact_pull",
    "limits_of",
    "load_advance",
    "load_driver",
    "load_helpers",
    "load_releases",
    "load_segments",
    "peak_near",
    "program",
    "read_inputs",
    "sensitivities",
    "simulate",
    "simulate_many",
    "stop_names",
    "stroboscopic",
    "taylor_order",
]
