"""How it looks: one module per kind of picture, drawn from datasets only, in the conventions of `style`.

Nothing here computes a motion. Every function returns a matplotlib Figure or marks an Axes, and needs no display.
"""
