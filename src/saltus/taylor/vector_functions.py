"""From a trace to a structure's three functions for lanes, LLVM's instructions for all lanes (compare `scalar_source.py`).

They are written directly: it takes a second, as numba sees three calls only. A trace reaches the generated file as tapes: lists
of nodes, operands before what uses them, each (operation, operands or value). The Taylor series are in `series.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numba import types
from numba.extending import intrinsic

from saltus.taylor.derivatives import saltation
from saltus.taylor.graph import Expr, substitute
from saltus.taylor.memory_layout import FIRST_PART, SERIES_LENGTH, LaneSlot
from saltus.taylor.rules import RULES
from saltus.taylor.scalar_source import Emitter
from saltus.taylor.series import Series
from saltus.taylor.tracing import RECORD_WIDTH, Trace
from saltus.taylor.vector_code import Tape, Writer
from saltus.taylor.vectors import CACHE_LINE


@dataclass(frozen=True)
class Slots:
    """Where everything lies in the memory of a group of lanes, in slots of one vector (see `layout.py`)."""

    rows: int  # coordinates, those of the sensitivities included
    own: int  # the model's
    parameters: int
    constants: int
    records: int
    stops: int

    @property
    def places(self) -> dict[str, int]:
        """The first slot of each part, and the `end` of them all."""
        sizes = {
            "position": self.rows,
            "velocity": self.rows,
            "new_position": self.rows,
            "new_velocity": self.rows,
            "after_position": self.rows,
            "after_velocity": self.rows,
            "ended_position": self.rows,
            "ended_velocity": self.rows,
            "parameters": self.parameters,
            "constants": self.constants,
            "records": self.records * RECORD_WIDTH,
            "position_series": self.rows * SERIES_LENGTH,
            "velocity_series": self.rows * SERIES_LENGTH,
            "acceleration_series": self.own * SERIES_LENGTH,
            "margin_series": self.stops * SERIES_LENGTH,
        }
        places, slot = {}, FIRST_PART
        for name, size in sizes.items():
            places[name], slot = slot, slot + size
        return {**places, "end": slot}


# --- tapes -----------------------------------------------------------------------------------------------------------------


def tape(roots: Sequence[Expr], constants: dict[Expr, int]) -> tuple[Tape, list[int]]:
    """The nodes below the roots as a tape, and the places of the roots on it; what `constants` knows is not opened."""
    listed: Tape = []
    place: dict[int, int] = {}

    def visit(root: Expr) -> None:
        stack = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if id(node) in place:
                continue
            if node in constants:
                entry: tuple[Any, ...] = ("constant", constants[node])
            elif not node.args:
                entry = (node.op,) if node.value is None else (node.op, node.value)
            elif ready:
                entry = (node.op, *(place[id(a)] for a in node.args))
            else:
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args))
                continue
            place[id(node)] = len(listed)
            listed.append(entry)

    for root in roots:
        visit(root)
    return listed, [place[id(root)] for root in roots]


def source(trace: Trace, emitter: Emitter) -> str:
    """The functions of a structure for lanes; `emitter` has written its scalar ones and knows its constants."""
    rows = len(trace.acceleration)
    pulls = {Expr("acceleration", (), i): a for i, a in enumerate(trace.acceleration[: trace.dof])}
    margins = [substitute(margin, pulls) for margin in trace.margins.values()]
    slots = Slots(
        rows, trace.dof, max(1, len(trace.parameters)), max(1, len(emitter.constants)), len(trace.records), len(margins)
    )
    impact = [] if trace.next_side is None else [trace.next_side, *impact_roots(trace)]
    series = tape([*trace.acceleration, *margins], emitter.constants)
    reset = tape(impact, emitter.constants)
    acceleration = tape(trace.acceleration, emitter.constants)
    lines = [
        f"SLOTS = Slots{(slots.rows, slots.own, slots.parameters, slots.constants, slots.records, slots.stops)!r}",
        *(f"{name} = {_listing(*listed)}" for name, listed in (("SERIES", series), ("IMPACT", reset), ("FIELD", acceleration))),
        "_series, _impact, _field = write_series(SLOTS, *SERIES), write_impact(SLOTS, *IMPACT), write_field(SLOTS, *FIELD)",
    ]
    for name, arguments in (("series", "m, order"), ("impact", "m"), ("field", "m")):
        lines += ["", "", f"@pointed_jit(LANE_{name.upper()})", f"def lane_{name}({arguments}):", f"    _{name}({arguments})"]
    return "\n".join([*lines, ""])


def impact_roots(trace: Trace) -> list[Expr]:
    """Positions and velocities after an impact in terms of those before it, with those of the tangent's columns."""
    assert trace.contact is not None
    assert trace.velocity_after is not None
    if not trace.columns:
        return [trace.contact, trace.velocity_after]
    jumps = saltation(trace)
    return [trace.contact, *jumps.coordinate, trace.velocity_after, *jumps.velocity]


