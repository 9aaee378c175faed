from .contacts.layout import SegmentEnd, SegmentExtremes, SegmentPlan
from .kernel.layout import SegmentColumn, SegmentValue
from .kernel.memory_layout import EventCode
from .kernel.orbit_segments import SegmentFollower, load_segments
from .kernel.structures import Program, limits_of, program
from .lanes.capture_speeds import captured_between
from .lanes.ensemble import TangentEnsemble, simulate_many
from .lanes.ensemble_dataset import extrema_names, stop_names, stroboscopic
from .lanes.inputs import Inputs, read_inputs
from .lanes.threads import available_cores, share_cores
from .long_time.approach import approached
from .long_time.load_release import Release, contact_pull, load_releases, peak_near
from .long_time.recurrence import (
    RECURRENCE,
    Ending,
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
from .motion.events import Event, EventKind, Impacts, Stop, modes_of
from .motion.motion import Motion, rate_name, state_names
from .motion.request import MotionRequest
from .motion.sensitivities import Sensitivities, derivatives_of, sensitivities, state_rates
from .motion.simulate import simulate
from .motion.validity import DenseOutput, Validity
from .one_contact.regularity import ContactRegularity, contact_regularity

__all__ = [
    "RECURRENCE",
    "ContactRegularity",
    "DenseOutput",
    "Ending",
    "Event",
    "EventCode",
    "EventKind",
    "Impacts",
    "Inputs",
    "Motion",
    "MotionRequest",
    "Program",
    "Recurrence",
    "RecurrenceSettings",
    "Release",
    "SegmentColumn",
    "SegmentEnd",
    "SegmentExtremes",
    "SegmentFollower",
    "SegmentPlan",
    "SegmentValue",
    "Sensitivities",
    "Stop",
    "TangentEnsemble",
    "Validity",
    "approached",
    "available_cores",
    "captured_between",
    "contact_pull",
    "contact_regularity",
    "derivatives_of",
    "ensemble_from",
    "extrema_names",
    "find_recurrence",
    "last_states",
    "limits_of",
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
]
