"""Response spectra and bifurcation diagrams: every branch that a search finds, and the bands of chaos."""
