"""Structures from their matrices, in eigenmodes; models from expressions."""
