"""What multipliers hold along the motions of a system, as numbers: gaps, sliding speeds, and the
forces that keep them at 0 (`taylor/multipliers.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from saltus.flow.motion.events import modes_of
from saltus.flow.motion.motion import Motion
from saltus.flow.programs.compiled import ContactRows, contact_rows_at, program
from saltus.systems import (
    System,
    inert_frictions,
    mass_and_force,
    mass_rows,
    normal_forces,
    units_of_gaps,
)

# Rows depend on one another where a singular value is this share of the largest one.
RANK = 1e-9
# Newton's method from a state to what is held: each step squares the error.
STEPS = 12
# What is carried is not determined if as large a share of it may be anything.
UNDETERMINED = 1e-5
# A contact touches at an impact if its gap is smaller than this share of the terms of its rate.
TOUCHES = 1e-10


class RowValues:
    """The rows of a system's contacts and frictions, in this order, and what they carry."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.model: Any = system.model
        self.run = program(system)
        self.length = system.load.period or 0.0
        self.count = len(self.model.contacts)
        self.size = self.count + len(self.model.frictions)
        inert = inert_frictions(system, {})
        self.has_force = np.array([k not in inert for k in range(self.size - self.count)])

    def at(self, time: float, state: np.ndarray) -> ContactRows:
        """The rows at a time and a state (d,)."""
        return contact_rows_at(self.run, time, self.length, np.ascontiguousarray(state))

    def along(self, times: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, Any]:
        """The rows (n, rows, coordinates), their rates (n, rows), and the gaps (n, contacts) at
        times (n,) and states (n, d)."""
        dof = states.shape[1] // 2
        entries = np.empty((len(times), self.size, dof))
        rates = np.empty((len(times), self.size))
        gaps = np.empty((len(times), self.count))
        for number, (time, state) in enumerate(zip(times.tolist(), states, strict=True)):
            rows = self.at(time, state)
            entries[number] = rows.entries[: self.size]
            rates[number] = rows.entries[: self.size] @ state[dof:] + rows.drifts[: self.size]
            gaps[number] = rows.gaps
        return entries, rates, gaps

    def held_in(self, side: Any) -> np.ndarray:
        """Whether each row is held in modes of the numbers `side`, (..., rows): a contact closed, or
        a friction with a force stuck."""
        bits, slides, _ = modes_of(self.model, np.asarray(side))
        closed = [bits >> i & 1 == 1 for i in range(self.count)]
        sticks = [way == 0 for way in slides]
        return np.stack([*closed, *sticks], axis=-1)

    def onto(self, time: float, state: np.ndarray, held: np.ndarray) -> np.ndarray:
        """A state taken onto the rows that are held, first its coordinates and then its velocities,
        in the metric of the mass matrix."""
        found = state.copy()
        if not held.any():
            return found
        dof = len(state) // 2
        q, v = found[:dof], found[dof:]
        contacts = np.flatnonzero(held[: self.count])
        for _ in range(STEPS if contacts.size else 0):
            rows = self.at(time, found)
            gaps = rows.gaps[contacts]
            moved = self._pushes(time, q, rows.entries[contacts]) @ gaps
            q -= moved
            if np.abs(moved).max() <= np.finfo(float).eps * np.abs(q).max():
                break
        rows = self.at(time, found)
        chosen = np.flatnonzero(held)
        pushes = self._pushes(time, q, rows.entries[chosen])
        for _ in range(2):  # the second one takes what rounding has left
            v -= pushes @ (rows.entries[chosen] @ v + rows.drifts[chosen])
        return found

    def _pushes(self, time: float, q: np.ndarray, entries: np.ndarray) -> np.ndarray:
        """M^-1 A' (A M^-1 A')^-1 of rows A, (coordinates, rows)."""
        mass = np.array(mass_rows(self.model, _of(q), time, self.system.load), dtype=float)
        columns = np.linalg.solve(mass, entries.T)
        coupling = entries @ columns
        return np.asarray(columns @ np.linalg.pinv(coupling, rcond=RANK, hermitian=True))

    def forces_along(
        self, times: np.ndarray, states: np.ndarray, accelerations: np.ndarray, side: np.ndarray
    ) -> np.ndarray:
        """What must stay positive of what is held, (n, functions), at n instants in modes `side`
        (n,): the reactions of contacts; the static limit of each friction minus, then plus what it
        carries; and the same of all that stick together. nan where it is not held, or where it is
        not determined, as of feet that stick along one line."""
        normals = self._normals(times, states)
        found = np.full((len(times), self.count + 2 * (self.size - self.count) + 2), np.nan)
        for at, mode, carried, free in self._carried(times, states, accelerations, side):
            found[at] = self._margins(mode, carried, free, normals[:, at])
        return found

    def carried_along(
        self, times: np.ndarray, states: np.ndarray, accelerations: np.ndarray, side: np.ndarray
    ) -> np.ndarray:
        """The forces along all rows, of sliding frictions too, (n, rows); 0 of what does not touch.
        Of several that are possible they have the least squares."""
        found = np.zeros((len(times), self.size))
        for at, _, carried, _ in self._carried(times, states, accelerations, side):
            found[at] = carried
        return found

    def drifts_along(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The rates of all rows at rest, (n, rows)."""
        dof = states.shape[1] // 2
        still = np.concatenate([states[:, :dof], np.zeros((len(times), dof))], axis=1)
        return self.along(times, still)[1]

    def supplied_at(self, time: float, position: np.ndarray, change: np.ndarray) -> float:
        """What contacts and frictions that touch at a time supply by moving themselves, in an impact
        that changes the velocities."""
        state = np.append(position, np.zeros_like(position))
        rows = self.at(time, state)
        length, _ = units_of_gaps(self.system)
        sizes = np.abs(rows.entries[: self.count]) @ np.abs(position) + length
        touches = np.abs(rows.gaps) <= TOUCHES * sizes
        chosen = np.flatnonzero(
            [*touches, *(True if i is None else touches[i] for i in self._pressed)]
        )
        mass = np.array(mass_rows(self.model, _of(position), time, self.system.load), dtype=float)
        impulses = np.linalg.pinv(rows.entries[chosen].T, rcond=RANK) @ (mass @ change)
        return float(-(rows.drifts[chosen] @ impulses))

    @property
    def _pressed(self) -> list[int | None]:
        """The contact that presses each friction; None of a given normal force."""
        names = [contact.name for contact in self.model.contacts]
        return [None if f.contact is None else names.index(f.contact) for f in self.model.frictions]

    def _normals(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The given normal forces, (frictions, n)."""
        q, v = np.split(states.T, 2)
        given = normal_forces(self.model, times, _of(q), _of(v), self.system.load)
        return np.array([np.broadcast_to(n, times.shape) for n in given]).reshape(
            self.size - self.count, len(times)
        )

    def _carried(
        self, times: np.ndarray, states: np.ndarray, accelerations: np.ndarray, side: np.ndarray
    ) -> Iterator[tuple[np.ndarray, int, np.ndarray, np.ndarray]]:
        """For each mode its instants, its number, the forces along the rows (m, rows), and for each
        instant what of them is not determined, (m, rows, rows)."""
        dof = states.shape[1] // 2
        q, v = np.split(states.T, 2)
        entries, rates, _ = self.along(times, states)
        mass, force = mass_and_force(self.model, times, _of(q), _of(v), self.system.load)
        lacking = np.zeros((len(times), dof))
        for i in range(dof):
            total = sum(m * accelerations[:, j] for j, m in enumerate(mass[i])) - force[i]
            lacking[:, i] = total
        normals = self._normals(times, states)
        for mode in np.unique(side).tolist():
            at = np.flatnonzero(side == mode)
            given = entries[at], rates[at], normals[:, at], lacking[at]
            yield at, mode, *self._carried_in(mode, *given)

    def _carried_in(
        self,
        mode: int,
        entries: np.ndarray,
        rates: np.ndarray,
        normals: np.ndarray,
        lacking: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The forces along the rows in a mode, from rows, rates, given normal forces, and M a -
        r."""
        held = self.held_in(mode)
        slides = modes_of(self.model, np.array(mode))[1]
        push = entries.copy()
        rest = lacking.copy()
        slips = np.zeros((len(entries), self.size))
        for k, (friction, presses) in enumerate(
            zip(self.model.frictions, self._pressed, strict=True)
        ):
            row = self.count + k
            way = int(slides[k])
            if abs(way) != 1:
                continue
            slips[:, row] = way * friction.coefficient(way * rates[:, row])
            along = slips[:, row, None] * entries[:, row]
            if presses is None:
                rest += normals[k][:, None] * along
            else:
                push[:, presses] -= along
        chosen = np.flatnonzero(held)
        columns = push[:, chosen].transpose(0, 2, 1)
        inverse = np.linalg.pinv(columns, rcond=RANK)
        carried = np.zeros((len(entries), self.size))
        carried[:, chosen] = (inverse @ rest[:, :, None])[:, :, 0]
        free = np.zeros((len(entries), self.size, self.size))
        free[:, chosen[:, None], chosen] = np.eye(len(chosen)) - inverse @ columns
        for k, presses in enumerate(self._pressed):
            row = self.count + k
            normal = normals[k] if presses is None else carried[:, presses]
            carried[:, row] -= slips[:, row] * normal
        return carried, free

    def _margins(
        self, mode: int, carried: np.ndarray, free: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """`forces_along` in one mode."""
        held = self.held_in(mode)
        unit = np.eye(self.size)
        nothing = np.zeros(self.size)
        shares = list[tuple[np.ndarray, Any]]()  # sums of what is carried, and numbers
        shares += [(unit[i] if held[i] else nothing, 0.0) for i in range(self.count)]
        together: list[Any] = [nothing, nothing, 0.0]
        for k, (friction, presses) in enumerate(
            zip(self.model.frictions, self._pressed, strict=True)
        ):
            row = self.count + k
            if not (held[row] and self.has_force[k]):
                shares += 2 * [(nothing, 0.0)]
                continue
            most = nothing if presses is None else friction.most * unit[presses]
            given = friction.most * normals[k] if presses is None else 0.0
            shares += [(most - unit[row], given), (most + unit[row], given)]
            together[0] = together[0] + most - unit[row]
            together[1] = together[1] + most + unit[row]
            together[2] = together[2] + given
        shares += [(together[0], together[2]), (together[1], together[2])]
        found = np.full((len(carried), len(shares)), np.nan)
        for place, (share, given) in enumerate(shares):
            if not share.any():
                continue
            left = np.abs(share @ free).max(axis=1, initial=0.0)
            known = left <= UNDETERMINED * np.abs(share).max()
            found[known, place] = (carried @ share + given)[known]
        return found


def closing_rates(motion: Motion) -> np.ndarray:
    """The rates at which the impacts of a motion, among its events, close each contact, (contacts,
    n)."""
    impacts = motion.impacts
    values = RowValues(motion.system)
    rates = np.zeros((values.count, len(impacts)))
    for number, time in enumerate(impacts.time.tolist()):
        position, _ = motion.at(time)
        before = np.append(np.atleast_1d(position), np.atleast_1d(impacts.velocity_before[number]))
        rows = values.at(time, before)
        speeds = rows.entries @ before[len(before) // 2 :] + rows.drifts
        rates[:, number] = speeds[: values.count]
    return rates


def _of(values: np.ndarray) -> Any:
    """Coordinates or velocities (n, ...) as a model takes them."""
    return values[0] if len(values) == 1 else tuple(values)
