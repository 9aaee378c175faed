"""Tuples that are passed to the functions of a kernel by their address, in numba's extension interface."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv.castgraph import Conversion
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model


class Reference(types.BaseTuple):
    """The type of a tuple that is passed by its address; passed by value, a tuple of many arrays would be hundreds of
    arguments."""

    def __init__(self, of: Any) -> None:
        super().__init__(name=f"Reference({of})")
        self.of, self.types, self.count = of, of.types, len(of)

    @property
    def mangling_args(self) -> Any:
        return self.__class__.__name__, (self.of,)

    def __len__(self) -> int:
        return self.count

    def can_convert_to(self, typing: Any, other: Any) -> Any:
        return Conversion.safe if other == self.of else None


@register_model(Reference)
class ReferenceModel(models.PrimitiveModel):
    """The address of the tuple."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager.lookup(kind.of).get_value_type().as_pointer())  # type: ignore[no-untyped-call]


@lower_builtin("static_getitem", Reference, types.IntegerLiteral)  # type: ignore[untyped-decorator]
def _referred(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """One of the tuple's values; an array is counted where arrays are."""
    place = builder.gep(args[0], [ir.IntType(32)(0), ir.IntType(32)(args[1])], inbounds=True)
    value = builder.load(place)
    if context.enable_nrt:
        context.nrt.incref(builder, signature.return_type, value)
    return value


@lower_cast(Reference, types.BaseTuple)  # type: ignore[untyped-decorator]
def _tuple_there(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    """The tuple itself, for functions that are called through pointers."""
    return builder.load(value)


@intrinsic
def by_reference(typing: Any, given: Any) -> Any:
    """A tuple as a `Reference`, valid until the function that makes it returns; the caller of that function owns the arrays."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, args[0].type)
        builder.store(args[0], place)
        return place

    return Reference(given)(given), code
