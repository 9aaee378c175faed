"""How it moves: a model is traced into Taylor recurrences, compiled once for its structure, and followed event by event.

Impacts are roots of the gap's series, found for certain; rest, release, accumulations of impacts and chatter are modes of
their own. Nothing is smoothed. `simulate` is the way in; `Motion` is what it returns, `sensitivities` differentiates
it, and `simulate_many` follows a million of them. Names are imported when they are used: one motion needs no lanes.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
