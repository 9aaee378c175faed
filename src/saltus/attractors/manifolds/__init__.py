"""Invariant manifolds of saddles: the curves between basins.

`saddle_manifolds` are those of saddle orbits in the stroboscopic section; under a constant load `phase_plane` computes the
equilibria and the separatrices of its saddles.
"""
