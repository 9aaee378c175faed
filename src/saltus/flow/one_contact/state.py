"""The state of the scalar kernel for one motion: its arrays, from the start of the motion to its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from saltus.errors import ParameterError
from saltus.flow.contacts.layout import ContactColumn
from saltus.flow.kernel.compiled import load_kernel
from saltus.flow.kernel.layout import Mode
from saltus.flow.kernel.memory import EventBuffers, StepBuffers, motion_record
from saltus.flow.kernel.structures import Program, taylor_order
from saltus.flow.motion.request import MotionRequest
from saltus.flow.one_contact.sides import side_of_state


@dataclass(frozen=True, eq=False)
class KernelState:
    """What the kernel changes: the numbers of a motion, and its state."""

    array: np.ndarray  # one record MOTION
    state: np.ndarray  # coordinates and velocities, each followed by the tangent's columns, and the shifts
    rows: np.ndarray = field(default_factory=lambda: np.zeros((0, len(ContactColumn)), dtype=np.int64))  # of several contacts

    @property
    def numbers(self) -> Any:
        """The numbers of the motion, by the names of MOTION."""
        return self.array[0]

    @classmethod
    def at_start(cls, request: MotionRequest, run: Program) -> Self:
        """The state in which a motion starts.

        Raises
        ------
        ParameterError
            The state lies beyond the contact, or the model's gap or reset is impossible.
        """
        array, at = motion_record(taylor_order(request.tol), run.structure.sizes), request.clock
        now = array[0]
        now["period"], now["last_period"] = int(at.first), int(at.last)
        now["time"], now["end"], now["period_length"], now["tolerance"] = at.local, at.end, at.length, request.tol
        now["piece"] = np.searchsorted(run.env[2], request.time, side="right")
        now["leave_by"] = request.side or 0
        now["dense"] = int(request.dense or request.sample_times is not None)
        now["mode"], now["side"] = _mode_and_side(request, run)
        return cls(array, _first_state(run, request.position, request.speeds))

    def advance(self, run: Program, steps: StepBuffers, events: EventBuffers) -> int:
        """Call the kernel; returns the `Status` with which it stops."""
        return self._kernel()(self.array, self.state, run.env, run.model, self.rows, (steps, events))

    def _kernel(self) -> Callable[..., int]:
        return load_kernel()

    @property
    def time(self) -> float:
        """The dimensionless time."""
        return float(self.numbers["period"] * self.numbers["period_length"] + self.numbers["time"])

    @property
    def end_time(self) -> float:
        """The time at which the motion ends, unless something ends it earlier."""
        return float(self.numbers["last_period"] * self.numbers["period_length"] + self.numbers["end"])

    @property
    def position(self) -> np.ndarray:
        """The model's own coordinates."""
        return self.state[: self.numbers["own"]]

    @property
    def velocity(self) -> np.ndarray:
        """Their velocities."""
        return self.state[self.numbers["dof"] : self.numbers["dof"] + self.numbers["own"]]

    @property
    def side(self) -> int:
        """+1 or -1, and 0 at rest."""
        return 0 if self.numbers["mode"] in (Mode.REST, Mode.CHATTER) else int(self.numbers["side"])

    @property
    def columns(self) -> np.ndarray:
        """The tangent's columns, (2 own coordinates, columns): the rows of the coordinates, then those of the velocities."""
        own, shape = self.numbers["own"], (2, 1 + self.numbers["columns"], self.numbers["own"])
        both = self.state[: 2 * self.numbers["dof"]].reshape(shape)
        columns: np.ndarray = both[:, 1:].transpose(0, 2, 1).reshape(2 * own, -1)
        return columns


def _mode_and_side(request: MotionRequest, run: Program) -> tuple[int, int]:
    model = request.system.model
    position, speed = float(request.position[0]), float(request.speeds[0])
    if model.holds_coordinates:
        return Mode.CONTACT, 0
    mode, side = side_of_state(len(model.sides), position, speed, run.model.geometry)
    if mode == Mode.BEYOND:
        name = model.coordinates[0]
        raise ParameterError(f"{name} = {position:g} lies beyond the contact at {name} = {float(model.contact):g}", name)
    return mode, side


def _first_state(run: Program, position: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Coordinates and velocities, each followed by the tangent's columns, and the shifts."""
    columns = run.structure.sizes[-1]
    start = np.eye(columns, 2 * position.size)  # row j is the initial value of column j
    u, z = start[:, : position.size].ravel(), start[:, position.size :].ravel()
    return np.concatenate([position, u, speeds, z, np.zeros(columns)])
