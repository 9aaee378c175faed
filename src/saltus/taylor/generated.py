"""The functions of a structure: their tapes, LLVM's text that is written for them, and their
machine code, from the disk or made.

A structure is everything except a system's numbers; a digest of each of its parts is what results
carry, so that changed models are noticed (`equations_of`).

The text is written by `series.py` and by `instant` here. numba has no part in it: it would need
seconds to infer the types of a structure's recurrences, and its cache is slower to read than an
object file.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import llvmlite
from llvmlite import binding, ir

from saltus.errors import SaltusError
from saltus.systems import System, declares_mirror
from saltus.taylor import graph, load_tables, memory, numba_types, rules, series, vectors
from saltus.taylor.cache import digest, kept_bytes, loading, source_of, structure_key
from saltus.taylor.graph import LEAVES, Expr
from saltus.taylor.kernels import told_before
from saltus.taylor.memory import ColumnSum, Constants, Memory, Node, Place, Places, Tape, tape
from saltus.taylor.numba_types import (
    Pointer,
    given_arguments,
    result_count,
    written_function,
    written_type,
)
from saltus.taylor.rules import FUNCTIONS
from saltus.taylor.series import Rows, Series
from saltus.taylor.tracing import Trace, trace
from saltus.taylor.vectors import (
    CACHE_LINE,
    LONG,
    Arithmetic,
    ColumnInputs,
    Vec,
    add,
    loop,
    multiply,
    subtract,
)

ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "add": add,
    "sub": subtract,
    "mul": multiply,
    "div": lambda a, b: a / b,
}
SIGNS = {"greater": ">", "less": "<", "greater_equal": ">=", "less_equal": "<="}
MIRRORED = str.maketrans("<>", "><")


class ColumnNumber(NamedTuple):
    """A number of each column of a tangent: a `ColumnSum` whose parts are values of the nodes of a
    tape.
    """

    target: Place  # of the first column's, behind which those of the others lie `stride` apart
    stride: int
    terms: Sequence[tuple[Node, int]]  # (leaf, slope)
    pushes: Sequence[int | None]
    over: int | None


class ColumnNumbers(NamedTuple):
    """The numbers of the columns of a model of so many coordinates."""

    dof: int
    columns: int
    numbers: Sequence[ColumnNumber]


@dataclass(frozen=True)
class Case:
    """What a function of an instant computes if its arguments named in `when` have the given
    values: the roots of a tape, or numbers of the columns of a tangent from its nodes."""

    tape: Tape
    # where each root is stored; None: it is returned by the function
    targets: Sequence[Place | None]
    when: Sequence[tuple[str, int]] = ()
    numbers: ColumnNumbers | None = None

    @property
    def leaves(self) -> set[str]:
        """The kinds of leaves that it reads."""
        numbers = () if self.numbers is None else self.numbers.numbers
        return {node[0] for node in self.tape.nodes} | {
            leaf[0] for each in numbers for leaf, _ in each.terms
        }

    @classmethod
    def of_columns(
        cls,
        trace: Trace,
        sums: Mapping[tuple[Place, int], ColumnSum],
        known: Constants,
        when: Sequence[tuple[str, int]] = (),
    ) -> Case:
        """The case that fills numbers of all columns, each from the place of the first column's on,
        and so far apart.
        """
        written = tape([x for each in sums.values() for x in each.expressions], known)
        roots = iter(written.roots)
        numbers = list[ColumnNumber]()
        for (target, stride), each in sums.items():
            terms = [((leaf.op, leaf.value), next(roots)) for leaf, _ in each.terms]
            pushes = [None if push is None else next(roots) for push in each.pushes]
            numbers.append(
                ColumnNumber(
                    target, stride, terms, pushes, None if each.over is None else next(roots)
                )
            )
        return cls(
            replace(written, roots=[]), [], when, ColumnNumbers(trace.dof, trace.columns, numbers)
        )


class SeriesOf(NamedTuple):
    """The series that a function computes: of a tape, into rows."""

    rows: Rows
    tape: Tape


@dataclass(frozen=True)
class WrittenFunction:
    """A function of a structure: the series of a tape, or cases of an instant, of which only one
    that always holds has results.

    An instant is computed without fused multiply-adds.
    """

    name: str
    signature: Any  # numba's
    places: Places
    arithmetic: Arithmetic
    content: SeriesOf | Sequence[Case]

    def write(self, module: Any) -> None:
        """Append the function to LLVM's module."""
        function = ir.Function(module, written_function(self.signature), self.name)
        builder = ir.IRBuilder(function.append_basic_block("entry"))
        results = list[Any]()
        arguments = given_arguments(self.signature, function)
        if isinstance(self.content, SeriesOf):
            rows, tape = self.content
            if self.arithmetic.width > 1:
                stack_of_cache_lines(function, CACHE_LINE)
            Series(
                Memory(builder, self.arithmetic, self.places, arguments), tape, rows
            ).write_motion(tape.roots)
        else:
            if any(node[0] == "form" for case in self.content for node in case.tape.nodes):
                # many sums over modes, at events only, without LLVM's passes
                function.attributes.update(("noinline", "optnone"))
            memory = Memory(builder, self.arithmetic.unfused(), self.places, arguments)
            results = [value for case in self.content for value in _write_case(memory, case)]
        self._return(builder, function, results)

    def _return(self, builder: Any, function: Any, results: list[Any]) -> Any:
        """The end of the function, with its results."""
        assert len(results) == result_count(self.signature)
        if len(results) == 1:
            return builder.ret(results[0])
        for i, result in enumerate(results):
            builder.store(result, builder.gep(function.args[-1], [LONG(i)]))
        return builder.ret_void()


