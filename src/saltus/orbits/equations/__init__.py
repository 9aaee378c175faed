"""The equations of a periodic orbit F(unknowns, parameters) = 0, in one file for each kind of
equations; `kinds.py` lists them.
"""
