"""A diagram as an xarray.DataTree: its branches with their orbits confirmed, and what was searched."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.branch_tables import branch_tables
from saltus.flow import state_names
from saltus.orbits import Branch, PeriodicOrbit, RestingOrbit, closing_rows
from saltus.provenance import provenance
from saltus.studies.diagram.attractors_found import Place
from saltus.studies.diagram.band_edges import explained
from saltus.studies.diagram.bands import band_dataset
from saltus.studies.diagram.diagram_search import DiagramSearch
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.systems import System
from saltus.theory import amplitude_limits

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class ConfirmationSettings:
    """What direct simulation must show of an orbit."""

    distance: float = 1e-8  # A stable orbit must come back to itself within this distance ...
    rounds: int = 20  # ... after this number of its periods.
    instants: int = 64  # The number of instants of a period at which a resting orbit is compared with itself.


CONFIRMATION = ConfirmationSettings()


def diagram_tree(search: DiagramSearch, **facts: Any) -> xarray.DataTree:
    """The DataTree that `bifurcation_diagram` returns; `facts` are further attributes."""
    import xarray

    system, path, bounds, branches = search.system, search.path, search.bounds, search.branches.branches
    low, high = search.missed.interval
    attributes = provenance(
        system,
        seed=search.seed,
        path=path,
        coordinate=" ".join(system.model.coordinates),
        bounds=list(bounds),
        limits=_limits(system, path, bounds),
        window=np.ravel(search.window).tolist(),
        left=search.branches.left,
        **facts,
        **_effort(search) | {"values": len(search.grid), "motions": len(search.found.motions)},
        missed_share=search.missed.share,
        missed_low=low,
        missed_high=high,
        ended_share=search.missed.ended_share,
        missed=search.missed.missed,
        samples_tried=search.missed.samples,
    )
    order = sorted(range(len(branches)), key=lambda i: (branches[i].points[0].orbit.period, -len(branches[i].points)))
    nodes = {"/": xarray.Dataset(attrs=attributes), **branch_tables(confirmed([branches[i] for i in order], search.work))}
    chaos = search.chaos
    bands = {"bands": band_dataset()} if chaos is None else explained(system, chaos, branches).to_datasets()
    found = {"attractors": _attractors(search), "unplaced": _unplaced(search)}
    return xarray.DataTree.from_dict({**nodes, **found, **bands, "search": _searched(search)})


def _effort(search: DiagramSearch) -> dict[str, Any]:
    """How much was tried, as attributes; of the search for chaos only the shares of the range down to which it halved."""
    tried, chaos = asdict(search.effort), search.effort.chaos
    del tried["chaos"]
    return tried | {"chaos_step": chaos.step, "chaos_edge": chaos.edge}


def _limits(system: System, path: str, bounds: tuple[float, float]) -> list[float]:
    """The amplitudes that motions of the mechanism cannot exceed, rad; none if they vary with the parameter of the diagram."""
    low, high = ([float(limit.value) for limit in amplitude_limits(system, {path: value})] for value in bounds)
    return low if low == high else []


def confirmed(branches: list[Branch], work: DiagramWork) -> list[xarray.Dataset]:
    """The datasets of branches, with the distance by which simulated orbits miss themselves: `defect` after one period, `kept`
    after 20 periods, for stable orbits.

    An orbit with stable multipliers whose motion does not stay on it is not called stable; `unconfirmed` counts these.
    """
    found = [branch.to_xarray() for branch in branches]
    ends = np.cumsum([0, *(len(branch.orbits) for branch in branches)])
    orbits = [orbit for branch in branches for orbit in branch.orbits]
    stable = np.flatnonzero(np.concatenate([np.zeros(0), *(data["stable"].values for data in found)]))
    defect, kept = _distances(orbits, 1, work), np.full(len(orbits), np.nan)
    kept[stable] = _distances([orbits[i] for i in stable], CONFIRMATION.rounds, work)
    for data, first, last in zip(found, ends, ends[1:], strict=False):
        here = kept[first:last]
        lost = np.isfinite(here) & ~(here < CONFIRMATION.distance)
        lost |= (data["stable"].values > 0) & ~np.isfinite(here)
        data["stable"][lost] = 0
        data.attrs["unconfirmed"] = int(lost.sum())
        data["defect"] = ("point", defect[first:last], {"long_name": "distance after one period, by the event-driven flow"})
        data["kept"] = ("point", here, {"long_name": f"distance after {CONFIRMATION.rounds} periods, where stable"})
    return found


def _distances(orbits: list[PeriodicOrbit], rounds: int, work: DiagramWork) -> np.ndarray:
    """The distance of each orbit from itself after `rounds` of its periods, by the event-driven flow, all orbits in lanes."""
    result = np.empty(len(orbits))
    rests = np.array([isinstance(orbit, RestingOrbit) for orbit in orbits], dtype=bool)
    result[rests] = [_moved(orbit, rounds) for orbit in orbits if isinstance(orbit, RestingOrbit)]
    if not rests.all():
        others = [orbit for orbit, rest in zip(orbits, rests, strict=True) if not rest]
        result[~rests] = work.distances(closing_rows(others, rounds))
    return result


def _moved(orbit: RestingOrbit, rounds: int) -> float:
    """The largest distance at 64 instants of a period: at one instant, the release, all resting orbits are in the same state."""
    motion = orbit.motion((rounds + 1) * orbit.period)
    times = motion.start + orbit.duration * (np.arange(CONFIRMATION.instants) + 0.5) / CONFIRMATION.instants
    now, later = motion.at(times), motion.at(times + rounds * orbit.duration)
    return float(np.abs(np.asarray(now) - np.asarray(later)).max())


def _attractors(search: DiagramSearch) -> xarray.Dataset:
    """The attractors on which motions settled at the values of the grid, a dot each, without those of long periods that are not
    followed."""
    found = search.found
    left = np.isin(found.place[found.rows], (Place.LONGER, Place.RARE))
    shown = np.isin(found.motions.value[found.rows], search.grid) & ~left
    data = _dots(search, found.rows[shown])
    data["starts"] = ("dot", found.starts[shown], {"long_name": "motions of the simulation that have settled on it"})
    data["placed"] = ("dot", (found.place[found.rows[shown]] == Place.ON_BRANCH).astype(np.int8))
    data["placed"].attrs["long_name"] = "whether it lies on a stable part of a branch"
    return data


def _unplaced(search: DiagramSearch) -> xarray.Dataset:
    """The attractors that lie on no branch, at all values, with the reason."""
    rows = search.found.unplaced
    data, places = _dots(search, rows), search.found.place[rows]
    data["reason"] = ("dot", np.array([Place(place).name.lower() for place in places], dtype="U16"))
    data["reason"].attrs = {place.name.lower(): str(place) for place in Place}
    return data


def _dots(search: DiagramSearch, rows: np.ndarray) -> xarray.Dataset:
    """Simulated motions that repeat themselves."""
    import xarray

    motions, model = search.found.motions.only(rows), search.system.model
    angle = {"units": model.unit_of(model.coordinates[0])}
    columns: dict[str, tuple[np.ndarray, dict[str, str]]] = {
        "parameter": (motions.value, {"long_name": search.path}),
        "amplitude": (motions.amplitude, angle),
        "highest": (motions.highest, angle),
        "lowest": (motions.lowest, angle),
        "period": (motions.period, {"long_name": "forcing periods after which it repeats"}),
        "impact_count": (motions.impact_count, {"long_name": "impacts in them"}),
    }
    if model.names_its_contacts:
        columns["slowest"] = motions.slowest, angle | {"long_name": "least speed of an impact, 0 without impacts"}
    for i, name in enumerate(state_names(model.coordinates)):
        columns[name] = motions.last[:, i], angle | {"long_name": f"{name} at phase 0"}
    return xarray.Dataset({name: ("dot", *column) for name, column in columns.items()})


def _searched(search: DiagramSearch) -> xarray.Dataset:
    """The values of the grid, and how many of the motions from the starts there settled on no periodic orbit, and why."""
    import xarray

    first = search.found.motions.only(slice(0, len(search.grid) * search.effort.starts))
    outcomes = (first.unsettled, first.at_rest, first.ended)
    unsettled, at_rest, ended = (which.reshape(len(search.grid), -1).sum(axis=1) for which in outcomes)
    columns = {
        "unsettled": ("searched", unsettled, {"long_name": "motions that did not settle: slow, of a long period, or chaotic"}),
        "at_rest": ("searched", at_rest, {"long_name": "motions that came to rest"}),
        "ended": ("searched", ended, {"long_name": "motions that a limit of the model ended"}),
    }
    return xarray.Dataset(columns, coords={"searched": ("searched", search.grid, {"long_name": search.path})})
