"""Object files for WebAssembly, as LLVM writes them: their functions and data, and the places in
both that a linker fills in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum

from saltus.errors import SaltusError


class Part(IntEnum):
    """The sections of a module."""

    CUSTOM = 0
    TYPE = 1
    IMPORT = 2
    FUNCTION = 3
    TABLE = 4
    MEMORY = 5
    GLOBAL = 6
    EXPORT = 7
    ELEMENT = 9
    CODE = 10
    DATA = 11


class RelocationKind(IntEnum):
    """The kinds of places that are filled in."""

    FUNCTION = 0
    TABLE_PLACE = 1
    TABLE_PLACE_WORD = 2
    ADDRESS = 3
    SIGNED_ADDRESS = 4
    ADDRESS_WORD = 5
    TYPE = 6
    GLOBAL = 7
    TABLE = 20


WITH_ADDEND = (RelocationKind.ADDRESS, RelocationKind.SIGNED_ADDRESS, RelocationKind.ADDRESS_WORD)
# flags of symbols
LOCAL = 0x2
UNDEFINED = 0x10
EXPLICIT_NAME = 0x40
# kinds of symbols
OF_FUNCTION = 0
OF_DATA = 1
OF_SECTION = 3


@dataclass(frozen=True)
class Relocation:
    """A place to be filled in, counted from the beginning of a function or of a piece of data."""

    kind: RelocationKind
    at: int
    index: int  # of a symbol, or of a type
    addend: int


@dataclass
class CodePiece:
    """A function of an object file."""

    type: int
    body: bytes
    holes: list[Relocation] = field(default_factory=list)


@dataclass
class DataPiece:
    """A piece of data of an object file."""

    content: bytes
    align: int
    holes: list[Relocation] = field(default_factory=list)
    address: int = 0


@dataclass(frozen=True)
class Symbol:
    """What a name stands for: a function, or an offset into a piece of data, here or elsewhere."""

    kind: int
    name: str
    flags: int
    index: int
    offset: int = 0

    @property
    def defined(self) -> bool:
        """Whether it is in the same object file."""
        return not self.flags & UNDEFINED

    @property
    def public(self) -> bool:
        """Whether other object files may mean it."""
        return self.defined and not self.flags & LOCAL


# --- numbers -----------------------------------------------------------------


def unsigned(value: int, width: int = 0) -> bytes:
    """A whole number in groups of 7 bits, at least `width` of them (LEB128)."""
    out = bytearray()
    while value > 0x7F or len(out) + 1 < width:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def signed(value: int, width: int = 0) -> bytes:
    """As `unsigned`, of a number that may be negative."""
    out = bytearray()
    while not -64 <= value < 64 or len(out) + 1 < width:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value & 0x7F))


class FileSection:
    """Reads an object file from its beginning."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.at = 0

    def __bool__(self) -> bool:
        return self.at < len(self.content)

    def take(self, count: int) -> bytes:
        """The next bytes."""
        self.at += count
        return self.content[self.at - count : self.at]

    def number(self) -> int:
        """The next unsigned number."""
        value = shift = 0
        while True:
            byte = self.content[self.at]
            self.at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def signed_number(self) -> int:
        """The next signed number."""
        begin = self.at
        value = self.number()
        bits = 7 * (self.at - begin)
        return value - (1 << bits) if value >> (bits - 1) else value

    def text(self) -> str:
        """The next name."""
        return self.take(self.number()).decode()

    def limits(self) -> None:
        """Skip the limits of a memory or a table."""
        flags = self.number()
        self.number()
        if flags & 1:
            self.number()


# --- an object file ----------------------------------------------------------


