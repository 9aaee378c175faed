"""What kernels work with beyond numba's own types, in numba's public extension interface.

* Functions that are given by their addresses (`PointedFunction`): those of a structure, which are
  written for LLVM, and numba's
  own. A call is one instruction; numba's first-class functions are first asked, by Python code,
  where they are.
* Tuples that are given by their address (`Reference`): by value, a tuple of many arrays would be
  hundreds of arguments. The
  fields of named tuples, and of the named tuples and records in them, are attributes; those of
  records can be set.
* Functions and operators whose LLVM code is written here (`inlined`, `operator_meaning`), for the
  vectors of the lanes.

A function that is written for LLVM is called with numbers and addresses alone, so that it can also
be called from C, by `ctypes` or in a browser: an array is the address of its first element and all
of its lengths but the first, and a tuple is its parts one after the other. Two or more results are
put where the last argument says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
    type_callable,
    typeof_impl,
    unbox,
)

from saltus.taylor.vectors import DOUBLE, INDEX, LONG


def members_of(kind: Any) -> tuple[Any, ...]:
    """The types of a tuple's values."""
    return tuple(kind.types)


def register_type(kind: type, llvm: Any) -> None:
    """Let numba keep values of one of its types in an LLVM type, or in the one that a function of
    the type gives.
    """

    class Model(models.PrimitiveModel):
        def __init__(self, manager: Any, each: Any) -> None:
            super().__init__(
                manager, each, llvm if isinstance(llvm, ir.Type) else llvm(manager, each)
            )  # type: ignore[no-untyped-call]

    register_model(kind)(Model)


# --- tuples by their address -------------------------------------------------


class Reference(types.BaseTuple):
    """The type of a tuple that is passed by its address."""

    def __init__(self, of: Any) -> None:
        super().__init__(name=f"Reference({of})")
        self.of, self.types, self.count = of, of.types, len(of)

    @property
    def mangling_args(self) -> Any:
        """The names of compiled functions contain those of their arguments' types, which would be
        long.
        """
        named = isinstance(self.of, types.BaseNamedTuple)
        return (
            f"{self.__class__.__name__}{self.of.instance_class.__name__ if named else ''}",
            () if named else (self.of,),
        )

    def __len__(self) -> int:
        return self.count


register_type(
    Reference, lambda manager, kind: manager.lookup(kind.of).get_value_type().as_pointer()
)


