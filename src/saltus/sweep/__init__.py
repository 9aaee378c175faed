"""Many computations at once: a plan of independent chunks, computed on this machine or on a
cluster, each written once.

A `Plan` is a function, its arguments and a grid cut into chunks. `run` computes it, in memory or
into a Zarr store, and continues where an earlier run was stopped or killed. `status` says how far a
store is, `open_store` reads it. There is no physics here.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
