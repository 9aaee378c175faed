"""Many computations at once: a plan of independent chunks, computed on this machine or on a cluster, each written once.

A `Plan` is a function, its arguments and a grid cut into chunks. `run` computes it, in memory or into a Zarr store, from where
an earlier run was stopped or killed. `status` says how far a store is, `open_store` reads it. There is no physics here.
"""

from saltus.sweep.chunk import Failure
from saltus.sweep.plan import Plan, Variable
from saltus.sweep.run import SweepInterrupted, run
from saltus.sweep.status import Status, status
from saltus.sweep.store import open_store

__all__ = ["Failure", "Plan", "Status", "SweepInterrupted", "Variable", "open_store", "run", "status"]
