"""The compiled code with which one motion is followed: a kernel for each kind of model, and the
functions of each structure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from types import ModuleType
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from saltus.checks import check_names
from saltus.flow.contacts import (
    beside_powers,
    closings,
    complementarity,
    frictions,
    functions,
    held_rows,
    part_events,
    parts,
    propagators,
    resets,
    rows,
    rubbing,
    surfaces,
    tangent,
)
from saltus.flow.contacts import impacts as contact_impacts
from saltus.flow.contacts import kernel as contacts_kernel
from saltus.flow.contacts.one_free import OneFree, equations_of_one_free
from saltus.flow.kernel import contact_layout, event_derivatives, layout, memory, roots, steps
from saltus.flow.kernel.memory import (
    INSTANT,
    ContactsFunctions,
    OneContactFunctions,
    behind_parameters,
)
from saltus.flow.one_contact import impacts, kernel
from saltus.flow.programs import loop
from saltus.systems import System
from saltus.taylor import (
    Case,
    Expr,
    Places,
    Pointer,
    Rows,
    SeriesOf,
    Trace,
    WrittenFunction,
    compiled_part,
    digest,
    entry_point,
    is_steep,
    load_functions,
    load_module,
    number,
    record_table,
    shared_constants,
    source_of,
    structure_key,
    substitute,
    tape,
    trace,
)
from saltus.taylor.vectors import SCALAR

# length of a series at the tightest tolerance: order 21, hence 23 coefficients, rounded up to pairs
MOST_COEFFICIENTS = 24
KERNEL_HEADER = f"""import math

import numpy as np

from saltus.flow.kernel.memory import *
from saltus.taylor.numba_types import by_reference
from saltus.taylor.private_numba import cached_jit, inline_jit, jit, lean_jit
# types of {digest(source_of(memory))}
"""
ENV = {"parameter": ("parameters", 0), "constant": ("constants", 0), "record": ("table", 0)}
LEAVES = ENV | {"time": ("t", 0), "origin": ("origin", 0), "side": ("side", 0)}
HERE = {"coordinate": ("state", 0)}  # in the kernel's state


class Sizes(NamedTuple):
    """The sizes of a structure, in the order of the kernel's `STRUCTURE_SIZES`."""

    dof: int  # coordinates, with the tangent's
    stops: int  # margins
    rows: int  # of the workspace
    sides: int
    steep: int  # whether steps are checked
    first_order: int  # how many of the model's own coordinates, the last ones, are of first order
    own: int  # the model's own coordinates
    columns: int  # of the tangent
    # the first of its own coordinates, on which impacts act; those behind them have mass 1
    local: int
    repeats: int  # whether the load's breakpoints return in each forcing period
    corner_column: int  # 1 plus the column along the frequency that moves them, or 0
    contact_numbers: int  # that events at contacts need
    multipliers: int  # rows of contacts, frictions and surfaces that multipliers hold; or 0
    fixed_rows: int  # whether these do not change with the time at a fixed state


@dataclass(frozen=True)
class CompiledStructure:
    """The compiled functions of a traced structure, and its sizes."""

    sizes: Sizes
    constant_count: int
    # The functions that the kernel calls, in the order of `OneContactFunctions` or, with several
    # contacts, `ContactsFunctions`.
    functions: tuple[Pointer, ...]
    # `constants` and `geometry` (with several contacts `matrices`), which the lanes' driver calls
    tables: tuple[Pointer, ...]
    several: bool
    signs: tuple[int, ...] = ()  # of the contacts, if there are several
    frictions: int = 0

    @property
    def flags(self) -> int:
        """How many numbers say what is free: of coordinates, or of rows of multipliers."""
        return self.sizes.multipliers or self.sizes.local

    def prepare(
        self,
        parameters: np.ndarray,
        records: tuple[np.ndarray, np.ndarray],
        data: Any = (),
        eigenmodes: Any = (),
    ) -> tuple[tuple[Any, ...], Any]:
        """The arguments `env` and `model` of the kernel for given numbers (see
        `one_contact/kernel.py`). Those of modes, `data`, follow the constants."""
        constants = np.zeros(self.constant_count)
        if len(data):
            constants = np.append(constants, data)
        geometry = np.zeros(3)
        fill_constants, fill_geometry, _ = load_fillers()
        fill_constants(self.tables[0], parameters, constants)
        if self.several:
            env = (
                np.append(parameters, behind_parameters(self.frictions, self.flags)),
                constants,
                *records,
            )
            return env, ContactsFunctions._make(
                (*self.functions, np.array(self.signs, float), np.array(eigenmodes, float))
            )
        env = (parameters, constants, *records)
        fill_geometry(self.tables[1], env, geometry)
        return env, OneContactFunctions._make((*self.functions[:4], geometry, self.functions[4]))


