"""How it moves: a model is traced into Taylor recurrences, compiled once for its structure, and followed event by event.

Impacts are roots of the gap's series, found for certain; rest, release, accumulations of impacts and chatter are modes of
their own. Nothing is smoothed. `simulate` is the way in; `Motion` is what it returns, `sensitivities` differentiates
it, and `simulate_many` follows a million of them.
"""

from saltus.flow.capture import capture_speed
from saltus.flow.ensemble import simulate_many
from saltus.flow.motion import Crossings, DenseOutput, Event, EventKind, Motion, Stop
from saltus.flow.sensitivity import Sensitivities, sensitivities
from saltus.flow.simulation import simulate
from saltus.flow.validity import Validity

__all__ = [
    "Crossings",
    "DenseOutput",
    "Event",
    "EventKind",
    "Motion",
    "Sensitivities",
    "Stop",
    "Validity",
    "capture_speed",
    "sensitivities",
    "simulate",
    "simulate_many",
]
