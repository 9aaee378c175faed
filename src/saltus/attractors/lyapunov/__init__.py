"""Lyapunov exponents, through the saltation of every impact.

`spectrum` computes all exponents of one motion, `ensemble` both exponents of many motions with one coordinate at once (by
`tangent_frames`), `largest_exponent` the largest one only, from `perturbations` by derivatives (`stretching`) or by pairs of
motions (`neighbours`). They share `renormalisation` (how a run is begun and cut into spans) and `averages` (the mean over a run).
`two_trajectory` and `area_contraction` are independent checks.
"""