_FILLERS = """
from numba import types
from saltus.taylor.numba_types import written_type


@cached_jit(types.void(written_type(CONSTANTS), *CONSTANTS.args))
def fill_constants(function, parameters, constants):
    function(parameters, constants)


@cached_jit(types.void(written_type(GEOMETRY), *GEOMETRY.args))
def fill_geometry(function, env, geometry):
    function(env, geometry)


@cached_jit(types.void(written_type(MATRICES), *MATRICES.args))
def fill_matrices(function, env, piece, state, numbers):
    function(env, piece, state, numbers)
"""


@cache
def load_fillers() -> tuple[Callable[..., None], ...]:
    """Functions that call a structure's `constants`, `geometry` and `matrices` with arrays."""
    module = load_module("fillers", KERNEL_HEADER + _FILLERS)
    functions = module.fill_constants, module.fill_geometry, module.fill_matrices
    return tuple(map(entry_point, functions))


# The files of which the kernels are made, in the order of their text.
ONE_CONTACT_PARTS = (layout, roots, steps, impacts, kernel, loop)
CONTACTS_PARTS = (
    layout,
    roots,
    steps,
    contact_layout,
    rows,
    complementarity,
    held_rows,
    contact_impacts,
    tangent,
    propagators,
    parts,
    rubbing,
    frictions,
    surfaces,
    beside_powers,
    functions,
    part_events,
    closings,
    resets,
    contacts_kernel,
    loop,
)


@cache
def load_kernel() -> Callable[..., int]:
    """The kernel of models with at most one contact, `advance` of `programs/loop.py`, called without
    numba's dispatch on types.
    """
    return entry_point(kernel_module().advance)


def kernel_module() -> ModuleType:
    """The module of the scalar kernel."""
    return load_module("kernel", one_contact_text())


def one_contact_text() -> str:
    """The source of the kernel of models with at most one contact."""
    return kernel_text(*ONE_CONTACT_PARTS)


@cache
def load_contacts_kernel() -> Callable[..., int]:
    """The kernel for models with several contacts, `advance` with the functions of
    `contacts/kernel.py`.
    """
    return entry_point(contacts_module().advance)


def contacts_module() -> ModuleType:
    """The module of the scalar kernel for models with several contacts."""
    return load_module("contacts", contacts_text())


def contacts_text() -> str:
    """The source of the kernel of models with several contacts."""
    return kernel_text(*CONTACTS_PARTS).replace("(ADVANCE)", "(ADVANCE_CONTACTS)")


def kernel_text(*modules: ModuleType) -> str:
    """One source of the compiled parts of several files."""
    return KERNEL_HEADER + "".join(compiled_part(module) for module in modules)


def load_structure(trace: Trace) -> CompiledStructure:
    """The functions of a trace's structure."""
    made = load_functions("structure", structure_functions(trace), trace)
    one = ("series", "contact_series", "reset", "contact_damping", "tangent")
    names = ContactsFunctions._fields[: len(one)] if trace.several else one
    stops = len(trace.reactions) + len(trace.margins)
    steep = int(is_steep(trace.acceleration))
    first = len(trace.acceleration), stops, 1, trace.side_count, steep, trace.first_order
    return CompiledStructure(
        Sizes(
            *first,
            trace.dof,
            trace.columns,
            trace.local,
            int(trace.repeats),
            trace.corner_column,
            len(trace.contact_numbers),
            trace.multipliers,
            int(trace.has_fixed_rows),
        ),
        max(1, len(constants(trace))),
        tuple(made[name] for name in names),
        (made["constants"], made["matrices" if trace.several else "geometry"]),
        trace.several,
        trace.signs,
        len(trace.sided),
    )


