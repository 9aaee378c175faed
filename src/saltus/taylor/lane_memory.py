"""The memory of a group of lanes in words, in numba's extension interface: `lanes.now` is a vector,
`lane.now` is a number.

A group is a named tuple that is passed by its address (`shared`). Its first two fields are
`memory`, an array of slots of one vector, and `places`, an array of the first slot of each part of
it. `LanesType` says which names stand for slots, for parts, and for numbers of the group or of each
lane that are no doubles:

* `lanes.NAME` is the vector in a slot, and can be set. Of a part it is its slots,
  `lanes.NAME[row]`; of a part with a series in
  each row it is `lanes.NAME[row][k]`.
* `lane = one(lanes, i)` is lane number i. The same names are its own numbers there, and so are the
  names of `rows`, which has a
  record for each lane; `lane.index` is i, and `lane.lanes` the group.
* The fields of the named tuple have their names in both; a named tuple among them is given by its
  address, too.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, ClassVar

from llvmlite import ir
from numba import types
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
    type_callable,
)

from saltus.taylor.lane_vectors import VectorType, vector_type
from saltus.taylor.numba_types import Reference, register_type
from saltus.taylor.private_numba import name_attributes
from saltus.taylor.vectors import DOUBLE, INDEX, LANES, LONG, WIDTH

POINTER = DOUBLE.as_pointer()


class LanesType(types.Type):
    """The type of a group of lanes.

    `slots` and `parts` are the names of slots and parts in their order, and `series` the length of
    a series by the names of parts that have them. `rows` and `flags` are the fields of the named
    tuple that have a record for each lane, and a record for the group.
    """

    # the types of the named tuples, by the names of the types of their groups
    tuples: ClassVar[dict[str, Any]] = {}

    def __init__(
        self, name: str, slots: Any, parts: Any, series: dict[str, int], rows: str, flags: str
    ) -> None:
        super().__init__(name=name)
        self.slots = slots
        self.parts = parts
        self.series = series
        self.rows = rows
        self.flags = flags

    @property
    def of(self) -> Any:
        """The type of the named tuple; it may have pointers to functions of these lanes, so that it
        is known later.
        """
        return self.tuples[self.name]

    def record(self, field: str) -> dict[str, Any]:
        """The names of the numbers in an array of records."""
        found: dict[str, Any] = self.of.types[self.of.fields.index(field)].dtype.fields
        return found


class LaneType(types.Type):
    """The type of one lane of a group."""

    def __init__(self, group: LanesType) -> None:
        super().__init__(name=f"One of {group}")
        self.group = group


class SlotsType(types.Type):
    """The type of slots that follow one another: `slots[i]` is a vector, or a number where they are
    those of one lane.
    """

    def __init__(self, one: bool, length: int = 0) -> None:
        super().__init__(name=f"Slots({one}, {length})")
        # `length` of the series in each row, or 0
        self.one = one
        self.length = length


register_type(SlotsType, POINTER)


@register_model(LanesType)
class _LanesModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        number = types.CPointer(types.float64)
        place = types.CPointer(types.int64)
        members = [("memory", number), ("places", place), ("tuple", Reference(kind.of))]
        super().__init__(manager, kind, members)  # type: ignore[no-untyped-call]


@register_model(LaneType)
class _LaneModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("lanes", kind.group), ("index", types.int64)])  # type: ignore[no-untyped-call]


# --- attributes --------------------------------------------------------------


def _field(of: Any, name: str) -> Any:
    """The type of a field of a named tuple as an attribute, or None."""
    if name not in of.fields:
        return None
    kind = of.types[of.fields.index(name)]
    return Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


def _meaning(group: LanesType, name: str, one: bool) -> Any:
    """The type of an attribute of a group, or of one lane of it; None if there is none of this
    name.
    """
    if name in group.slots:
        return types.float64 if one else vector_type
    if name in group.parts:
        return SlotsType(one, group.series.get(name, 0))
    for field in (group.flags, group.rows) if one else (group.flags,):
        if name in group.record(field):
            return group.record(field)[name].type
    return _field(group.of, name)


def _of_lane(kind: LaneType, name: str) -> Any:
    """The type of an attribute of one lane."""
    if name in ("index", "lanes"):
        return types.int64 if name == "index" else kind.group
    return _meaning(kind.group, name, one=True)


name_attributes(LanesType, lambda kind, name: _meaning(kind, name, one=False))
name_attributes(LaneType, _of_lane)


def _field_place(builder: Any, of: Any, address: Any, name: str) -> Any:
    return builder.gep(address, [INDEX(0), INDEX(of.fields.index(name))], inbounds=True)


def _field_value(context: Any, builder: Any, of: Any, address: Any, name: str) -> Any:
    """A field of a named tuple, or its address if it is one, too; an array is counted where arrays
    are.
    """
    place = _field_place(builder, of, address, name)
    kind = of.types[of.fields.index(name)]
    if isinstance(kind, types.BaseNamedTuple):
        return place
    value = builder.load(place)
    if context.enable_nrt:
        context.nrt.incref(builder, kind, value)
    return value


class _Group:
    """A group of lanes, or one of them, in code that is written for LLVM."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self.context = context
        self.builder = builder
        self.one = isinstance(kind, LaneType)
        self.group = kind.group if self.one else kind
        self.value = builder.extract_value(value, 0) if self.one else value
        self.index = builder.extract_value(value, 1) if self.one else LONG(0)
        self.memory, self.places, self.tuple = (
            builder.extract_value(self.value, i) for i in range(3)
        )

    def place(self, name: str) -> Any:
        """LLVM's pointer to a number or a vector, to the first one of a part, or None if the name
        is that of a field.
        """
        b = self.builder
        group = self.group
        if name in group.slots:
            return self._typed(
                b.gep(self.memory, [b.add(LONG(group.slots.index(name) * WIDTH), self.index)])
            )
        if name in group.parts:
            first = b.load(b.gep(self.places, [LONG(group.parts.index(name))]))
            return b.gep(self.memory, [b.add(b.mul(first, LONG(WIDTH)), self.index)])
        for field, index in ((group.flags, LONG(0)), (group.rows, self.index)):
            if name in group.record(field):
                return self._of_record(field, name, index)
        return None

    def _typed(self, place: Any) -> Any:
        return place if self.one else self.builder.bitcast(place, LANES.of(DOUBLE).as_pointer())

    def _of_record(self, field: str, name: str, index: Any) -> Any:
        b = self.builder
        kind = self.group.of.types[self.group.of.fields.index(field)]
        array = self.context.make_array(kind)(
            self.context, b, b.load(_field_place(b, self.group.of, self.tuple, field))
        )
        found = kind.dtype.fields[name]
        first = b.bitcast(array.data, ir.IntType(8).as_pointer())
        place = b.gep(first, [b.add(b.mul(index, LONG(kind.dtype.size)), LONG(found.offset))])
        return b.bitcast(place, self.context.get_value_type(found.type).as_pointer())


