from .capture import keeps_rest as keeps_rest
from .capture import proved_speeds as proved_speeds
from .gap_equation import Leaves as Leaves
from .gap_equation import area_contraction as area_contraction
from .gap_equation import largest_pushes as largest_pushes
from .gap_equation import reads as reads
from .intervals import Interval as Interval
from .intervals import enclose as enclose
