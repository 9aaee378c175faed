"""What one asks: response spectra, bifurcation diagrams."""