# --- the functions of a structure --------------------------------------------


def structure_functions(trace: Trace) -> list[WrittenFunction]:
    """A structure's functions; equal structures have equal functions, whatever their numbers."""
    known = constants(trace)
    impact = [x for x in (trace.next_side, trace.velocity_after) if x is not None] or [
        number(0.0)
    ] * 2
    damping = [number(0.0) if trace.contact_damping is None else trace.contact_damping]
    instant = ("side", "env", "piece")
    functions = [
        _series(trace, known),
        _table("constants", Places(("parameters", "constants"), ENV), list(known), {}),
    ]
    if trace.several:
        events = _matrices(trace, known), _matrix_slopes(trace, known), _tangent(trace, known)
        return [*functions, *events, _in_time("load_series", _loads(trace), known)]
    return [
        *functions,
        _in_time(
            "contact_series",
            {} if trace.contact_acceleration is None else {0: trace.contact_acceleration},
            known,
        ),
        _at_impact("reset", ("t", "origin", "v0", *instant), impact, known),
        _at_impact("contact_damping", ("t", "origin", *instant), damping, known),
        _tangent(trace, known),
        _table("geometry", Places(("env", "out"), ENV), _geometry(trace), known),
    ]


def _loads(trace: Trace) -> dict[int, Expr]:
    """The channels of a structure's load and, for each parameter of the tangent's columns, their
    derivatives to it, by the places of their series.
    """
    if trace.modes is None:
        return {}
    channels = trace.modes.channels
    found = dict[int, Expr]()
    for each in trace.modes.inputs:
        if each.local:
            continue
        place = each.place - 1 - trace.local
        found[MOST_COEFFICIENTS * place] = each.of
        for p in range(trace.columns and len(trace.paths)):
            slope = trace.partial_derivative(each.of, 2 * trace.dof + p)
            if slope is not number(0.0):
                found[MOST_COEFFICIENTS * (channels * (1 + p) + place)] = slope
    return found


def _function(name: str, places: Places, content: Sequence[Any]) -> WrittenFunction:
    """A function of one motion; its signature has its name in `memory.py`. It has no places of what
    it does not read in a state."""
    if not isinstance(content, SeriesOf):
        read = {op for case in content for op in case.leaves}
        leaves = {
            op: place for op, place in places.leaves.items() if op in read or place[0] != "state"
        }
        places = replace(places, leaves=leaves)
    return WrittenFunction(name, getattr(memory, name.upper()), places, SCALAR, content)


def constants(trace: Trace) -> dict[Expr, int]:
    """The table of constants: the parts of a structure's expressions that depend on parameters
    alone, with their places.
    """
    roots = [
        *trace.acceleration,
        *motion_roots(trace),
        *_geometry(trace),
        *trace.contact_numbers,
        *trace.inputs_of_loops,
    ]
    rest = (
        trace.contact_acceleration,
        trace.next_side,
        trace.velocity_after,
        trace.contact_damping,
    )
    roots += [x for x in rest if x is not None]
    roots += [x for *_, new in event_derivatives.changes(trace) for x in new.values()]
    sums = [
        *event_derivatives.number_slopes(trace).values(),
        *(each for *_, each in event_derivatives.shifts(trace)),
    ]
    roots += [x for each in sums for x in each.expressions]
    return shared_constants(roots + (equations.roots if (equations := one_free(trace)) else []))