def _write_case(memory: Memory, case: Case) -> list[Any]:
    """A case of an instant, and LLVM's values of its results."""
    builder = memory.builder
    conditions = [
        builder.icmp_signed("==", memory.arguments[name], LONG(value)) for name, value in case.when
    ]
    if not conditions:
        return _store(memory, case)
    holds = conditions[0]
    for condition in conditions[1:]:
        holds = builder.and_(holds, condition)
    with builder.if_then(holds):
        _store(memory, case)
    return []


def _store(memory: Memory, case: Case) -> list[Any]:
    """Compute a case's roots, put them into memory, and return LLVM's values of those that are
    results.
    """
    nodes = _instant(memory, case.tape)
    if case.numbers is not None:
        _store_numbers(memory, nodes, case.numbers)
    values = list(zip(case.targets, [nodes[root] for root in case.tape.roots], strict=True))
    for target, value in values:
        if target is not None:
            memory.store(target, value)
    return [memory.value(value) for target, value in values if target is None]


def _store_numbers(memory: Memory, nodes: list[Any], given: ColumnNumbers) -> None:
    """Compute the numbers of all columns, in a loop over them, and put them into memory."""
    b = memory.builder
    pushes = ColumnInputs(memory, given.columns, [each.pushes for each in given.numbers])
    pushes.store(nodes.__getitem__)
    with loop(b, 0, given.columns) as column:
        for i, each in enumerate(given.numbers):
            total: Any = pushes.of(i, column)
            for leaf, slope in each.terms:
                total = add(
                    total, multiply(nodes[slope], memory.of_column(leaf, given.dof, column))
                )
            place = b.gep(memory.pointer(each.target), [b.mul(column, LONG(each.stride))])
            b.store(
                memory.value(total if each.over is None else total / nodes[each.over]), place
            ).align = 8


def instant(memory: Memory, tape: Tape) -> list[Vec | float]:
    """The roots' numbers at the time and state that the leaves have."""
    nodes = _instant(memory, tape)
    return [nodes[root] for root in tape.roots]


def _instant(memory: Memory, tape: Tape) -> list[Any]:
    """The numbers of all nodes at the time and state that the leaves have."""
    values: list[Any] = []
    for node in tape.nodes:
        if node[0] in (*LEAVES, "constant"):
            values.append(memory.leaf(node))
        else:
            values.append(_operation(memory, node[0], [values[i] for i in node[1:]]))
    return values


