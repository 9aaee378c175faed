"""The division of a grid into chunks."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

Index = tuple[int, ...]  # the place of a chunk along each axis
NAME = re.compile(r"[A-Za-z][\w.\-]*")  # the name of an axis, a dimension or a variable, which is a folder's name in a store
MOST_CHUNKS = 1_000_000  # the most chunks of a grid: each is a file, and all of them are looked for when a sweep begins


@dataclass(frozen=True)
class ChunkGrid:
    """A grid of `sizes` points along its axes, cut into chunks of `chunk` points along each; those at the ends may be smaller."""

    sizes: Mapping[str, int]
    chunk: Mapping[str, int]

    @property
    def grid(self) -> tuple[int, ...]:
        """The number of chunks along each axis."""
        return tuple(-(-size // self.chunk[axis]) for axis, size in self.sizes.items())

    @property
    def total(self) -> int:
        """The number of chunks."""
        return math.prod(self.grid)

    def indices(self) -> Iterator[Index]:
        """All chunks, the last axis fastest."""
        return itertools.product(*(range(n) for n in self.grid))

    def slices(self, index: Index) -> tuple[slice, ...]:
        """The points of a chunk along each axis."""
        cuts = zip(index, self.sizes.items(), strict=True)
        return tuple(slice(i * self.chunk[axis], min((i + 1) * self.chunk[axis], size)) for i, (axis, size) in cuts)
