"""Where motions end: verdicts and Lyapunov exponents of motions, the attractors, their basins and
the curves between these.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
