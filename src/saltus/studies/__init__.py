"""The questions of a designer: phase portraits, bifurcation diagrams with their bands of chaos,
stability charts.

`portrait.py` is about constant loads, `diagram/` about one parameter, `chart/` about two. Each
study is a function of a `System` that returns a dataset, and calls `progress(fraction, what)` while
it computes. Basins are found in `saltus.attractors`.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
