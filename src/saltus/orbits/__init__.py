"""Periodic orbits of the exact system, their branches along parameters, and the special points of
these branches.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
