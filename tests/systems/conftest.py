"""Tools to evaluate a model with symbols: SymPy's expressions made to answer NumPy's functions, and
loads without numbers.
"""

from types import SimpleNamespace

import pytest
import sympy as sp

from saltus.systems.serial import substitute


class _Channel:
    """A channel whose value is an unknown function of the time."""

    def __init__(self, name):
        self.function = sp.Function(name)

    def __call__(self, t):
        return self.function(t)

    def velocity(self, t):
        return sp.diff(self.function(t), t)

    def acceleration(self, t):
        return sp.diff(self.function(t), t, 2)


class _AnyLoad:
    def __getattr__(self, name):
        return _Channel(name)


def _method(function):
    return lambda self: function(self)


@pytest.fixture
def symbols(monkeypatch):
    """`symbols.model(model)` has a positive symbol for every number; `symbols.load` and `symbols.t`
    complete it.
    """
    for name in ("sin", "cos", "tanh", "sqrt"):
        monkeypatch.setattr(sp.Expr, name, _method(getattr(sp, name)), raising=False)

    def model(concrete):
        return substitute(concrete, lambda path, value: sp.Symbol(path, positive=True))

    return SimpleNamespace(model=model, load=_AnyLoad(), t=sp.Symbol("tau", real=True))


@pytest.fixture
def is_zero():
    """Whether an expression vanishes identically, decided by expanding all angles."""

    def decide(expression):
        return sp.simplify(sp.expand(sp.expand_trig(sp.expand(expression)))) == 0

    return decide
