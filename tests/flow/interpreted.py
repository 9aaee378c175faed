"""The generated functions run as plain Python: the text that numba compiles, without the wait."""

import inspect
import math

import numpy as np

from saltus.systems.parameters import numbers
from saltus.taylor import records
from saltus.taylor.cache import MARKER
from saltus.taylor.scalar_source import Emitter
from saltus.taylor.tracing import record_table, trace


class Interpreted:
    """A system's `series` and the other generated functions, with its numbers."""

    def __init__(self, system, stop_at=(), sensitivities=None):
        self.trace = trace(system, stop_at, sensitivities)
        self.source = Emitter(self.trace).source()
        names = ["CONSTANTS", "GEOMETRY", "SERIES", "CONTACT_SERIES", "RESET", "CONTACT_DAMPING", "TANGENT"]
        self.scope = {
            "math": math,
            "np": np,
            "jit": lambda f: f,
            "lowered_jit": lambda signature, **_: lambda f: f,
            **dict.fromkeys(names),
        }
        exec(inspect.getsource(records).split(MARKER, 1)[1].split("\n", 1)[1] + self.source, self.scope)
        p, constants = np.array([value for _, value in numbers(system)]), np.zeros(self.scope["CONSTANT_COUNT"])
        self.scope["constants"](p, constants)
        self.env = (p, constants, *record_table(system, self.trace.records))

    def coefficients(self, t, position, velocity, order, side=1.0, piece=0):
        """Taylor coefficients of the coordinates, (degrees of freedom, order + 1), at a state."""
        return self.all(t, position, velocity, order, side, piece)[0][:, : order + 1]

    def all(self, t, position, velocity, order, side=1.0, piece=0):
        """Taylor coefficients of coordinates, velocities, accelerations, gap and margins."""
        dof, stops, rows = (self.scope[name] for name in ("DOF", "STOPS", "ROWS"))
        q, v, a = (np.zeros((dof, order + 2)) for _ in range(3))
        g, m, w = np.zeros(order + 2), np.zeros((max(1, stops), order + 2)), np.full((rows, order + 6), np.nan)
        q[:, 0], v[:, 0] = position, velocity
        self.scope["series"](t, 0.0, side, self.env, piece, q, v, a, g, m, w, order)
        return q, v, a, g, m

    def contact(self, t, order, side, piece=0):
        """Taylor coefficients in the time of the gap's acceleration at rest at contact."""
        b, w = np.zeros(order + 2), np.full((self.scope["ROWS"], order + 6), np.nan)
        self.scope["contact_series"](t, 0.0, side, self.env, piece, b, w, order)
        return b[: order + 1]

    def reset(self, t, velocity, side, piece=0):
        """The next side and the velocity after an impact."""
        return self.scope["reset"](t, 0.0, velocity, side, self.env, piece)
