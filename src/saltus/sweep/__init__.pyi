from .chunk_results import Failure
from .cluster import on_cluster
from .execution import SweepInterrupted, run
from .plan import Plan, Variable
from .store import check_store, open_store
from .store_status import StoreStatus, read_plan, status

__all__ = [
    "Failure",
    "Plan",
    "StoreStatus",
    "SweepInterrupted",
    "Variable",
    "check_store",
    "on_cluster",
    "open_store",
    "read_plan",
    "run",
    "status",
]
