"""A motion's code and memory for another processor: what the page in a browser is made of.

The kernels are those of this machine, from the same source; a structure's functions are the same
texts. Their memory is described by tables that are made from the types with which they are
compiled, so that nobody writes down twice where a number is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any

import numpy as np

from saltus.checks import LIMITS
from saltus.errors import SaltusError
from saltus.flow.kernel import memory
from saltus.flow.kernel.contact_layout import NoPress, PartColumn, PartKind
from saltus.flow.kernel.layout import EventCode, Geometry, Mode, Status
from saltus.flow.kernel.memory import ADVANCE, ADVANCE_CONTACTS, MOTION, SIZES, behind_parameters
from saltus.flow.motion.events import EventKind, Stop
from saltus.flow.motion.kernel_state import natural_times
from saltus.flow.motion.simulate import refusal
from saltus.flow.programs.compiled import (
    HERE,
    LEAVES,
    MOST_COEFFICIENTS,
    contacts_text,
    one_contact_text,
    program,
    structure_functions,
)
from saltus.systems import System, Transient, children, substitute, where_inert
from saltus.taylor import (
    RECORD_WIDTH,
    Case,
    Expr,
    Places,
    SeriesOf,
    Trace,
    WrittenFunction,
    combine,
    record_table,
    tape,
    trace,
)
from saltus.taylor import substitute as substitute_leaves
from saltus.taylor.load_tables import AFTER, SINCE, WITHIN
from saltus.taylor.vectors import SCALAR

ENUMERATIONS = (Mode, Status, EventCode, Geometry, PartKind, PartColumn)
ENV = ("parameters", "constants", "breaks", "table")


@dataclass(frozen=True)
class PortableKernel:
    """A kernel for another processor: that for models with several contacts or frictions, or that
    for at most one contact.
    """

    several: bool

    @property
    def source(self) -> str:
        """The source, with its function `advance`."""
        return contacts_text() if self.several else one_contact_text()

    @property
    def arguments(self) -> list[dict[str, Any]]:
        """The arguments of `advance` one after the other: their names, "array", "record" or
        "function", and the dimensions.
        """
        names = ("numbers", "state", "env", "functions", "rows", "buffers")
        kinds = (ADVANCE_CONTACTS if self.several else ADVANCE).args
        return [
            leaf for name, kind in zip(names, kinds, strict=True) for leaf in _leaves(name, kind)
        ]


def _leaves(name: str, kind: Any) -> list[dict[str, Any]]:
    if hasattr(kind, "ndim"):
        record = hasattr(kind.dtype, "fields")
        made = {"name": name, "kind": "record" if record else "array", "dimensions": kind.ndim}
        return [
            made | {"whole": str(kind.dtype) == "int64", "size": kind.dtype.size if record else 8}
        ]
    if not hasattr(kind, "types"):
        return [{"name": name, "kind": "function", "dimensions": 0}]
    fields = getattr(kind, "fields", ENV if name == "env" else ("steps", "events"))
    return [
        leaf
        for field, each in zip(fields, kind.types, strict=True)
        for leaf in _leaves(field, each)
    ]


def part_at(system: Any, path: str) -> Any:
    """The part of a system, or of its copy with symbols, at a dotted path."""
    for name in path.split("."):
        system = children(system)[name]
    return system


class PortableMotion:
    """What another processor needs to follow the motions of a system, with any numbers."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.run = program(system)
        self.kernel = PortableKernel(self.run.trace.several)

        once = {path: part_at(system, path) for path, _ in self._evaluated[0].records}
        self._pulses = [path for path, signal in once.items() if isinstance(signal, Transient)]

    def functions(self) -> list[WrittenFunction]:
        """The functions of the structure, which the kernel calls, and `edges`, when each pulse of
        the load begins and ends, and its length.

        The length is no rounded difference of both: a short pulse would lose digits.
        """
        pulses = [part_at(self._twin, path) for path in self._pulses]
        edges = edges_function([t for p in pulses for t in (p.start, p.start + p.length, p.length)])
        drawn = [values_function("drawing", self._drawn[1])] if self._drawn[1] else []
        return [
            *structure_functions(self.run.trace),
            edges,
            margins_function(*self._evaluated[:2]),
            *drawn,
        ]

    @cached_property
    def _twin(self) -> Any:
        """The system with symbols in the places of its numbers."""
        places = count()
        return substitute(self.system, lambda path, value: Expr("parameter", (), next(places)))

    @cached_property
    def _drawn(self) -> tuple[list[dict[str, Any]], list[Expr]]:
        """The shapes of the model's own drawing, and their points and radii as expressions of the
        coordinates and the numbers.

        Nothing of a model without one, or with one that cannot be traced, as it compares or needs
        plain numbers.
        """
        draw: Any = getattr(self._twin.model, "drawing", None)
        if draw is None:
            return [], []
        place = np.array(
            [Expr("coordinate", (), i) for i in range(self.run.trace.dof)], dtype=object
        )
        try:
            shapes = [
                (shape, np.asarray(shape.points, dtype=object).reshape(-1, 2))
                for shape in draw(place)
            ]
        except (SaltusError, ArithmeticError, AttributeError, TypeError, ValueError):
            return [], []
        parts = [
            {"kind": shape.kind, "role": shape.role, "points": len(points)}
            for shape, points in shapes
        ]
        values = [value for shape, points in shapes for value in (*points.ravel(), shape.radius)]
        return parts, [combine("add", value, 0.0) for value in values]

    @cached_property
    def _evaluated(self) -> tuple[Trace, tuple[str, ...], bool]:
        """A trace with what a page can compute along motions, its names, and whether the last of
        them is the kinetic energy.
        """
        names = self.system.model.margin_names(self.system.load)
        for chosen, energy in ((names, True), (names, False), ((), True)):
            try:
                traced = trace(self.system, chosen, energy=energy)
            except SaltusError:  # margins may compare, which only Python's own check of a motion can; and not all have an energy
                continue
            # the kernel finds its own rows
            if traced.records[: len(self.run.trace.records)] == self.run.trace.records:
                return traced, tuple(traced.margins), energy
        return self.run.trace, (), False

    def layout(self) -> dict[str, Any]:
        """Where all numbers are in memory, and what those of the kernel mean."""
        trace = self.run.trace
        structure = self.run.structure
        before = len(trace.mass) + len(trace.restitution)
        places = {
            name: [field[1], bool(np.issubdtype(field[0], np.integer))]
            for name, field in (MOTION.fields or {}).items()
        }
        return {
            **{
                kind.__name__: {member.name: int(member) for member in kind}
                for kind in ENUMERATIONS
            },
            "record": places,
            "record_size": MOTION.itemsize,
            "most_size": LIMITS.value,
            "natural": natural_times(self.system),
            "most_order": MOST_COEFFICIENTS - 2,
            "arguments": self.kernel.arguments,
            "several": trace.several,
            "sizes": dict(zip(SIZES, map(int, structure.sizes), strict=True)),
            "constant_count": structure.constant_count + len(self.run.data),
            "data": self.run.data.tolist(),
            "modes": (
                behind_parameters(structure.frictions, structure.flags) if trace.several else []
            ),
            "signs": list(trace.signs),
            "contact_coordinates": list(trace.contact_coordinates),
            "friction_coordinates": list(trace.places),
            "where_inert": where_inert(self.system),
            "inert": int(NoPress.INERT),
            "positions_at": before,
            "grounds_at": before + len(trace.signs),
            "contact_numbers": len(trace.contact_numbers),
            "limits": list(self.run.limits),
            "records": self._records(),
            "margins": list(self._evaluated[1]),
            "energy": self._evaluated[2],
            "drawing": self._drawn[0],
            "event_kinds": [str(kind) for kind in EventKind],
            "refusals": {
                int(status): text
                for status in Status
                if (text := refusal(self.system, status, "{time}", "{velocity}"))
            },
            "stops": self._stops(),
            "stop_meanings": {str(stop): stop.meaning for stop in Stop},
        }

    def _records(self) -> dict[str, Any]:
        """What the load reads of tables: of a pulse, which clock it is; of a record, its own
        breakpoints and polynomials.
        """
        rows: list[dict[str, Any]] = []
        for path, order in self._evaluated[0].records:
            if path in self._pulses:
                rows.append({"pulse": self._pulses.index(path), "order": order})
            else:
                breaks, table = record_table(self.system, [(path, order)])
                rows.append({"breaks": breaks.tolist(), "table": table[0].tolist()})
        # all that the breakpoints of the rows may be together
        own = {tuple(row["breaks"]) for row in rows if "breaks" in row}
        most = 2 * len(self._pulses) + sum(map(len, own))
        clocks = {"since": SINCE, "within": WITHIN, "after": AFTER}
        return {
            "rows": rows,
            "pulses": len(self._pulses),
            "most": most,
            "width": RECORD_WIDTH,
            **clocks,
        }

    def _stops(self) -> dict[int, str]:
        """The name of the end of a motion for each reason that the kernel gives."""
        known = {str(stop) for stop in Stop}
        found = {
            int(status): status.name.lower() for status in Status if status.name.lower() in known
        }
        if self.system.model.singularity:
            found[Status.STALLED] = str(Stop.SINGULAR)
        return found | {int(Status.LIMITED): str(Stop.LIMIT)}

    def parts(self) -> dict[str, list[dict[str, Any]]]:
        """The contacts and frictions of the model, by their names."""
        model = self.system.model
        return {
            "contacts": [
                {"name": c.name, "coordinate": c.coordinate, "sign": c.sign} for c in model.contacts
            ],
            "frictions": [{"name": f.name, "coordinate": f.coordinate} for f in model.frictions],
            "sides": [{"side": side} for side in model.sides],
        }


