"""Pictures: one module per kind of picture, drawn from datasets only, in the conventions of
`style`.

Nothing here computes a motion, and nothing needs a display. A function for a whole result draws
into `ax`, or, where it has several panels, into `figure`. Without one it makes a figure of its own,
and it returns the axes. A function for a part of a picture marks the axes that are its first
argument.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
