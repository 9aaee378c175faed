"""Basins of attraction: which attractor the motion from each state of a grid ends on.

`grid` is the picture and `basin_cells` its cells, at once or as a sweep; `labelling` finds the attractor of a state, `boundaries`
the curves at which basins meet, and `fractal` measures how they interlace.
"""
