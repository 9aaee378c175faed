from .capture import capture_speed, proved_speeds
from .contraction import area_contraction, leaves_over_a_period, on_side
from .gap_equation import Leaves, reads
from .intervals import Interval, enclose

__all__ = [
    "Interval",
    "Leaves",
    "area_contraction",
    "capture_speed",
    "enclose",
    "leaves_over_a_period",
    "on_side",
    "proved_speeds",
    "reads",
]
