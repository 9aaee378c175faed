"""The results of a sweep in memory, with the interface of a store."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from saltus.sweep.chunk_grid import Index
from saltus.sweep.chunk_results import Arrays, Failure
from saltus.sweep.plan import Plan

if TYPE_CHECKING:
    import xarray


class MemoryResults:
    """The arrays of a plan, in memory; see `saltus.sweep.store.Store`."""

    path = None

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.arrays = {name: np.full(plan.shape(name), v.fill, dtype=v.dtype) for name, v in plan.variables.items()}

    def missing(self) -> list[Index]:
        """All chunks."""
        return list(self.plan.chunks.indices())

    def write(self, index: Index, values: Arrays) -> None:
        """Keep a chunk."""
        cut = self.plan.chunks.slices(index)
        for name, array in self.arrays.items():
            array[cut] = values[name]

    def note(self, failures: Iterable[Failure]) -> None:
        """Do nothing: in memory, nobody could read a list of failures while the sweep runs."""

    def dataset(self) -> xarray.Dataset:
        """The dataset of all chunks that were computed."""
        import xarray

        variables = {
            name: (self.plan.dimensions(name), array, self.plan.variables[name].attrs) for name, array in self.arrays.items()
        }
        axes = {name: (name, values.copy()) for name, values in self.plan.axes.items()}
        return xarray.Dataset(variables, coords=axes, attrs=self.plan.attributes)
