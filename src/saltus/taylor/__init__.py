"""From a model's Python to its Taylor series in machine code: traced, differentiated, written, compiled and cached."""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
