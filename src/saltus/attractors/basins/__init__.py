"""Basins of attraction: which attractor the motion from each state of a grid ends on.

`grid` is the picture, and `basin_cells` finds the attractor of a state, for a grid's cells at once
or as a sweep. `boundaries` finds the curves at which basins meet, and `fractal` measures how they
interlace.
"""
