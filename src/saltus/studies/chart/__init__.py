"""Stability charts: the stable motions beside rest in the plane of two parameters, with exact borders."""
