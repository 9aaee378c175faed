"""How it moves: a model is traced into Taylor recurrences, compiled once for its structure, and followed event by event.

Impacts are roots of the gap's series, found for certain; rest, release, accumulations of impacts and chatter are modes of
their own. Nothing is smoothed. `simulate` is the way in; `Motion` is what it returns, `sensitivities` differentiates
it, and `simulate_many` follows a million of them. Names are imported when they are used: one motion needs no lanes.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from saltus.flow.capture import capture_speed
    from saltus.flow.ensemble import simulate_many
    from saltus.flow.motion import Crossings, DenseOutput, Event, EventKind, Motion, Stop
    from saltus.flow.sensitivity import Sensitivities, sensitivities
    from saltus.flow.simulation import simulate
    from saltus.flow.validity import Validity

_NAMES = {
    "capture": ("capture_speed",),
    "ensemble": ("simulate_many",),
    "motion": ("Crossings", "DenseOutput", "Event", "EventKind", "Motion", "Stop"),
    "sensitivity": ("Sensitivities", "sensitivities"),
    "simulation": ("simulate",),
    "validity": ("Validity",),
}
_HOME_OF = {name: f"saltus.flow.{home}" for home, names in _NAMES.items() for name in names}

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


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name in _HOME_OF:
            return getattr(import_module(_HOME_OF[name]), name)
        raise AttributeError(f"saltus.flow has no {name!r}; see dir(saltus.flow)")


def __dir__() -> list[str]:
    return __all__
