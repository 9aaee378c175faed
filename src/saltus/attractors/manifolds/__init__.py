"""Invariant manifolds of saddles: the curves that part basins.

`saddle_manifolds` are those of saddle orbits in the stroboscopic section, grown by `manifold_growth`; under a constant load
`equilibria` are the points of rest of the phase plane and `phase_plane` has the separatrices of its saddles.
"""
