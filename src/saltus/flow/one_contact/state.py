"""The state of the scalar kernel for one motion: its arrays, from the start of the motion to its end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from saltus.errors import ParameterError
from saltus.flow.kernel.compiled import load_kernel
from saltus.flow.kernel.layout import STRUCTURE_SIZES, Mode, ModelPart, Setting, Where
from saltus.flow.kernel.memory_layout import State
from saltus.flow.kernel.structures import Program, taylor_order
from saltus.flow.motion.request import MotionRequest
from saltus.flow.one_contact.sides import side_of_state


@dataclass(frozen=True, eq=False)
class KernelState:
    """The arrays that the kernel changes, in the places of `Where`, `State` and `Setting`."""

    where: np.ndarray
    state: np.ndarray
    settings: np.ndarray

    @classmethod
    def at_start(cls, request: MotionRequest, run: Program) -> Self:
        """The state in which a motion starts.

        Raises
        ------
        ParameterError
            The state lies beyond the contact, or the model's gap or reset is impossible.
        """
        where, at = np.zeros(len(Where), dtype=np.int64), request.clock
        where[Where.PERIOD], where[Where.LAST_PERIOD] = int(at.first), int(at.last)
        where[Where.ORDER], where[STRUCTURE_SIZES] = taylor_order(request.tol), run.structure.sizes
        where[Where.PIECE] = np.searchsorted(run.env[2], request.time, side="right")
        where[Where.LEAVE_BY] = request.side or 0
        where[Where.DENSE] = int(request.dense or request.sample_times is not None)
        where[Where.MODE], where[Where.SIDE] = _mode_and_side(request, run)
        state = _first_state(run, request.position, request.speeds)
        state[State.TIME] = at.local
        return cls(where, state, np.array([at.length, at.end, request.tol]))

    def advance(self, run: Program, steps: Any, events: Any) -> int:
        """Call the kernel; returns the `Status` with which it stops."""
        return load_kernel()(self.where, self.state, self.settings, run.env, run.model, steps, events)

    @property
    def time(self) -> float:
        """The dimensionless time."""
        return float(self.where[Where.PERIOD] * self.settings[Setting.LENGTH] + self.state[State.TIME])

    @property
    def end_time(self) -> float:
        """The time at which the motion ends, unless something ends it earlier."""
        return float(self.where[Where.LAST_PERIOD] * self.settings[Setting.LENGTH] + self.settings[Setting.END])

    @property
    def position(self) -> np.ndarray:
        """The model's own coordinates."""
        return self.state[State.COORDINATES : State.COORDINATES + self.where[Where.OWN]]

    @property
    def velocity(self) -> np.ndarray:
        """Their velocities."""
        first = State.COORDINATES + self.where[Where.DOF]
        return self.state[first : first + self.where[Where.OWN]]

    @property
    def side(self) -> int:
        """+1 or -1, and 0 at rest."""
        return 0 if self.where[Where.MODE] in (Mode.REST, Mode.CHATTER) else int(self.where[Where.SIDE])

    @property
    def columns(self) -> np.ndarray:
        """The tangent's columns, (2 own coordinates, columns): the rows of the coordinates, then those of the velocities."""
        own, shape = self.where[Where.OWN], (2, 1 + self.where[Where.COLUMNS], self.where[Where.OWN])
        both = self.state[State.COORDINATES : State.COORDINATES + 2 * self.where[Where.DOF]].reshape(shape)
        columns: np.ndarray = both[:, 1:].transpose(0, 2, 1).reshape(2 * own, -1)
        return columns


def _mode_and_side(request: MotionRequest, run: Program) -> tuple[int, int]:
    model = request.system.model
    position, speed = float(request.position[0]), float(request.speeds[0])
    if model.holds_coordinates:
        return Mode.CONTACT, 0
    mode, side = side_of_state(len(model.sides), position, speed, run.model[ModelPart.GEOMETRY])
    if mode == Mode.BEYOND:
        name = model.coordinates[0]
        raise ParameterError(f"{name} = {position:g} lies beyond the contact at {name} = {float(model.contact):g}", name)
    return mode, side


def _first_state(run: Program, position: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Local time, chatter speed, coordinates and velocities, each followed by the tangent's columns, and the shifts."""
    columns = run.structure.sizes[-1]
    start = np.eye(columns, 2 * position.size)  # row j is the initial value of column j
    u, z = start[:, : position.size].ravel(), start[:, position.size :].ravel()
    return np.concatenate([[0.0, 0.0], position, u, speeds, z, np.zeros(columns)])