class ObjectFile:
    """The parts of an object file that a module is made of."""

    def __init__(self, content: bytes) -> None:
        self.types: list[bytes] = []
        self.imported: list[str] = []  # functions
        self.functions: list[CodePiece] = []
        self.data: list[DataPiece] = []
        self.symbols: list[Symbol] = []
        reader = FileSection(content)
        kinds = list[int]()
        starts = dict[int, list[tuple[int, int, list[Relocation]]]]()
        if reader.take(8) != b"\0asm\1\0\0\0":
            raise SaltusError(
                "LLVM made no object file for WebAssembly; its version may be too old"
            )
        number = -1
        while reader:
            kind = reader.take(1)[0]
            size = reader.number()
            section, number = FileSection(reader.take(size)), number + 1
            if kind == Part.TYPE:
                self.types = list(_types(section))
            elif kind == Part.IMPORT:
                self._read_imports(section)
            elif kind == Part.FUNCTION:
                kinds = [section.number() for _ in range(section.number())]
            elif kind == Part.CODE:
                starts[number] = self._read_code(section, kinds)
            elif kind == Part.DATA:
                starts[number] = self._read_data(section)
            elif kind == Part.CUSTOM:
                name = section.text()
                if name == "linking":
                    self._read_linking(section)
                elif name.startswith("reloc."):
                    _read_holes(section, starts)

    def _read_imports(self, section: FileSection) -> None:
        for _ in range(section.number()):
            section.text()
            name = section.text()
            kind = section.take(1)[0]
            if kind == 0:
                section.number()
                self.imported.append(name)
            elif kind == 1:
                section.take(1)
                section.limits()
            elif kind == 2:
                section.limits()
            else:
                section.take(2)

    def _read_code(
        self, section: FileSection, kinds: list[int]
    ) -> list[tuple[int, int, list[Relocation]]]:
        starts = []
        for kind in kinds[: section.number()]:
            size = section.number()
            begin = section.at
            self.functions.append(CodePiece(kind, section.take(size)))
            starts.append((begin, begin + size, self.functions[-1].holes))
        return starts

    def _read_data(self, section: FileSection) -> list[tuple[int, int, list[Relocation]]]:
        starts = []
        for _ in range(section.number()):
            section.number()  # memory 0, at an address that is left open
            section.take(1)
            section.signed_number()
            section.take(1)
            size = section.number()
            begin = section.at
            self.data.append(DataPiece(section.take(size), 16))
            starts.append((begin, begin + size, self.data[-1].holes))
        return starts

    def _read_linking(self, section: FileSection) -> None:
        section.number()  # the version of the conventions
        while section:
            kind = section.take(1)[0]
            size = section.number()
            part = FileSection(section.take(size))
            if kind == 8:
                self.symbols = [self._symbol(part) for _ in range(part.number())]

    def _symbol(self, part: FileSection) -> Symbol:
        kind = part.take(1)[0]
        flags = part.number()
        defined = not flags & UNDEFINED
        if kind == OF_DATA:
            name = part.text()
            if not defined:
                return Symbol(kind, name, flags, 0)
            index = part.number()
            offset = part.number()
            part.number()
            return Symbol(kind, name, flags, index, offset)
        index = part.number()
        named = kind != OF_SECTION and (defined or flags & EXPLICIT_NAME)
        name = part.text() if named else self.imported[index] if kind == OF_FUNCTION else ""
        return Symbol(
            kind, name, flags, index - len(self.imported) if kind == OF_FUNCTION else index
        )


def _types(section: FileSection) -> Iterator[bytes]:
    for _ in range(section.number()):
        begin = section.at
        section.take(1)
        for _ in range(2):
            section.take(section.number())
        yield section.content[begin : section.at]


def _read_holes(
    section: FileSection, starts: dict[int, list[tuple[int, int, list[Relocation]]]]
) -> None:
    pieces = iter(starts.get(section.number(), []))
    begin, end, holes = next(pieces, (0, 0, []))
    for _ in range(section.number()):
        kind = RelocationKind(section.take(1)[0])
        at = section.number()
        index = section.number()
        addend = section.signed_number() if kind in WITH_ADDEND else 0
        while at >= end:
            begin, end, holes = next(pieces)
        holes.append(Relocation(kind, at - begin, index, addend))
