"""Lyapunov exponents, through the saltation of every impact.

`spectrum` has all exponents of one motion, `ensemble` both of many motions at once (by `tangent_frames`), `largest_exponent` only
the largest one, from `perturbations` by derivatives (`stretching`) or pairs of motions (`neighbours`). They share
`renormalisation`, how a run is cut and begun, and `averages`, the mean of a run. `two_trajectory` and `area_contraction` are
independent checks.
"""
