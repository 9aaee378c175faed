"""Proofs of orbits and of special points by interval arithmetic: which segments an orbit has, what
is proved of it, and the certificate with which others check the proof.
"""
