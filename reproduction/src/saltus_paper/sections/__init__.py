"""Sections 2 to 5 and the appendix: the computations by which statements are judged that belong to
no figure.
"""
