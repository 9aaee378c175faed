"""Object files for WebAssembly, which LLVM makes, linked into one module: the work of a linker, of
which a user has none.

An object file is a module with holes (the conventions are in "WebAssembly Object File Linking" of
the tool conventions of WebAssembly). It imports its memory, its table of functions and its stack
pointer, and says in its sections `linking` and `reloc.*` which places of its code and of its data
hold the number of a function, of a type or of a global, a place in the table or an address in
memory. Here all functions that are reached from those asked for are numbered, memory is laid out
(data, then the stack, then what the page puts there), and these places are filled in.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from saltus.errors import SaltusError
from saltus.web.object_files import (
    OF_FUNCTION,
    DataPiece,
    ObjectFile,
    Part,
    Relocation,
    RelocationKind,
    Symbol,
    signed,
    unsigned,
)

# bytes: no data below, for the stack, and the unit of memory
FIRST_ADDRESS = 1024
STACK = 1 << 18
PAGE = 1 << 16
SIGNED = (RelocationKind.TABLE_PLACE, RelocationKind.SIGNED_ADDRESS)
WORDS = (RelocationKind.TABLE_PLACE_WORD, RelocationKind.ADDRESS_WORD)


class Linked(NamedTuple):
    """A module that needs nothing from outside."""

    content: bytes
    table: dict[str, int]  # the places in the table of functions that the page needs as pointers
    heap: int  # the address of the first byte that is free


class Linker:
    """Collects the functions and data that are reached, and writes them into a module."""

    def __init__(self, objects: Sequence[bytes]) -> None:
        self._objects = [ObjectFile(content) for content in objects]
        self._known = {
            (symbol.kind, symbol.name): (number, symbol)
            for number, each in enumerate(self._objects)
            for symbol in each.symbols
            if symbol.public
        }
        self._types: list[bytes] = []
        self._places: dict[tuple[int, int], int] = {}  # of (object, function)
        self._chosen: list[tuple[int, int]] = []
        self._data: list[tuple[int, DataPiece]] = []
        self._table: dict[tuple[int, int], int] = {}
        self._end = FIRST_ADDRESS

    def link(self, exported: Iterable[str], pointed: Iterable[str]) -> Linked:
        """The module with the exported functions and, in its table, those of which the page needs
        the places.

        Raises
        ------
        SaltusError
            A function is nowhere.
        """
        exports = {name: self._reach(*self._function(name)) for name in exported}
        table = {name: self._pointer(*self._function(name)) for name in pointed}
        for number, index in self._chosen:  # it grows meanwhile
            self._follow(number, self._objects[number].functions[index].holes)
        heap = (self._end + 15) // 16 * 16 + STACK
        return Linked(self._module(exports, heap), table, heap)

    def _function(self, name: str) -> tuple[int, int]:
        if (OF_FUNCTION, name) not in self._known:
            raise SaltusError(f"a page has no function {name[:60]!r}, which these equations need")
        number, symbol = self._known[OF_FUNCTION, name]
        return number, symbol.index

    def _resolved(self, number: int, index: int) -> tuple[int, Symbol]:
        """The object that defines a symbol of an object, and the symbol there."""
        symbol = self._objects[number].symbols[index]
        if symbol.defined:
            return number, symbol
        if (symbol.kind, symbol.name) not in self._known:
            raise SaltusError(
                f"a page has no function {symbol.name[:60]!r}, which these equations need"
            )
        return self._known[symbol.kind, symbol.name]

    def _reach(self, number: int, index: int) -> int:
        """The number of a function in the module."""
        if (number, index) not in self._places:
            self._places[number, index] = len(self._chosen)
            self._chosen.append((number, index))
        return self._places[number, index]

    def _pointer(self, number: int, index: int) -> int:
        """The place of a function in the table; the first one stays empty, as 0 points to
        nothing.
        """
        self._reach(number, index)
        return self._table.setdefault((number, index), len(self._table) + 1)

    def _address(self, number: int, symbol: Symbol) -> int:
        data = self._objects[number].data[symbol.index]
        if not data.address:
            data.address = (self._end + data.align - 1) // data.align * data.align
            self._end = data.address + len(data.content)
            self._data.append((number, data))
            self._follow(number, data.holes)
        return data.address + symbol.offset

    def _follow(self, number: int, holes: list[Relocation]) -> None:
        """Reach all that a function or a piece of data refers to."""
        for hole in holes:
            self._value(number, hole)

    def _value(self, number: int, hole: Relocation) -> int:
        """What is put into a place."""
        if hole.kind == RelocationKind.TYPE:
            return self._type(self._objects[number].types[hole.index])
        # there is one of each: the stack pointer, and the table
        if hole.kind in (RelocationKind.GLOBAL, RelocationKind.TABLE):
            return 0
        owner, symbol = self._resolved(number, hole.index)
        if hole.kind == RelocationKind.FUNCTION:
            return self._reach(owner, symbol.index)
        if hole.kind in (RelocationKind.TABLE_PLACE, RelocationKind.TABLE_PLACE_WORD):
            return self._pointer(owner, symbol.index)
        return self._address(owner, symbol) + hole.addend

    def _type(self, written: bytes) -> int:
        if written not in self._types:
            self._types.append(written)
        return self._types.index(written)

    def _filled(self, number: int, content: bytes, holes: list[Relocation]) -> bytes:
        out = bytearray(content)
        for hole in holes:
            value = self._value(number, hole)
            if hole.kind in WORDS:
                out[hole.at : hole.at + 4] = value.to_bytes(4, "little")
            else:
                out[hole.at : hole.at + 5] = (
                    signed(value, 5) if hole.kind in SIGNED else unsigned(value, 5)
                )
        return bytes(out)

    def _module(self, exports: dict[str, int], heap: int) -> bytes:
        functions = [
            (number, self._objects[number].functions[index]) for number, index in self._chosen
        ]
        kinds = [
            self._type(self._objects[number].types[function.type]) for number, function in functions
        ]
        bodies = [
            self._filled(number, function.body, function.holes) for number, function in functions
        ]
        data = [
            (each.address, self._filled(number, each.content, each.holes))
            for number, each in self._data
        ]
        pages = unsigned(-(-heap // PAGE) + 16)
        size = unsigned(len(self._table) + 1)
        places = [self._places[each] for each in self._table]
        sections = [
            (Part.TYPE, _vector(self._types)),
            (Part.FUNCTION, _vector(map(unsigned, kinds))),
            (Part.TABLE, _vector([b"\x70\0" + size])),
            (Part.MEMORY, _vector([b"\0" + pages])),
            (Part.GLOBAL, _vector([b"\x7f\1\x41" + signed(heap) + b"\x0b"])),
            (
                Part.EXPORT,
                _vector(
                    [
                        _name("memory") + b"\2\0",
                        *(_name(n) + b"\0" + unsigned(i) for n, i in exports.items()),
                    ]
                ),
            ),
            (
                Part.ELEMENT,
                _vector([b"\0\x41\1\x0b" + _vector(map(unsigned, places))] if places else []),
            ),
            (Part.CODE, _vector(unsigned(len(body)) + body for body in bodies)),
            (
                Part.DATA,
                _vector(
                    b"\0\x41" + signed(at) + b"\x0b" + unsigned(len(each)) + each
                    for at, each in data
                ),
            ),
        ]
        return b"\0asm\1\0\0\0" + b"".join(
            bytes([kind]) + unsigned(len(content)) + content for kind, content in sections
        )


def _vector(parts: Iterable[bytes]) -> bytes:
    each = list(parts)
    return unsigned(len(each)) + b"".join(each)


def _name(text: str) -> bytes:
    return unsigned(len(text.encode())) + text.encode()


def link(objects: Sequence[bytes], exported: Iterable[str], pointed: Iterable[str]) -> Linked:
    """One module of object files, see `Linker.link`."""
    return Linker(objects).link(exported, pointed)
