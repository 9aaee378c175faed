from .chunk import Failure
from .cluster import on_cluster
from .plan import Plan, Variable
from .run import SweepInterrupted, run
from .status import Status, read_plan, status
from .store import open_store

__all__ = ["Failure", "Plan", "Status", "SweepInterrupted", "Variable", "on_cluster", "open_store", "read_plan", "run", "status"]
