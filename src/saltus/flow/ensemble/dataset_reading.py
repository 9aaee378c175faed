"""What other rooms read from the dataset of an ensemble: why each motion ended, and its stroboscopic states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

    from saltus.systems import System


def stop_names(dataset: xarray.Dataset) -> np.ndarray[Any, Any]:
    """Why each motion ended, in the dimensions of the ensemble; the words are those of `Stop`."""
    stop = dataset["stop"]
    return np.array(stop.attrs["flag_meanings"].split())[stop.values]


def stroboscopic(system: System, dataset: xarray.Dataset) -> np.ndarray[Any, Any]:
    """The states (coordinate, velocity) at the ends of the forcing periods that were kept, in the order of time.

    The shape is that of the ensemble, then (periods, 2); states are nan where a motion had fewer periods than were kept.
    """
    name = system.model.coordinates[0]
    return np.stack([dataset[f"sampled_{name}"].values, dataset["sampled_velocity"].values], axis=-1)
