"""Stable and unstable manifolds of saddles, and the separatrices of the phase plane under a constant load."""
