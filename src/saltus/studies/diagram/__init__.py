"""Response spectra and bifurcation diagrams: every branch that a search finds, and the bands of
chaos.

`diagram_study.py` has the functions for users and makes the result, `effort.py` how much is tried.
`diagram_search.py` searches: `simulated.py` holds the motions, `branch_set.py` what is followed of
them, `chaos_search.py` looks for chaos at the values of `searched_range.py`, which `bands.py`
holds. Long computations are done by `diagram_work.py`.
"""