def _operation(memory: Memory, op: str, args: list[Any]) -> Any:
    """An operation on numbers; comparisons give masks."""

    def lifted(x: Any) -> Vec:
        return x if isinstance(x, Vec) else memory.arithmetic.number(memory.builder, x)

    a = args[0]
    b = args[-1]
    if op in ARITHMETIC:
        return ARITHMETIC[op](a, b)
    if op in SIGNS:
        return (
            a.compare(SIGNS[op], b)
            if isinstance(a, Vec)
            else b.compare(SIGNS[op].translate(MIRRORED), a)
        )
    if op == "where":
        return lifted(args[1]).select(a, b)
    if op in ("maximum", "minimum"):
        return lifted(b).select(lifted(b).compare(">" if op == "maximum" else "<", a), a)
    assert op in FUNCTIONS or op == "pow"
    return lifted(a).function(op, *args[1:])


def stack_of_cache_lines(function: Any, line: int) -> None:
    """Align the stack such that each vector on it lies within one cache line; otherwise every use
    would touch two. LLVM aligns the stack for variables, but not for values that it moves out of
    registers later."""
    function.attributes.alignstack = line


# --- text and machine code ---------------------------------------------------


def functions_text(functions: Sequence[WrittenFunction]) -> str:
    """Functions as text, which is all that their code depends on besides `written_by`."""
    return graph.shared_text(functions)


@cache
def written_by() -> str:
    """A digest of the sources that write code, and of what LLVM makes of it on this machine."""
    writers = (
        graph,
        load_tables,
        memory,
        numba_types,
        rules,
        series,
        vectors,
        sys.modules[__name__],
    )
    return digest(*(source_of(module) for module in writers), made_for())


def llvm_text(functions: Sequence[WrittenFunction]) -> str:
    """The functions as LLVM's text."""
    module = ir.Module("saltus")
    module.triple = binding.get_process_triple()
    for function in functions:
        function.write(module)
    return str(module)


def load_functions(
    kind: str, functions: Sequence[WrittenFunction], traced: Trace
) -> dict[str, Pointer]:
    """Pointers to functions of a trace by their names: loaded from the disk, or written and
    compiled first.
    """
    is_long = kind == "structure" and graph.is_long(traced)
    name = f"{kind}_{digest(functions_text(functions), written_by(), str(is_long))}"
    # a second thread must not load them again: the code that is replaced would be freed while
    # pointers lead to it
    with loading:
        if name not in _loaded:
            code = kept_bytes(
                f"{name}.o",
                lambda: object_code(told_before(traced, kind, llvm_text(functions)), is_long),
            )
            _loaded[name] = Loaded(code, [function.name for function in functions])
    addresses = _loaded[name].addresses
    return {
        each.name: Pointer.to(addresses[each.name], written_type(each.signature))
        for each in functions
    }


_loaded: dict[str, Loaded] = {}  # as long as the process, as pointers may be anywhere


# As numba, and for the whole of LLVM: its passes are not safe to run from two threads of one target
# machine.
_LLVM = threading.RLock()
# All code stays in memory as long as the process: pointers to it may be anywhere.
_ENGINES: list[Any] = []


@cache
def processor() -> tuple[str, str]:
    """The processor's name and the features that may be used, as LLVM writes them."""
    from numba import config  # later, as numba fails where the package explains

    settings: Any = config
    given = settings.CPU_FEATURES
    return (
        settings.CPU_NAME or binding.get_host_cpu_name(),
        binding.get_host_cpu_features().flatten() if given is None else given,
    )


@cache
def made_for() -> str:
    """All that the same text may be compiled to different code for, as text."""
    return "\n".join((llvmlite.__version__, binding.get_process_triple(), *processor()))


