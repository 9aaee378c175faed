"""The motion of a system: its model is traced into Taylor recurrences, compiled once for its
structure, and followed by events.

Impacts are roots of the gap's series, and no root is missed; rest, release, accumulations of
impacts and chatter are modes of their own. Nothing is smoothed. `simulate` returns a `Motion`,
`sensitivities` differentiates it, and `simulate_many` follows many motions, up to millions. Names
are imported at their first use: one motion does not load the code for lanes.
"""

from saltus._front_door import front_door
from saltus.checks import check_environment

check_environment()  # before files of this room import numba
__getattr__, __dir__, __all__ = front_door(__name__, __file__)