def motion_roots(trace: Trace) -> list[Expr]:
    """Gap, reactions and margins of a trace, with the accelerations substituted: their series are
    computed with the motion's.
    """
    accelerations = {
        Expr("acceleration", (), i): a for i, a in enumerate(trace.acceleration[: trace.dof])
    }
    return [
        *([] if trace.gap is None else [trace.gap]),
        *(substitute(root, accelerations) for root in (*trace.reactions, *trace.margins.values())),
    ]


def one_free(trace: Trace) -> OneFree | None:
    """The equations of motion of a trace with several contacts while one coordinate is free; None
    if it has none.
    """
    if trace not in _one_free:
        _one_free[trace] = equations_of_one_free(trace, motion_roots(trace)[len(trace.reactions) :])
    return _one_free[trace]


_one_free: WeakKeyDictionary[Trace, OneFree | None] = WeakKeyDictionary()


def _geometry(trace: Trace) -> list[Expr]:
    """The coordinate at contact and the gap's rate there on both sides."""
    if trace.contact is None or trace.gap_rate is None:
        return []
    return [
        trace.contact,
        *(substitute(trace.gap_rate, {Expr("side"): side}) for side in (1.0, -1.0)),
    ]


def _series(trace: Trace, known: dict[Expr, int]) -> WrittenFunction:
    """The Taylor coefficients of the coordinates, velocities, accelerations, the gap and the
    margins from one state.
    """
    rows = trace.local_rows
    inputs = trace.inputs_of_loops
    gap = [("g", 0)] if trace.gap is not None else []
    margins = [("m", j) for j in range(len(trace.reactions) + len(trace.margins))]
    targets = [*(("a", i) for i in rows), *gap, *margins, *[None] * len(inputs)]
    leaves = LEAVES | _free(trace) | _data(known)
    places = Places(
        ("t", "origin", "side", "env", "piece", "q", "v", "a", "g", "m", "w", "order"), leaves
    )
    loops = trace.loop_rows((("q", 0), ("v", 0), ("a", 0)), with_accelerations=True)
    (q, v) = ([(name, i) for i in rows] for name in ("q", "v"))
    first_order = [i for i in trace.first_order_rows if i in rows]
    layout = Rows(
        q,
        v,
        targets,
        MOST_COEFFICIENTS,
        True,
        first_order=first_order,
        coordinates=rows,
        loops=loops,
    )
    roots = [*(trace.acceleration[i] for i in rows), *motion_roots(trace), *inputs]
    return _function("series", places, SeriesOf(layout, tape(roots, known, series=True)))


def _free(trace: Trace) -> dict[str, tuple[str, int]]:
    """The places behind the parameters: in which direction each friction slides, and, behind an
    instant, what is free.
    """
    first = len(trace.parameters)
    count = len(trace.sided)
    return {"slide": ("parameters", first), "free": ("parameters", first + count + len(INSTANT))}


def _data(known: dict[Expr, int]) -> dict[str, tuple[str, int]]:
    """The place behind the constants of the numbers of modes."""
    return {"datum": ("constants", max(1, len(known)))}


def _in_time(name: str, roots: dict[int, Expr], known: dict[Expr, int]) -> WrittenFunction:
    """The Taylor coefficients of expressions of the time, by their places."""
    places = Places(("t", "origin", "side", "env", "piece", "b", "w", "order"), LEAVES)
    layout = Rows([], [], [("b", i) for i in roots], MOST_COEFFICIENTS, any_order=True)
    return _function(
        name,
        places,
        SeriesOf(layout, tape(list(roots.values()), known, series=True)) if roots else [],
    )


def _matrices(trace: Trace, known: dict[Expr, int]) -> WrittenFunction:
    """The numbers that events at contacts need (`Trace.contact_numbers`) at a state; zeros are
    there from the beginning.
    """
    filled = {
        ("out", i): root for i, root in enumerate(trace.contact_numbers) if root is not number(0.0)
    }
    places = Places(
        ("env", "piece", "state", "out"), ENV | HERE | event_derivatives.places_at_event(trace)
    )
    return _function("matrices", places, [Case(tape(list(filled.values()), known), list(filled))])


