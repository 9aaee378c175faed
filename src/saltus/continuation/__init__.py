"""Numerical continuation of curves F(y, p) = 0 in any number of parameters p: prediction,
correction and control of the step.

A problem is an `EquationCurve`, a residual and its derivatives. Its special features are given as
its `Events`: test functions, conditions that cut a step short, changes of the equations.
`Continuation` is the loop.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
