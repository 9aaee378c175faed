"""Lyapunov exponents, through the saltation of every impact.

`spectrum` computes all exponents of one motion, with two independent checks; `many_exponents` both
exponents of many motions with one coordinate at once; `growth` the largest exponent only, for the
judge. They share `averages`: the mean over a run and its error, and how a run is begun and cut into
spans.
"""
