from .compiled import load_segments
from .ensemble.compiled_lanes import load_advance, load_driver, load_helpers
from .ensemble.dataset_reading import stop_names, stroboscopic
from .ensemble.ensemble import compiled_lanes, simulate_many
from .ensemble.ensemble_dataset import Wanted
from .ensemble.inputs import Inputs, read_inputs
from .ensemble.threads import Jobs, Lanes, available_cores
from .load_release import Release, contact_pull, load_releases, peak_near
from .motion import DenseOutput, Event, EventKind, Impacts, Motion
from .sensitivity import Sensitivities, sensitivities
from .simulation import limits_of, program, simulate, taylor_order
from .stops import Stop
from .validity import Validity

__all__ = [
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
