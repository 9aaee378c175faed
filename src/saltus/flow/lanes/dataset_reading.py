"""Functions that read the dataset of an ensemble: why each motion ended, and its stroboscopic states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_dataset
from saltus.flow.motion.dataset import state_names
from saltus.public_functions import answered

if TYPE_CHECKING:
    import xarray

    from saltus.systems import System


@answered
def stop_names(dataset: xarray.Dataset) -> np.ndarray[Any, Any]:
    """Why each motion ended, in the dimensions of the ensemble; the words are those of `Stop`.

    Parameters
    ----------
    dataset
        The dataset that `simulate_many` gave.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2], periods=2)
    >>> saltus.flow.stop_names(ends)
    array(['horizon', 'horizon'], dtype='<U10')
    """
    check_dataset(dataset, "simulate_many", ("stop",))
    stop = dataset["stop"]
    return np.asarray(np.array(stop.attrs["flag_meanings"].split())[stop.values])


@answered
def stroboscopic(system: System, dataset: xarray.Dataset) -> np.ndarray[Any, Any]:
    """The states (coordinates, then velocities) at the ends of the forcing periods that were kept, in the order of time.

    The shape is that of the ensemble, then (periods, d); states are nan where a motion had fewer periods than were kept.

    Parameters
    ----------
    system
        What moved.
    dataset
        The dataset that `simulate_many` gave, with "state" among its samples.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2], periods=4, last=3)
    >>> saltus.flow.stroboscopic(system, ends).shape
    (2, 3, 2)
    """
    states = state_names(system.model.coordinates)
    check_dataset(dataset, "simulate_many with sample", [f"sampled_{name}" for name in states])
    return np.stack([dataset[f"sampled_{name}"].values for name in states], axis=-1)
