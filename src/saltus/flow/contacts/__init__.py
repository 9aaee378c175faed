"""Motions with several contacts; each holds one coordinate while it is closed and its reaction
pushes.

`kernel.py` has the smooth steps and decides what follows an event. `impacts.py` has impacts and
accumulations of them; `complementarity.py` solves for impulses. `closings.py` says which contacts
stay closed and what several do that close at once, and `frictions.py` what sticks and slides.
What all of these promise, with surfaces, relays and resets, is the numbered contract of `parts.py`.
`tangent.py` has the derivatives at all of these, and `segments.py` and `extremes.py` the parts of
orbits.
"""
