"""Kernels composed of their parts, compiled and loaded: motions, lanes, orbit segments, and the same in plain Python."""
