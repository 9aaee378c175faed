"""The state of the kernel for several contacts: the state of one motion, and a row of facts about each contact and friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.errors import ParameterError
from saltus.flow.contacts.layout import ContactColumn, FrictionColumn
from saltus.flow.kernel.compiled import load_contacts_kernel
from saltus.flow.kernel.structures import Program
from saltus.flow.motion.request import MotionRequest
from saltus.flow.one_contact.state import KernelState


@dataclass(frozen=True, eq=False)
class ContactState(KernelState):
    """What the kernel changes; the `rows` are in the columns of `ContactColumn`, then of `FrictionColumn`."""

    @classmethod
    def at_start(cls, request: MotionRequest, run: Program) -> ContactState:
        """The state in which a motion starts. The kernel first decides which contacts at rest at their positions stay closed.

        Raises
        ------
        ParameterError
            The state lies beyond a contact, or moves into a contact that it is at.
        """
        start = super().at_start(request, run)
        names, position, speeds = request.system.model.coordinates, request.position, request.speeds
        held, rubbed = run.trace.contact_coordinates, run.trace.friction_coordinates
        contacts = np.zeros((len(held) + len(rubbed), len(ContactColumn)), dtype=np.int64)
        contacts[:, ContactColumn.COORDINATE] = held + rubbed
        for row, contact in zip(contacts[: len(held)], request.system.model.contacts, strict=True):
            place = names.index(contact.coordinate)
            gap, rate = contact.gap(float(position[place])), contact.sign * float(speeds[place])
            if gap < 0.0 or (gap == 0.0 and rate < 0.0):
                where = f"{contact.coordinate} = {position[place]:g}"
                what = f"lies beyond the contact {contact.name!r}" if gap < 0.0 else f"moves into the contact {contact.name!r}"
                raise ParameterError(f"{where} {what} at {contact.coordinate} = {float(contact.position):g}", contact.coordinate)
            row[ContactColumn.CLOSED] = int(gap == 0.0 and rate == 0.0)
            row[ContactColumn.SKIP] = int(gap == 0.0)
            if gap == 0.0:
                start.state[place] = float(contact.position)
        for row, friction in zip(contacts[len(held) :], request.system.model.frictions, strict=True):
            rate = float(speeds[names.index(friction.coordinate)]) - float(friction.ground_speed)
            row[FrictionColumn.SLIDES] = int(np.sign(rate))
        start.numbers["leave_by"] = 1  # no release is recorded at the start
        return cls(start.array, start.state, contacts)

    def _kernel(self) -> Callable[..., int]:
        return load_contacts_kernel()

    @property
    def side(self) -> int:
        """1 plus the bits that `modes_of` reads: the closed contacts, and the directions in which frictions slide."""
        return int(self.numbers["side"])
