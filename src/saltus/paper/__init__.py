"""The paper: one file per figure, the tables of its claims, what is measured for each of them, and the report.

`reproduce` makes every figure, table and claim that is not up to date; `FIGURES` holds them by name, in the paper's order.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
