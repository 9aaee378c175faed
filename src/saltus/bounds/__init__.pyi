from .capture import capture_speed, proved_speeds
from .gap_equation import Leaves, reads
from .intervals import Interval, enclose

__all__ = ["Interval", "Leaves", "capture_speed", "enclose", "proved_speeds", "reads"]
