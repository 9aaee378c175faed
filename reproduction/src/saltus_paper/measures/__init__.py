"""Measures for the claims of Figs. 9 to 15, computed from the data of the figures."""
