"""What one asks: response spectra and bifurcation diagrams."""

from saltus.studies.spectrum import bifurcation_diagram, response_spectrum

__all__ = ["bifurcation_diagram", "response_spectrum"]
