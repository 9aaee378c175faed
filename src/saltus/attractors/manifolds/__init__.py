"""Invariant manifolds of saddles: the curves between basins.

`saddle_manifolds` are those of saddle orbits in the stroboscopic section, grown by `manifold_growth`; under a constant load
`equilibria` computes the equilibria of the phase plane and `phase_plane` the separatrices of its saddles.
"""
