"""Response spectra and bifurcation diagrams: every branch that a search finds, and the bands of chaos.

`diagram.py` searches, `branch_set.py` follows what is found and what is born on it, `chaos_search.py` looks for chaos, which
`bands.py` holds, `side_by_side.py` does both at the same time, and `diagram_dataset.py` confirms all orbits by simulation and
makes the result.
"""
