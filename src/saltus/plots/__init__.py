"""How it looks: one module per kind of picture, drawn from datasets only, in the conventions of `style`.

Nothing here computes a motion. Every function returns a matplotlib Figure or marks an Axes, and needs no display.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
