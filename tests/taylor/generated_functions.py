"""The generated functions of one motion, compiled, with the numbers of a system, to be called from
Python.
"""

from functools import cache

import numpy as np
from numba import njit

from saltus.flow.kernel import memory
from saltus.flow.programs.compiled import load_structure
from saltus.systems.serial import numbers
from saltus.taylor import record_table, trace, written_type


@cache
def caller(name):
    """A function that calls a generated one, which has no wrapper for Python, through its
    pointer.
    """
    signature = getattr(memory, name.upper())
    arguments = ", ".join(f"x{i}" for i in range(len(signature.args)))
    scope = {}
    exec(f"def call(f, {arguments}):\n    return f({arguments})", scope)
    return njit(signature.return_type(written_type(signature), *signature.args))(scope["call"])


class Generated:
    """A system's `series` and the other generated functions, with its numbers."""

    def __init__(self, system, stop_at=(), sensitivities=None):
        self.trace = trace(system, stop_at, sensitivities)
        self.structure = load_structure(self.trace)
        parameters = np.array([value for _, value in numbers(system)] or [0.0])
        self.env, _ = self.structure.prepare(parameters, record_table(system, self.trace.records))
        several = ("series", "matrices", "matrix_slopes", "tangent", "load_series")
        names = (
            several
            if self.trace.signs
            else ("series", "contact_series", "reset", "contact_damping", "tangent")
        )
        self._functions = dict(zip(names, self.structure.functions, strict=True))

    def call(self, name, *arguments):
        return caller(name)(self._functions[name], *arguments)

    def coefficients(self, t, position, velocity, order, side=1.0, piece=0):
        """Taylor coefficients of the coordinates, (degrees of freedom, order + 1), at a state."""
        return self.all(t, position, velocity, order, side, piece)[0][:, : order + 1]

    def all(self, t, position, velocity, order, side=1.0, piece=0):
        """Taylor coefficients of coordinates, velocities, accelerations, gap and margins."""
        dof, stops, rows = self.structure.sizes[:3]
        q, v, a = (np.full((dof, order + 2), np.nan) for _ in range(3))
        g, m, w = (
            np.zeros(order + 2),
            np.zeros((max(1, stops), order + 2)),
            np.full((rows, order + 6), np.nan),
        )
        q[:, 0], v[:, 0] = position, velocity
        self.call("series", t, 0.0, side, self.env, piece, q, v, a, g, m, w, order)
        return q, v, a, g, m

    def contact(self, t, order, side, piece=0):
        """Taylor coefficients in the time of the gap's acceleration at rest at contact."""
        b, w = np.zeros(order + 2), np.full((1, order + 6), np.nan)
        self.call("contact_series", t, 0.0, side, self.env, piece, b, w, order)
        return b[: order + 1]

    def reset(self, t, velocity, side, piece=0):
        """The next side and the velocity after an impact."""
        return self.call("reset", t, 0.0, velocity, side, self.env, piece)
