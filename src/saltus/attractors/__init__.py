"""Where it ends: verdicts on motions and their Lyapunov exponents, the set of attractors, their basins and what parts them."""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