@lower_builtin("static_getitem", Reference, types.IntegerLiteral)  # type: ignore[untyped-decorator]
def _referred(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """One of the tuple's values."""
    return _element(context, builder, args[0], args[1], signature.return_type)


def _element(context: Any, builder: Any, place: Any, index: int, kind: Any) -> Any:
    """A value of the tuple at a place; an array is counted where arrays are."""
    value = builder.load(builder.gep(place, [INDEX(0), INDEX(index)], inbounds=True))
    if context.enable_nrt:
        context.nrt.incref(builder, kind, value)
    return value


def path_to(kind: Any, name: str) -> tuple[Any, ...] | None:
    """The way to a field of a named tuple, or of the named tuples and records within it: indices,
    then a record's field.
    """
    for i, (field, inner) in enumerate(zip(kind.fields, kind.types, strict=True)):
        if field == name:
            return (i,)
        if isinstance(inner, types.Record) and name in inner.fields:
            return i, name
        deeper = path_to(inner, name) if isinstance(inner, types.BaseNamedTuple) else None
        if deeper is not None:
            return i, *deeper
    return None


def field_type(reference: Reference, name: str) -> Any:
    """The type of a field of a named tuple by its `Reference`, or None; a named tuple among the
    fields is a `Reference` too.
    """
    path = path_to(reference.of, name) if isinstance(reference.of, types.BaseNamedTuple) else None
    if path is None:
        return None
    kind: Any = reference.of
    for step in path:
        kind = kind.typeof(step) if isinstance(step, str) else kind.types[step]
    return Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


def _owner(builder: Any, kind: Any, value: Any, path: tuple[Any, ...]) -> tuple[Any, Any]:
    """The type of what has the last field of a path, and LLVM's value of it: a tuple's address, or
    a record.
    """
    for step in path[:-1]:
        kind = kind.types[step]
        value = builder.gep(value, [INDEX(0), INDEX(step)], inbounds=True)
    return kind, builder.load(value) if isinstance(kind, types.Record) else value


@lower_getattr_generic(Reference)  # type: ignore[untyped-decorator]
def _field(context: Any, builder: Any, kind: Any, value: Any, attr: str) -> Any:
    """The value of a field."""
    path = path_to(kind.of, attr)
    assert path is not None
    owner, value = _owner(builder, kind.of, value, path)
    if isinstance(owner, types.Record):
        return context.get_getattr(owner, attr)(context, builder, owner, value, attr)
    found = owner.types[path[-1]]
    linked = LINKED.get((owner.instance_class.__name__, attr))
    if linked is not None:
        return _linked(builder, linked)
    if isinstance(found, types.BaseNamedTuple):
        return builder.gep(value, [INDEX(0), INDEX(path[-1])], inbounds=True)
    return _element(context, builder, value, path[-1], found)


@lower_setattr_generic(Reference)  # type: ignore[untyped-decorator]
def _set_field(context: Any, builder: Any, signature: Any, args: Any, attr: str) -> None:
    """Set a record's field."""
    kind, new = signature.args
    path = path_to(kind.of, attr)
    assert path is not None
    owner, record = _owner(builder, kind.of, args[0], path)
    context.get_setattr(attr, signature.replace(args=(owner, new)))(builder, (record, args[1]))


@intrinsic
def by_reference(typing: Any, given: Any) -> Any:
    """A tuple as a `Reference`, valid until the function that makes it returns; the caller of that
    function owns the arrays.
    """

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            place = builder.alloca(args[0].type)
        builder.store(args[0], place)
        return place

    return Reference(given)(given), code


# --- functions by their address ----------------------------------------------


class PointedFunction(types.Callable):
    """The type of a function of one signature that is given by its address: numba's, or one that is
    `written` for LLVM.
    """

    def __init__(self, signature: Any, written: bool) -> None:
        self.signature = signature
        self.written = written
        super().__init__(name=f"{'Written' if written else 'Compiled'}({signature})")

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """The signature, or None if the number of arguments is wrong; a tuple may be given as a
        `Reference`.
        """
        if len(args) != len(self.signature.args) or kws:
            return None
        pairs = zip(args, self.signature.args, strict=True)
        wanted = tuple(
            given if isinstance(given, Reference) and given.of == own else own
            for given, own in pairs
        )
        return type(self.signature)(self.signature.return_type, wanted, self)

    def get_call_signatures(self) -> Any:
        return [self.signature], False

    def get_impl_key(self, sig: Any) -> Any:
        return PointedFunction


class Pointer(int):
    """The address of a compiled function, with its `PointedFunction`."""

    kind: PointedFunction

    @classmethod
    def to(cls, address: int, kind: PointedFunction) -> Pointer:
        """The pointer to a function at an address."""
        made = cls(address)
        made.kind = kind
        return made


def function_type(signature: Any) -> PointedFunction:
    """The type of arguments that are functions of this signature, which numba has compiled."""
    return PointedFunction(signature, written=False)


def written_type(signature: Any) -> PointedFunction:
    """The type of arguments that are functions of this signature, written for LLVM."""
    return PointedFunction(signature, written=True)


# Fields of named tuples that are functions with which the text of a kernel is linked by their
# names, so that LLVM knows them; the addresses in these fields are not read.
LINKED: dict[tuple[str, str], str] = {}


def _linked(builder: Any, name: str) -> Any:
    """The address of a function by its name, whose type a call knows."""
    unknown = ir.FunctionType(ir.VoidType(), [])
    known = builder.module.globals.get(name) or ir.Function(builder.module, unknown, name)
    return builder.ptrtoint(known, LONG)


register_type(PointedFunction, LONG)
typeof_impl.register(Pointer)(lambda given, context: given.kind)


@unbox(PointedFunction)  # type: ignore[untyped-decorator]
def _address(kind: PointedFunction, given: Any, boundary: Any) -> NativeValue:
    """A `Pointer` in compiled code."""
    return NativeValue(boundary.builder.ptrtoint(boundary.pyapi.long_as_voidptr(given), LONG))


@lower_builtin(PointedFunction, types.VarArg(types.Any))  # type: ignore[untyped-decorator]
def _call(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """A call through an address."""
    (called, *kinds) = signature.args
    (address, *values) = args
    values = [
        builder.load(value) if isinstance(kind, Reference) else value
        for kind, value in zip(kinds, values, strict=True)
    ]
    if called.written:
        return _call_written(context, builder, called.signature, address, values)
    result = context.get_value_type(called.signature.return_type)
    function = ir.FunctionType(result, [value.type for value in values])
    return builder.call(builder.inttoptr(address, function.as_pointer()), values)


def _call_written(
    context: Any, builder: Any, signature: Any, address: Any, values: list[Any]
) -> Any:
    """A call of a function that was written for LLVM."""
    function = written_function(signature)
    count = result_count(signature)
    given = [
        part
        for kind, value in zip(signature.args, values, strict=True)
        for part in _parts(context, builder, kind, value)
    ]
    if count > 1:
        with builder.goto_entry_block():
            results = builder.alloca(DOUBLE, count)
        given.append(results)
    made = builder.call(builder.inttoptr(address, function.as_pointer()), given)
    if count > 1:
        results = [builder.load(builder.gep(results, [LONG(i)])) for i in range(count)]
        return context.make_tuple(builder, signature.return_type, results)
    return made if count else context.get_dummy_value()


def _parts(context: Any, builder: Any, kind: Any, value: Any) -> list[Any]:
    """A value as a function that is written for LLVM takes it."""
    given = argument(context, builder, kind, value)
    return list(_flat(given))


def _flat(given: Any) -> Iterator[Any]:
    if isinstance(given, tuple):
        for part in given:
            yield from _flat(part)
    elif isinstance(given, Array):
        yield from (given.data, *given.shape[1:])
    else:
        yield given


def result_count(signature: Any) -> int:
    """How many numbers a function returns."""
    kind = signature.return_type
    return 0 if kind == types.void else len(kind) if isinstance(kind, types.BaseTuple) else 1


def written_function(signature: Any) -> Any:
    """LLVM's type of a function of this signature that is written for LLVM."""
    count = result_count(signature)
    arguments = [part for kind in signature.args for part in _llvm_types(kind)]
    if count > 1:
        arguments.append(DOUBLE.as_pointer())
    return ir.FunctionType(DOUBLE if count == 1 else ir.VoidType(), arguments)


def _llvm_types(kind: Any) -> list[Any]:
    if isinstance(kind, types.BaseTuple):
        return [part for each in members_of(kind) for part in _llvm_types(each)]
    if isinstance(kind, types.Array):
        element = DOUBLE if isinstance(kind.dtype, types.Float) else LONG
        return [element.as_pointer(), *[LONG] * (kind.ndim - 1)]
    return [DOUBLE if isinstance(kind, types.Float) else LONG]


def given_arguments(signature: Any, function: Any) -> tuple[Any, ...]:
    """The arguments of a function that is being written for LLVM: numbers, `Array`s, and tuples of
    them.
    """
    waiting = iter(function.args)
    return tuple(_assembled(kind, waiting) for kind in signature.args)


def _assembled(kind: Any, waiting: Iterator[Any]) -> Any:
    if isinstance(kind, types.BaseTuple):
        return tuple(_assembled(each, waiting) for each in members_of(kind))
    first = next(waiting)
    if isinstance(kind, types.Array):
        return Array(first, (None, *(next(waiting) for _ in range(kind.ndim - 1))))
    return first


# --- functions whose code is written here ------------------------------------


class Array:
    """A C-contiguous array in code that is written for LLVM: where its first element is, and its
    lengths as far as they count.
    """

    def __init__(self, data: Any, shape: tuple[Any, ...]) -> None:
        self.data = data
        self.shape = shape


def argument(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """An argument of numba's as LLVM's number, an `Array`, or a tuple of them."""
    if isinstance(kind, types.Array):
        made = context.make_array(kind)(context, builder, value)
        return Array(
            made.data, tuple(builder.extract_value(made.shape, i) for i in range(kind.ndim))
        )
    if isinstance(kind, types.BaseTuple):
        parts = [builder.extract_value(value, i) for i in range(len(kind))]
        return tuple(
            argument(context, builder, each, part)
            for each, part in zip(members_of(kind), parts, strict=True)
        )
    return value


def inlined(result: Any, write: Callable[..., Any], count: int) -> Any:
    """A function of compiled code of `count` arguments; `write(builder, types, *arguments)` gives
    LLVM's value of its result.
    """

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given = [
            argument(context, builder, kind, value)
            for kind, value in zip(signature.args, args, strict=True)
        ]
        value = write(builder, signature.args, *given)
        return context.get_dummy_value() if result == types.void else value

    if count == 1:
        return intrinsic(lambda typing, a: (result(a), code))
    if count == 2:
        return intrinsic(lambda typing, a, b: (result(a, b), code))
    if count == 3:
        return intrinsic(lambda typing, a, b, c: (result(a, b, c), code))
    return intrinsic(lambda typing, a, b, c, d: (result(a, b, c, d), code))


def operator_meaning(
    symbol: Any, kind: type, result: Any, write: Callable[..., Any], count: int = 2
) -> None:
    """Let Python's operator mean `write` where a value of this type is among its operands; the
    others may be numbers.

    numba's `overload` would compile a function for every pair of types.
    """

    def fits(*given: Any) -> Any:
        own = [isinstance(each, kind) for each in given]
        fit = any(own) and all(
            o or isinstance(each, types.Number) for o, each in zip(own, given, strict=True)
        )
        return result if fit else None

    @type_callable(symbol)
    def typer(context: Any) -> Any:
        return {1: lambda a: fits(a), 2: lambda a, b: fits(a, b)}[count]

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return write(builder, signature.args, *args)

    for kinds in product((kind, types.Number), repeat=count):
        if kind in kinds:
            lower_builtin(symbol, *kinds)(code)