def numbers_read(functions: Sequence[WrittenFunction]) -> set[int]:
    """The places of the numbers that functions of a structure read, among those of its system.

    A number that none of them reads has no effect, whatever its value.
    """
    tapes = [
        tape
        for function in functions
        for tape in (
            [function.content.tape]
            if isinstance(function.content, SeriesOf)
            else [case.tape for case in function.content]
        )
    ]
    return {node[1] for each in tapes for node in each.nodes if node[0] == "parameter"}


def edges_function(roots: Sequence[Expr]) -> WrittenFunction:
    """The function `edges(parameters, out)`, which fills an array with the values of expressions of
    the parameters.
    """
    return WrittenFunction(
        "edges",
        memory.CONSTANTS,
        Places(("parameters", "out"), {"parameter": ("parameters", 0)}),
        SCALAR,
        [Case(tape(roots, {}), [("out", i) for i in range(len(roots))])],
    )


def margins_function(traced: Trace, names: Sequence[str]) -> WrittenFunction:
    """The function `margins` of a trace that stops at these: their values at a state, with
    velocities and accelerations behind the coordinates."""
    rates = [
        (op, k, i) for k, op in ((1, "velocity"), (2, "acceleration")) for i in range(traced.dof)
    ]
    behind = {Expr(op, (), i): Expr("coordinate", (), k * traced.dof + i) for op, k, i in rates}
    return values_function(
        "margins", [substitute_leaves(traced.margins[name], behind) for name in names]
    )


def values_function(name: str, roots: list[Expr]) -> WrittenFunction:
    """A function of the state that fills its last argument with the values of expressions."""
    places = Places(("t", "origin", "side", "env", "piece", "state", "out"), LEAVES | HERE)
    cases = [Case(tape(roots, {}), [("out", i) for i in range(len(roots))])]
    return WrittenFunction(name, getattr(memory, name.upper()), places, SCALAR, cases)
