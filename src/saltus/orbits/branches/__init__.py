"""Branches of orbits along one parameter, curves of special points along two, their special points,
changes and ends.
"""
