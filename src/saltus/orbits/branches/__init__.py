"""Branches of orbits along one parameter, and curves of special points along two."""
