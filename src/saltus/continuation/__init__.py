"""Numerical continuation of curves F(y, p) = 0 in any number of parameters p: prediction, correction and control of the step.

A problem is a `Curve`: pseudo-arclength continuation takes an `EquationCurve` (a residual and its derivatives), natural-parameter
continuation a `NaturalCurve` (one solution at each value of the parameter). The special features of a problem are given as its
`Events`: test functions, conditions that cut a step short, changes of the equations. `Continuation` is the loop that both share.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
