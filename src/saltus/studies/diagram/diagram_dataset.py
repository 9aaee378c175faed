"""A diagram as an xarray.DataTree: its branches with their orbits confirmed, and what was searched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.orbits import Branch, PeriodicOrbit, RestingOrbit, Search, defects
from saltus.provenance import provenance
from saltus.studies.diagram.bands import Bands, band_dataset
from saltus.systems import System
from saltus.theory import amplitude_limits

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class ConfirmationSettings:
    """What direct simulation must show of an orbit."""

    distance: float = 1e-8  # The distance within which a stable orbit must stay where it is.
    rounds: int = 20  # The number of its periods for which it must.
    instants: int = 64  # The number of instants of a period at which an orbit that rests is compared with itself.


CONFIRMATION = ConfirmationSettings()


def diagram_tree(
    system: System, branches: list[Branch], found: Search, bounds: tuple[float, float], chaos: Bands | None, **facts: Any
) -> xarray.DataTree:
    """The DataTree that `bifurcation_diagram` returns; `facts` are further attributes."""
    import xarray

    attributes = provenance(
        system,
        seed=found.seed,
        path=found.path,
        coordinate=system.model.coordinates[0],
        bounds=list(bounds),
        limits=_limits(system, found.path, bounds),
        starts=found.starts,
        window=np.ravel(found.window).tolist(),
        **facts,
    )
    nodes = {"/": xarray.Dataset(attrs=attributes)}
    by_length = sorted(branches, key=lambda b: (b.points[0].orbit.period, -len(b.points)))
    nodes |= {f"branch_{i:03d}": confirmed(branch) for i, branch in enumerate(by_length)}
    bands = {"bands": band_dataset()} if chaos is None else chaos.marked(turning_points(branches)).to_datasets()
    return xarray.DataTree.from_dict({**nodes, "attractors": _attractors(found), **bands, "search": _search(found)})


def _limits(system: System, path: str, bounds: tuple[float, float]) -> list[float]:
    """The amplitudes that motions of the mechanism do not pass, rad; none where they vary with the parameter of the diagram."""
    low, high = ([float(limit.value) for limit in amplitude_limits(system, {path: value})] for value in bounds)
    return low if low == high else []


def turning_points(branches: list[Branch]) -> list[tuple[str, float]]:
    """The special points at which motions lose their stability or end: kind and parameter."""
    found = []
    for branch in branches:
        places = {id(point): i for i, point in enumerate(branch.points)}
        for special in branch.special:
            i = places.get(id(special.point))
            beside = [] if i is None else [branch.points[j].orbit.stable for j in (i - 1, i + 1) if 0 <= j < len(branch.points)]
            if any(beside) and not (len(beside) == 2 and all(beside)):
                found.append((special.kind, special.parameter))
    return found


def confirmed(branch: Branch) -> xarray.Dataset:
    """A branch's dataset with its orbits' distances from themselves by direct simulation (`kept`: 20 periods, if stable).

    An orbit that its multipliers call stable, but that does not stay where it is, is not called so; `unconfirmed` counts these.
    """
    data, orbits = branch.to_xarray(), branch.orbits
    stable = np.flatnonzero(data["stable"].values)
    kept = np.full(len(orbits), np.nan)
    if stable.size:
        kept[stable] = _distances([orbits[i] for i in stable], CONFIRMATION.rounds)
    lost = ~(kept[stable] < CONFIRMATION.distance)
    data["stable"][stable[lost]] = 0
    data.attrs["unconfirmed"] = int(lost.sum())
    data["defect"] = ("point", _distances(orbits, 1), {"long_name": "distance after one period, by the event-driven flow"})
    data["kept"] = ("point", kept, {"long_name": f"distance after {CONFIRMATION.rounds} periods, where stable"})
    return data


def _distances(orbits: list[PeriodicOrbit], rounds: int) -> np.ndarray:
    """The distance of each orbit from itself after `rounds` of its periods, by the event-driven flow."""
    resting = [orbit for orbit in orbits if isinstance(orbit, RestingOrbit)]
    return np.array([_moved(orbit, rounds) for orbit in resting]) if resting else defects(orbits, rounds)


def _moved(orbit: RestingOrbit, rounds: int) -> float:
    """The largest distance, at 64 instants of a period: at the release itself all orbits that rest are in the same state."""
    motion = orbit.motion((rounds + 1) * orbit.period)
    times = motion.start + orbit.duration * (np.arange(CONFIRMATION.instants) + 0.5) / CONFIRMATION.instants
    now, later = motion.at(times), motion.at(times + rounds * orbit.duration)
    return float(np.abs(np.asarray(now) - np.asarray(later)).max())


def _attractors(found: Search) -> xarray.Dataset:
    """What motions settled on, a dot for each at each value."""
    import xarray

    texts = {"parameter": found.path, "period": "forcing periods after which it repeats"}
    dots = {name: getattr(found.settled, name) for name in ("amplitude", "highest", "lowest", "period")}
    columns = {"parameter": found.settled.value} | dots
    return xarray.Dataset(
        {name: ("dot", values, {"long_name": texts[name]} if name in texts else {}) for name, values in columns.items()}
    )


def _search(found: Search) -> xarray.Dataset:
    """The values at which orbits were searched for, and how many of the motions led to no orbit."""
    import xarray

    unsettled = {"long_name": "motions that did not settle: slow, of a longer period, or chaotic"}
    columns = {
        "unsettled": ("searched", found.unsettled, unsettled),
        "at_rest": ("searched", found.at_rest, {"long_name": "motions that came to rest"}),
    }
    return xarray.Dataset(columns, coords={"searched": ("searched", found.values, {"long_name": found.path})})
