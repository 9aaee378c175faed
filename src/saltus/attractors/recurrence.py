"""Letting many motions settle: whether each comes to rest, repeats itself or does neither, and its states at phase 0."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import load_releases, simulate_many
from saltus.progress import silent
from saltus.systems import Load, System

if TYPE_CHECKING:
    import xarray

MOST_STATES = 1 << 22  # states at phase 0 kept at once: 67 MB, and as much again for what is made of them


@dataclass(frozen=True, eq=False)
class Ends:
    """How motions end, a row for each."""

    rest: np.ndarray  # (n,): at the contact for good, by proof or because no load ever pulls there
    cycle: np.ndarray  # (n,): forcing periods after which it repeats itself; 0 where it does not
    ended: np.ndarray  # (n,): by a margin of the model, or because it cannot go on
    periods: np.ndarray  # (n,): forcing periods until it ended
    strobes: np.ndarray  # (n, kept, 2): the states at phase 0, the last one last, nan where there were fewer

    @property
    def moving(self) -> np.ndarray:
        """Which neither rest, repeat themselves nor have ended, (n,)."""
        return ~self.rest & (self.cycle == 0) & ~self.ended


def clocked(system: System) -> System:
    """The system with a forcing period: that of its load, or under a constant load one of 2 pi, to look at it by.

    Equilibria are then orbits of period 1.

    Raises:
        ParameterError: several coordinates, or a load of records, which never repeats.
    """
    if not isinstance(system, System):
        raise ParameterError(f"attractors are those of a System(model=..., load=..., impact=...), got {system!r}")
    if len(system.model.coordinates) > 1:
        names = ", ".join(system.model.coordinates)
        raise ParameterError(f"attractors and basins are for models with one coordinate, and this one has {names}")
    for name, signal in system.load.channels.items():
        if any(type(term).__name__ == "Record" for term in getattr(signal, "terms", (signal,))):
            raise ParameterError(f"load.{name} is a Record, which does not repeat, so nothing settles under it; use Harmonic")
    if system.load.frequency is not None:
        return system
    return System(model=system.model, load=Load(frequency=1.0, **system.load.channels), impact=system.impact)


def settle(
    system: System,
    states: np.ndarray,
    periods: int,
    *,
    kept: int | None = None,
    tol: float = 1e-11,
    progress: Callable[[float], object] | None = None,
) -> Ends:
    """Follow motions from states (n, 2) at phase 0 for at most so many forcing periods, keeping the last `kept` (or all)."""
    kept = periods if kept is None else min(kept, periods)
    until = ("rest", "settled")
    follow = silent if progress is None else lambda done, _: progress(done)
    result = ensemble(system, states, periods=periods, until=until, last=kept, tol=tol, progress=follow)
    stop = stop_names(result)
    at_contact = (result["side"].values == 0) & np.isin(stop, ("horizon", "rest"))
    rest = (stop == "captured") | (at_contact & (not load_releases(system)))
    ended = ~rest & ~np.isin(stop, ("horizon", "rest", "settled"))
    cycle = np.where(rest, 0, result["recurrence_period"].values)
    return Ends(rest, cycle, ended, result["periods"].values, sampled(system, result))


def ensemble(system: System, states: np.ndarray, **options: Any) -> xarray.Dataset:
    """`simulate_many` from states (n, 2) at phase 0."""
    start: dict[str, Any] = {system.model.coordinates[0]: states[:, 0], "velocity": states[:, 1]}
    return simulate_many(system, **start, **options)


def sampled(system: System, result: xarray.Dataset) -> np.ndarray:
    """The states at phase 0 that an ensemble has kept, (n, periods, 2)."""
    return np.stack([result[f"sampled_{system.model.coordinates[0]}"].values, result["sampled_velocity"].values], axis=-1)


def stop_names(result: Any) -> np.ndarray:
    """Why each motion of an ensemble ended, as words."""
    return np.array(result["stop"].attrs["flag_meanings"].split())[result["stop"].values]
