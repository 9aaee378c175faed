from .capture import capture_speed, keeps_rest, proved_speeds
from .contraction import area_contraction, leaves_over_a_period, on_side
from .gap_equation import Leaves, reads
from .intervals import Interval, enclose

__all__ = [
    "Interval",
    "Leaves",
    "area_contraction",
    "capture_speed",
    "enclose",
    "keeps_rest",
    "leaves_over_a_period",
    "on_side",
    "proved_speeds",
    "reads",
]
