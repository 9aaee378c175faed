from .chunk_results import Failure
from .cluster import on_cluster
from .execution import SweepInterrupted, run
from .plan import Plan, Variable
from .store import BEGIN_ANEW, check_store, open_store, remove_store
from .store_status import StoreStatus, damage, read_plan, status

__all__ = [
    "BEGIN_ANEW",
    "Failure",
    "Plan",
    "StoreStatus",
    "SweepInterrupted",
    "Variable",
    "check_store",
    "damage",
    "on_cluster",
    "open_store",
    "read_plan",
    "remove_store",
    "run",
    "status",
]
