"""What one asks: phase portraits, response spectra, bifurcation diagrams with their bands of chaos, basins, stability charts."""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
