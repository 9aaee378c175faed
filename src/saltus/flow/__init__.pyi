from .approach import approached
from .compiled import load_contact_segments, load_segments
from .contacts.contact_layout import ContactColumn, SegmentEnd, SegmentExtremes, SegmentPlan
from .dense_output import DenseOutput
from .ensemble.capture_speeds import captured_between
from .ensemble.compiled_lanes import load_advance, load_driver, load_helpers
from .ensemble.dataset_reading import stop_names, stroboscopic
from .ensemble.ensemble import compiled_lanes, simulate_many
from .ensemble.ensemble_dataset import extrema_names
from .ensemble.inputs import Inputs, read_inputs
from .ensemble.tangent_ensemble import TangentEnsemble
from .ensemble.threads import Jobs, Lanes, available_cores, share_cores
from .ensemble.wanted import Wanted
from .kernel_layout import STRUCTURE_SIZES, Where
from .load_release import Release, contact_pull, load_releases, peak_near
from .memory_layout import EventCode
from .modes import modes_of
from .motion import Event, EventKind, Impacts, Motion
from .motion_dataset import rate_name, state_names
from .recurrence import (
    RECURRENCE,
    Outcome,
    Recurrence,
    RecurrenceSettings,
    ensemble_from,
    find_recurrence,
    last_states,
    motions_from,
    nearest_return,
    return_distances,
    return_period,
)
from .regularity import ContactRegularity, contact_regularity
from .request import MotionRequest
from .sensitivity import Sensitivities, derivatives_of, sensitivities, state_rates
from .simulation import simulate
from .stops import Stop
from .structures import Program, limits_of, program, taylor_order
from .validity import Validity

__all__ = [
    "RECURRENCE",
    "STRUCTURE_SIZES",
    "ContactColumn",
    "ContactRegularity",
    "DenseOutput",
    "Event",
    "EventCode",
    "EventKind",
    "Impacts",
    "Inputs",
    "Jobs",
    "Lanes",
    "Motion",
    "MotionRequest",
    "Outcome",
    "Program",
    "Recurrence",
    "RecurrenceSettings",
    "Release",
    "SegmentEnd",
    "SegmentExtremes",
    "SegmentPlan",
    "Sensitivities",
    "Stop",
    "TangentEnsemble",
    "Validity",
    "Wanted",
    "Where",
    "approached",
    "available_cores",
    "captured_between",
    "compiled_lanes",
    "contact_pull",
    "contact_regularity",
    "derivatives_of",
    "ensemble_from",
    "extrema_names",
    "find_recurrence",
    "last_states",
    "limits_of",
    "load_advance",
    "load_contact_segments",
    "load_driver",
    "load_helpers",
    "load_releases",
    "load_segments",
    "modes_of",
    "motions_from",
    "nearest_return",
    "peak_near",
    "program",
    "rate_name",
    "read_inputs",
    "return_distances",
    "return_period",
    "sensitivities",
    "share_cores",
    "simulate",
    "simulate_many",
    "state_names",
    "state_rates",
    "stop_names",
    "stroboscopic",
    "taylor_order",
]