def _target_machine() -> Any:
    """A new machine to compile for; one that an engine runs on belongs to the engine."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = processor()
    target = binding.Target.from_triple(binding.get_process_triple())
    # code that is loaded where it stays needs no tables of addresses
    static = target.name.startswith("x86")
    options = {"reloc": "static" if static else "default", "codemodel": "jitdefault", "jit": True}
    return target.create_target_machine(cpu=name, features=features, opt=3, **options)


def object_code(text: str, is_long: bool = False) -> bytes:
    """The object file of LLVM's text, optimised; a long text goes without LLVM's passes, whose time
    grows faster than it.
    """
    with _LLVM:
        machine = _target_machine()
        module = binding.parse_assembly(text)
        module.data_layout = str(machine.target_data)
        module.verify()
        if not is_long:
            _optimise(module, machine)
        return bytes(machine.emit_object(module))


def _optimise(module: Any, machine: Any) -> None:
    """LLVM's own passes of level 3; no vectoriser, as the text has vectors where they are worth
    it.
    """
    if hasattr(binding, "create_pass_builder"):
        builder = binding.create_pass_builder(machine, binding.create_pipeline_tuning_options(3))
        builder.getModulePassManager().run(module, builder)
        return
    builder = binding.create_pass_manager_builder()  # before llvmlite 0.44
    builder.opt_level = 3
    passes = binding.create_module_pass_manager()
    machine.add_analysis_passes(passes)
    builder.populate(passes)
    passes.run(module)


class Loaded:
    """The functions of an object file in memory, where they stay as long as the process.

    Attributes
    ----------
    addresses
        The address of each function by its name.
    """

    def __init__(self, code: bytes, names: Iterable[str]) -> None:
        with _LLVM:
            self._engine = binding.create_mcjit_compiler(
                binding.parse_assembly(""), _target_machine()
            )
            self._engine.add_object_file(binding.ObjectFileRef.from_data(code))
            self._engine.finalize_object()
            _ENGINES.append(self._engine)
            self.addresses: dict[str, int] = {
                name: self._engine.get_function_address(name) for name in names
            }


# the most systems whose digests are kept, as a study asks for the same ones many times
MOST_KNOWN = 64


def equations_of(system: System) -> dict[str, str]:
    """A digest of each part of a system's equations, without its numbers, which are in
    `System.to_json`.

    The parts are `acceleration` (including the load's channels), `gap`, `contact` (its position),
    `reset` (including the impact law), `contacts` (of a model with several) and `signs` (of its
    contacts). The others are `margins`, `mirror` (the load of the mirror image) and `names` (of
    coordinates, units, channels, sides and stops). Values that a model's Python reads from
    elsewhere, such as constants of its module, are numbers in the expressions.

    Raises
    ------
    TraceError
        The model cannot be traced.
    """
    key = structure_key(system)
    with_numbers = key, system.to_json()
    if with_numbers not in _known:
        if key not in _digests:
            _digests[key] = _traced_parts(system)
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known[with_numbers] = _digests[key] | _other_parts(system)
    return dict(_known[with_numbers])


_digests: dict[Any, dict[str, str]] = {}  # of structures, as their compiled code is kept
# of systems with their numbers, on which the mirror image may depend
_known: dict[Any, dict[str, str]] = {}


def _other_parts(system: System) -> dict[str, str]:
    """The digests of the parts that are not traced."""
    model = system.model
    # a symmetry that is found follows from the other parts
    mirrored = system.mirrored() if declares_mirror(model) else None
    names = (model.coordinates, model.units, model.channels, model.sides, model.stops)
    return {
        "mirror": digest(repr(mirrored and mirrored.to_dict()["load"])),
        "names": digest(repr(names)),
    }


def _traced_parts(system: System) -> dict[str, str]:
    """The digests of the traced parts."""
    traced = trace(system)
    roots: dict[str, list[Expr | None]] = {
        "acceleration": list(traced.acceleration),
        "gap": [traced.gap],
        "contact": [traced.contact],
        "reset": [traced.next_side, traced.velocity_after],
        "contacts": [*traced.reactions, *traced.contact_numbers],
    }
    texts = {
        name: _text(traced, [root for root in parts if root is not None])
        for name, parts in roots.items()
    }
    signs = (
        traced.signs,
        traced.contact_coordinates,
        traced.sided,
    )
    texts |= {"margins": _margins(system), "signs": repr(signs)}
    return {name: digest(text) for name, text in texts.items()}


def _margins(system: System) -> str:
    """The margins as text; if they cannot be traced, and so cannot end a motion, their names take
    the place of expressions.
    """
    names = system.model.margin_names(system.load)
    try:
        traced = trace(system, names)
    except SaltusError:
        return repr(names)
    return repr(names) + _text(traced, list(traced.margins.values()))


def _text(traced: Trace, roots: list[Expr]) -> str:
    """Expressions as text, in which parameters and records are given by their paths, not by their
    numbers in the trace.
    """
    paths: dict[str, list[Any]] = {"parameter": traced.parameters, "record": traced.records}
    written = tape(roots)
    nodes = [
        (node[0], paths[node[0]][node[1]]) if node[0] in paths else node for node in written.nodes
    ]
    return repr((nodes, written.roots))