def _read(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    if isinstance(kind, LaneType) and name in ("lanes", "index"):
        return builder.extract_value(value, int(name == "index"))
    made = _Group(context, builder, kind, value)
    place = made.place(name)
    if place is None:
        return _field_value(context, builder, made.group.of, made.tuple, name)
    if name in made.group.parts:
        return place
    loaded = builder.load(place)
    loaded.align = 8
    return loaded


def _write(context: Any, builder: Any, signature: Any, args: Any, name: str) -> Any:
    place = _Group(context, builder, signature.args[0], args[0]).place(name)
    builder.store(args[1], place).align = 8
    return context.get_dummy_value()


for _kind in (LanesType, LaneType):
    lower_getattr_generic(_kind)(_read)
    lower_setattr_generic(_kind)(_write)


# --- slots -------------------------------------------------------------------


@type_callable(operator.getitem)
def _type_of_slot(context: Any) -> Callable[..., Any]:
    def typer(slots: Any, index: Any) -> Any:
        if not isinstance(slots, SlotsType) or not isinstance(index, types.Integer):
            return None
        if slots.length:
            return SlotsType(slots.one)
        return types.float64 if slots.one else vector_type

    return typer


@type_callable(operator.setitem)
def _type_of_set_slot(context: Any) -> Callable[..., Any]:
    def typer(slots: Any, index: Any, value: Any) -> Any:
        fits = (
            isinstance(slots, SlotsType) and not slots.length and isinstance(index, types.Integer)
        )
        wanted = types.Number if fits and slots.one else VectorType
        return types.void if fits and isinstance(value, wanted) else None

    return typer


def _slot(context: Any, builder: Any, kind: Any, slots: Any, index_type: Any, index: Any) -> Any:
    """LLVM's pointer to a slot."""
    index = context.cast(builder, index, index_type, types.int64)
    place = builder.gep(slots, [builder.mul(index, LONG(WIDTH * max(1, kind.length)))])
    return (
        place if kind.one or kind.length else builder.bitcast(place, LANES.of(DOUBLE).as_pointer())
    )


@lower_builtin(operator.getitem, SlotsType, types.Integer)  # type: ignore[untyped-decorator]
def _get_slot(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    place = _slot(context, builder, signature.args[0], args[0], signature.args[1], args[1])
    if signature.args[0].length:
        return place
    loaded = builder.load(place)
    loaded.align = 8
    return loaded


@lower_builtin(operator.setitem, SlotsType, types.Integer, types.Any)  # type: ignore[untyped-decorator]
def _set_slot(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    slots, index, value = signature.args
    number = context.cast(builder, args[2], value, types.float64) if slots.one else args[2]
    builder.store(number, _slot(context, builder, slots, args[0], index, args[1])).align = 8
    return context.get_dummy_value()


# --- groups and lanes --------------------------------------------------------


def named_tuple(cls: Any, *kinds: Any) -> Any:
    """The type of a named tuple with fields of these types."""
    same = all(kind == kinds[0] for kind in kinds)
    return types.NamedUniTuple(kinds[0], len(kinds), cls) if same else types.NamedTuple(kinds, cls)


def shared_as(kind: LanesType) -> Any:
    """A function of compiled code that gives a group's named tuple as its lanes, valid until the
    function that calls it returns; the caller of that one owns the arrays."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            place = builder.alloca(args[0].type)
        builder.store(args[0], place)
        arrays = [
            context.make_array(kind.of.types[i])(
                context, builder, builder.extract_value(args[0], i)
            )
            for i in range(2)
        ]
        value = ir.Constant(context.get_value_type(kind), ir.Undefined)
        for i, part in enumerate((*(array.data for array in arrays), place)):
            value = builder.insert_value(value, part, i)
        return value

    return intrinsic(lambda typing, group: (kind(group), code))


@intrinsic
def one(typing: Any, lanes: Any, index: Any) -> Any:
    """One lane of a group."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = builder.insert_value(
            ir.Constant(context.get_value_type(signature.return_type), ir.Undefined), args[0], 0
        )
        return builder.insert_value(
            value, context.cast(builder, args[1], signature.args[1], types.int64), 1
        )

    return LaneType(lanes)(lanes, index), code