def _matrix_slopes(trace: Trace, known: dict[Expr, int]) -> WrittenFunction:
    """The derivatives, along each column of the tangent, of the numbers that `matrices` fills; one
    column after the other.
    """
    slopes = event_derivatives.number_slopes(trace)
    leaves = ENV | HERE | event_derivatives.places_at_event(trace)
    filled = {(("out", i), len(trace.contact_numbers)): along for i, along in slopes.items()}
    cases = [Case.of_columns(trace, filled, known)] if filled else []
    return _function("matrix_slopes", Places(("env", "piece", "state", "out"), leaves), cases)


def _at_impact(
    name: str, arguments: tuple[str, ...], roots: list[Expr], known: dict[Expr, int]
) -> WrittenFunction:
    """A function that returns the values of expressions at an instant, for the velocity `v0`."""
    case = Case(tape(roots, known), [None] * len(roots))
    return _function(name, Places(arguments, LEAVES | {"velocity": ("v0", 0)}), [case])


def _tangent(trace: Trace, known: dict[Expr, int]) -> WrittenFunction:
    """The function that transforms the tangent's columns, in the kernel's state, at each kind of
    event.
    """
    count = len(trace.acceleration)
    starts = {"coordinate": 0, "velocity": count, "shift": 2 * count}
    state = {op: ("state", start) for op, start in starts.items()}
    cases = list[Case]()
    for *event, changes in event_derivatives.changes(trace):
        targets = [("state", starts[leaf.op] + leaf.value) for leaf in changes]
        when = tuple(zip(("kind", "detail"), map(int, event), strict=True))
        cases.append(Case(tape(list(changes.values()), known), targets, when))
    for *event, shift in event_derivatives.shifts(trace):
        when = tuple(zip(("kind", "detail"), map(int, event), strict=True))
        cases.append(Case.of_columns(trace, {(state["shift"], 1): shift}, known, when))
    leaves = LEAVES | _free(trace) | _data(known) | state
    return _function(
        "tangent",
        Places(("kind", "detail", "t", "origin", "side", "env", "piece", "state"), leaves),
        cases,
    )


def _table(name: str, places: Places, roots: list[Expr], known: dict[Expr, int]) -> WrittenFunction:
    """A function that fills its last argument with the values of expressions of the parameters."""
    return _function(
        name,
        places,
        [Case(tape(roots, known), [(places.arguments[-1], i) for i in range(len(roots))])],
    )


@dataclass(frozen=True)
class Program:
    """A system ready to run: its compiled kernel and its numbers."""

    trace: Trace
    structure: CompiledStructure
    env: tuple[Any, ...]  # parameters, constants, record breakpoints, record table
    model: Any  # the structure's functions and the geometry of its contact
    limits: tuple[str, ...]

    @property
    def data(self) -> np.ndarray:
        """The numbers of the modes of a structure, behind the constants."""
        data: np.ndarray = self.env[1][self.structure.constant_count :]
        return data

    def with_numbers(
        self, parameters: np.ndarray, records: tuple[np.ndarray, np.ndarray]
    ) -> Program:
        """The same with other numbers."""
        other = [i for i, path in enumerate(self.trace.parameters) if not _drives(path)]
        kept: Any = ()
        if self.structure.several and np.array_equal(parameters[other], self.env[0][other]):
            kept = self.model.eigenmodes
        env, model = self.structure.prepare(parameters, records, self.data, kept)
        return replace(self, env=env, model=model)


def program(
    system: System,
    limits: tuple[str, ...] | None = None,
    sensitivities: tuple[str, ...] | None = None,
) -> Program:
    """A system ready to run, by default with the margins that end a motion in any case, and with a
    tangent if asked for. Its structure is traced and compiled unless it is known; its numbers are
    filled in at the first time."""
    # what a system remembers is forgotten where values that its classes read have changed
    structure_key(system)
    return known_program(system, limits_of(system, ()) if limits is None else limits, sensitivities)


