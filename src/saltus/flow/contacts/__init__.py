"""Motions with several contacts; each holds one coordinate while it is closed and its reaction pushes.

`kernel.py` has the smooth steps, `impacts.py` impacts and accumulations of them (`complementarity.py` solves for impulses),
`decisions.py` and `choice.py` say which contacts stay closed, `closings.py` treats contacts that close at one instant,
`frictions.py` what sticks and slides, `tangent.py` the derivatives at all of these, and `segments.py` and `extremes.py` the parts
of orbits.
"""
