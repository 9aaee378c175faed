"""The paper, computed with saltus: one file per figure, the tables of its claims, what is measured
for each, and the report.

`reproduce` makes every figure, table and claim that is not up to date; `FIGURES` holds them by
name, in the paper's order. The names are those of `__init__.pyi`; each is loaded at its first use,
so that `saltus --help`, which finds the commands of this package, stays immediate.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