def known_program(
    system: System, limits: tuple[str, ...], sensitivities: tuple[str, ...] | None
) -> Program:
    """The same, for a caller who has asked for the structure's key already."""
    run: Program = system._remembered(
        (limits, sensitivities), lambda: _made(system, limits, sensitivities)
    )
    if not run.structure.several:
        return run
    # the kernel writes which coordinates are free
    return replace(run, env=(run.env[0].copy(), *run.env[1:]))


def _made(
    system: System, limits: tuple[str, ...], sensitivities: tuple[str, ...] | None
) -> Program:
    asked = (structure_key(system), limits, sensitivities)
    if asked not in _structures:
        traced = trace(system, *asked[1:])
        _structures[asked] = traced, load_structure(traced)
    traced, structure = _structures[asked]
    parameters = np.array(system.numbers_in_order, dtype=float)
    model: Any = system.in_gap_coordinates.model
    data = model.records.array if traced.modes is not None else ()
    other = traced.modes is None or traced.margins or model.frictions
    carried = all(map(_drives, traced.paths))
    eigenmodes = (
        () if other or not carried else model.eigenmodes(MOST_COEFFICIENTS, traced.columns > 0)
    )
    made = structure.prepare(parameters, record_table(system, traced.records), data, eigenmodes)
    return Program(traced, structure, *made, tuple(traced.margins))


def _drives(path: str) -> bool:
    """Whether a structure between its events depends on a number by its inputs alone, or not at
    all.
    """
    owner, _, name = path.rpartition(".")
    return owner.partition(".")[0] in ("load", "impact") or (
        owner.startswith("model.contacts.") and name == "position"
    )


class ContactRows(NamedTuple):
    """The rows of contacts, frictions and surfaces that multipliers hold, at an instant."""

    entries: np.ndarray  # (parts, coordinates)
    drifts: np.ndarray  # (parts,)
    gaps: np.ndarray  # (contacts,)


def contact_rows_at(run: Program, time: float, length: float, state: np.ndarray) -> ContactRows:
    """The rows at a time and a state of the kernel, under a load of the period `length`, or 0."""
    first, local = divmod(time, length) if length else (0.0, time)
    sizes = run.structure.sizes
    numbers = np.zeros(sizes.contact_numbers)
    place = len(run.env[0]) - run.structure.flags - len(INSTANT)
    run.env[0][place : place + len(INSTANT)] = local, first * length
    piece = piece_at(run, time, local, length)
    load_fillers()[2](run.structure.functions[1], run.env, piece, state, numbers)
    end = len(numbers) - len(run.trace.signs)
    table = numbers[end - sizes.multipliers * (sizes.own + 1) : end]
    table = table.reshape(sizes.multipliers, sizes.own + 1)
    return ContactRows(table[:, :-1], table[:, -1], numbers[end:])


def piece_at(run: Program, time: float, local: float, length: float) -> int:
    """The piece of the load's records at a time, which is `local` within a period."""
    breaks: np.ndarray = run.env[2]
    if not breaks.size:
        return 0
    if run.structure.sizes.repeats:
        return int((breaks * length).searchsorted(local, side="right"))
    return int(breaks.searchsorted(time, side="right"))


_structures: dict[Any, tuple[Trace, CompiledStructure]] = {}


def limits_of(system: System, stop_at: Iterable[str]) -> tuple[str, ...]:
    """The margins that end a motion: the model's own stops, in coordinates of its gaps, and those
    asked for.
    """
    model = system.in_gap_coordinates.model
    asked = check_names("stop_at", stop_at, "margins, such as ['kinematic_limit']")
    own = system._remembered("limits", lambda: (*model.stops, *model.friction_limits))
    return tuple(dict.fromkeys((*own, *asked)))


@lru_cache
def taylor_order(tol: float) -> int:
    """The order of series that is fastest at a tolerance: 10 at 1e-6, 15 at 1e-10, 20 at 1e-14."""
    return round(10 + 1.25 * (-math.log10(tol) - 6))
