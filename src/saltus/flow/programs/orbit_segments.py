"""The smooth segments of periodic orbits, followed with their derivatives: what orbits ask of the
compiled code.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from saltus.flow.contacts import (
    complementarity,
    extremes,
    held_rows,
    orbit_equations,
    propagators,
    rows,
    tangent,
)
from saltus.flow.contacts import impacts as contact_impacts
from saltus.flow.contacts import segments as contact_segments
from saltus.flow.kernel import contact_layout, layout, roots, steps
from saltus.flow.kernel.contact_layout import PartColumn, SegmentEnd, SegmentExtremes
from saltus.flow.kernel.layout import SegmentColumn, SegmentValue
from saltus.flow.kernel.memory import ContactsSegmentResults, SegmentResults, motion_record
from saltus.flow.one_contact import impacts, segments
from saltus.flow.programs.compiled import Program, kernel_text, taylor_order
from saltus.taylor import entry_point, load_module


@cache
def load_segments() -> tuple[Callable[..., int], Callable[..., None]]:
    """The functions with which periodic orbits are solved: `follow_segments` and `impact_equations`
    of `one_contact/segments.py`."""
    module = load_module("segments", kernel_text(layout, roots, steps, impacts, segments))
    return entry_point(module.follow_segments), entry_point(module.impact_equations)


@cache
def load_contact_segments() -> Callable[..., int]:
    """The function with which orbits with several contacts are solved, `follow_contact_segments` of
    `contacts/segments.py`.
    """
    parts = (
        contact_layout,
        rows,
        complementarity,
        held_rows,
        contact_impacts,
        tangent,
        extremes,
        propagators,
        contact_segments,
    )
    return entry_point(
        load_module(
            "contact_segments", kernel_text(layout, roots, steps, *parts)
        ).follow_contact_segments
    )


@cache
def load_contact_equations() -> Callable[..., None]:
    """The function that makes the equations of orbits with several contacts of their segments,
    `contact_equations` of `contacts/orbit_equations.py`.
    """
    text = kernel_text(contact_layout, orbit_equations)
    return entry_point(load_module("contact_equations", text).contact_equations)


class SegmentFollower:
    """Follows the segments of orbits of one structure at a tolerance; numbers are given with each
    call.
    """

    def __init__(self, run: Program, tol: float) -> None:
        self._run = run
        self._numbers, self._memory = motion_record(taylor_order(tol), run.structure.sizes)
        self._numbers["tolerance"] = tol
        self._at_start = bytes(self._memory)
        record = self._numbers[0]
        self.own = int(record["own"])  # degrees of freedom
        self._columns = int(record["columns"])
        self._margins = max(1, int(record["margin_count"]))

    def follow_segments(
        self, numbers: tuple[Any, Any], request: tuple[Any, ...], with_extremes: bool = False
    ) -> SegmentResults | None:
        """The smooth motions of a model with one contact along the segments of a `SegmentRequest`,
        with their extremes if asked for; None where a segment cannot be followed.

        `numbers` are those of `CompiledStructure.prepare`.
        """
        self._forget()
        n = len(request[0])
        own = self.own
        ends = np.zeros((n, SegmentValue.FIRST_STATE + 6 * own))
        columns = np.zeros((n, 4 * own, self._columns))
        extremes = np.zeros((n if with_extremes else 0, SegmentColumn.LEAST_MARGIN + self._margins))
        results = SegmentResults(ends, columns, extremes)
        return (
            None if load_segments()[0](self._numbers, *numbers, request, results) < n else results
        )

    def follow_contacts(
        self, numbers: tuple[Any, Any], request: tuple[Any, ...], with_extremes: bool = False
    ) -> ContactsSegmentResults | None:
        """The same for a model with several contacts and the segments of a
        `ContactsSegmentRequest`.
        """
        self._forget()
        held = self._run.trace.contact_coordinates
        n = len(request[0])
        own = self.own
        contacts = np.zeros((len(held), len(PartColumn)), dtype=np.int64)
        contacts[:, PartColumn.COORDINATE] = held
        ends = np.zeros((n, SegmentEnd.NUMBERS + 10 * own))
        columns = np.zeros((n, 2 * own + 1, self._columns))
        maps = np.zeros((n, 2 * own, self._columns))
        margins = len(self._run.trace.margins)
        extremes = np.zeros((n if with_extremes else 0, SegmentExtremes.MARGINS + max(1, margins)))
        results = ContactsSegmentResults(ends, columns, maps, extremes)
        return (
            None
            if load_contact_segments()(self._numbers, *numbers, contacts, request, results) < n
            else results
        )

    def _forget(self) -> None:
        """What earlier motions have left, as the largest press on a contact, changes no digit."""
        self._memory[:] = self._at_start
