"""Stability charts: the stable motions beside rest in the plane of two parameters, with exact borders.

`request.py` holds what is asked for, `cells.py` computes the cells of a block of the plane, and `motions.py` is the record of a
stable motion that all files share. `changes.py` finds where a motion has no counterpart in the neighbouring cell, `follow.py`
continues it to the special point at which it ends, and `borders.py` follows such points as curves through the plane.
"""
