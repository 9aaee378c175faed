"""Closed forms of the metainterface and related models, each with the label of the paper's equation
that it states.

Under constant loads: energies, equilibria and divergence, small vibrations and their decay, the
piecewise-linear motion impact by impact, and the two peaks of conservative motion. Beyond them: the
quasi-static borders, the onset at high frequency, the restitution of inelastic contact, the rocking
block's periods and the upright pendulum. The periodic orbits of the impact oscillator come with
their folds, period doublings and grazings. Nothing here integrates an equation of motion; arguments
outside the range of a formula are refused with a ParameterError.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