def _listing(nodes: Tape, roots: list[int]) -> str:
    body = "".join(f"    {node!r},\n".replace("nan", "float('nan')") for node in nodes)
    return f"([\n{body}], {roots!r})"


# --- the three functions ------------------------------------------------------------------------------------------------------


def write_series(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_series(m, order)`: the series of positions and velocities from the state, and of the margins.

    Coefficients 0..order of positions and velocities, 0..order - 1 of the accelerations and margins; an even order from
    LOWEST_ORDER to HIGHEST_ORDER.
    """

    @intrinsic
    def series(typing: Any, m: Any, order: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            _align_stack(builder.function)
            _write_orders(Series(slots, context, builder, signature.args[0], args[0]), slots, nodes, roots, args[1])
            return context.get_dummy_value()

        return types.void(m, types.int64), code

    return series


def _align_stack(function: Any) -> None:
    """Have the coefficients that find no register lie in one line of the cache each, or every use would touch two.

    LLVM aligns the stack by itself for variables, but not for what it finds too late to be more than the registers hold. A
    function taken into its caller would lose the attribute.
    """
    function.attributes.alignstack = CACHE_LINE
    function.attributes.add("noinline")


def _write_orders(w: Series, slots: Slots, nodes: Tape, roots: list[int], order: Any) -> None:
    w.read(nodes, RULES)
    for name in ("position", "velocity"):
        for row in range(slots.rows):
            w.store(w.at[f"{name}_series"] + row * SERIES_LENGTH, w.load(w.at[name] + row))
    pulls = [w.rows[root] for root in roots[: slots.rows]]
    accelerations = [w.pointer(w.at["acceleration_series"] + row * SERIES_LENGTH) for row in range(slots.own)]
    margins = [w.pointer(w.at["margin_series"] + row * SERIES_LENGTH) for row in range(slots.stops)]
    for _ in w.each_order(order):
        w.advance()
        for position, velocity, pull in zip(w.positions, w.velocities, pulls, strict=True):
            w.integrate(position, w.now(velocity))
            w.integrate(velocity, w.now(pull))
        for place, pull in zip(accelerations, pulls, strict=False):
            w.write(place, w.now(pull))
        for place, root in zip(margins, roots[slots.rows :], strict=True):
            w.write(place, w.now(w.rows[root]))


def write_impact(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_impact(m)`: the side, positions and velocities after an impact at the new state."""
    places = slots.places
    targets = [
        LaneSlot.NEW_SIDE,
        *range(places["after_position"], places["after_position"] + slots.rows),
        *range(places["after_velocity"], places["after_velocity"] + slots.rows),
    ]
    return _write_instant(slots, nodes, list(zip(targets, roots, strict=False)))


def write_field(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_field(m)`: the accelerations at the new state, put where velocities after an impact would be."""
    first = slots.places["after_velocity"]
    return _write_instant(slots, nodes, [(first + row, root) for row, root in enumerate(roots)])


def _write_instant(slots: Slots, nodes: Tape, stores: list[tuple[int, int]]) -> Any:
    @intrinsic
    def instant(typing: Any, m: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            w = Writer(slots, context, builder, signature.args[0], args[0], fused=False)
            values = w.instant(nodes)
            for slot, root in stores:
                w.store(slot, values[root])
            return context.get_dummy_value()

        return types.void(m), code

    return instant
