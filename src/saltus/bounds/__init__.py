"""Proofs about motions that need no simulation: interval bounds, capture at rest, the energy
barrier, the adiabatic invariant.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
