"""Exact non-smooth dynamics of a buckling-based metainterface and of its relatives.

The public names are those of `__init__.pyi`; each is loaded at its first use, so that `import
saltus` stays light.
"""

from saltus._front_door import front_door

__version__ = "0.3.0"

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
