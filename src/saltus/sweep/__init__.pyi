from .chunks import Failure
from .cluster import on_cluster
from .execution import SweepInterrupted, check_run, run
from .memo import Memo, MemoKind
from .plan import Plan, Variable
from .store import BEGIN_ANEW, check_store, open_store, opened, remove_store
from .store_status import StoreStatus, damage, read_plan, status
from .workers import Workers

__all__ = [
    "BEGIN_ANEW",
    "Failure",
    "Memo",
    "MemoKind",
    "Plan",
    "StoreStatus",
    "SweepInterrupted",
    "Variable",
    "Workers",
    "check_run",
    "check_store",
    "damage",
    "on_cluster",
    "open_store",
    "opened",
    "read_plan",
    "remove_store",
    "run",
    "status",
]
