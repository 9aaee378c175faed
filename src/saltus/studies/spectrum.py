"""Response spectra and bifurcation diagrams: every periodic orbit that a search finds, followed along one parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError
from saltus.orbits import (
    Branch,
    PeriodicOrbit,
    Search,
    SpecialPoint,
    continue_orbit,
    defects,
    same_orbit,
    search_orbits,
    switch_branch,
)
from saltus.orbits.branch import STEP, check_bounds
from saltus.orbits.search import REGION
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

VALUES = 25  # of the parameter at which is searched
STARTS = 48  # initial states at each
FOLLOWED = 20.0  # times the range's upper end: how far families of a longer period are followed
MOST_BRANCHES = 60
SAME_PLACE = 1e-6  # between special points of two branches that are one
KEPT_ROUNDS = 20  # periods for which a stable orbit must stay where it is


def response_spectrum(
    system: System,
    path: str = "load.frequency",
    bounds: tuple[float, float] = (0.1, 3.0),
    **options: Any,
) -> xarray.DataTree:
    """All branches of periodic orbits along the forcing frequency that a search finds: `diagram` says how.

    The paper's Figs. 9 and 10. Options are those of `diagram`.
    """
    return diagram(system, path, bounds, **options)


def bifurcation_diagram(
    system: System,
    path: str = "load.horizontal.amplitude",
    bounds: tuple[float, float] = (0.0, 3.0),
    **options: Any,
) -> xarray.DataTree:
    """All branches of periodic orbits along a load's amplitude that a search finds: `diagram` says how.

    The paper's Figs. 11 to 13. Options are those of `diagram`.
    """
    return diagram(system, path, bounds, **options)


def diagram(
    system: System,
    path: str,
    bounds: tuple[float, float],
    *,
    max_period: int = 6,
    values: Iterable[float] | None = None,
    starts: int = STARTS,
    region: tuple[float, float] = REGION,
    seed: int = 0,
    repelling: int = 1,
    switch: bool = True,
    step: float = STEP,
    progress: Callable[[float, str], object] | None = None,
) -> xarray.DataTree:
    """Search, follow, switch and confirm.

    At each of `values` (25 by default) motions from `starts` states settle; every orbit on which they do, and those of up to
    `repelling` forcing periods that repel, is followed along the parameter unless a branch goes through it already. At every
    PD and BPC the new branch is followed too, up to `max_period` forcing periods. Families of more than one forcing period are
    followed beyond the bounds, to where they close or end. Every orbit is confirmed by the event-driven flow over a period, the
    stable ones over 20.

    Args:
        system: what moves.
        path: dotted path of the parameter.
        bounds: its range.
        max_period: the longest period, in forcing periods.
        values, starts, region, seed: where is searched, see `search_orbits`.
        repelling: up to which period repelling orbits are searched for.
        switch: whether branches are followed that are born at special points.
        step: the longest step along a branch.
        progress: called with the fraction done and what is being done.

    Returns:
        A DataTree: the search in the attributes; `branch_000`, ... (see `orbits/dataset.py`, with `defect` after a period and,
        for stable orbits, `kept` after 20); `attractors`, what simulation settled on; `bands`, empty until chaos is classified.

    Raises:
        ParameterError: an argument without meaning.
    """
    low, high = check_bounds(bounds)
    if not isinstance(system, System):
        raise ParameterError(f"a diagram takes a System(model=..., load=..., impact=...), got {system!r}")
    say = progress or (lambda share, what: None)
    if values is None:
        grid = np.linspace(low, high, VALUES + 2)[1:-1]
    else:
        grid = np.asarray(list(values), dtype=float)
    say(0.0, "searching")
    found = search_orbits(
        system.with_({path: 0.5 * (low + high)}),
        path,
        grid,
        longest=max_period,
        starts=starts,
        region=region,
        seed=seed,
        repelling=repelling,
        progress=lambda share: say(0.4 * share, "searching"),
    )
    atlas = _Atlas(path, (low, high), max_period, step, switch, say)
    for i, orbit in enumerate(sorted(found.orbits, key=lambda o: (o.periods, not o.stable))):
        atlas.add(orbit)
        say(0.4 + 0.5 * (i + 1) / len(found.orbits), f"following, {len(atlas.branches)} branches")
    say(0.9, "confirming")
    tree = _tree(system, atlas, found, max_period)
    say(1.0, "done")
    return tree


@dataclass
class _Atlas:
    """The branches known so far."""

    path: str
    bounds: tuple[float, float]
    max_period: int
    step: float
    switch: bool
    say: Callable[[float, str], object]
    branches: list[Branch] = field(default_factory=list)

    def add(self, orbit: PeriodicOrbit) -> None:
        """Follow an orbit, and what is born on its branch, unless it lies on a known one."""
        if len(self.branches) >= MOST_BRANCHES or self._known(orbit):
            return
        self._keep(continue_orbit(orbit, self.path, self._range(orbit.periods), step=self.step))

    def _keep(self, branch: Branch) -> None:
        waiting = [branch]
        while waiting and len(self.branches) < MOST_BRANCHES:
            branch = waiting.pop(0)
            self.branches.append(branch)
            for special in branch.special if self.switch else ():
                if self._is_born_at(special) and len(self.branches) < MOST_BRANCHES:
                    longer = special.orbit.periods * (2 if special.kind == "PD" else 1)
                    waiting += switch_branch(special, self._range(longer), step=self.step, both=False)

    def _is_born_at(self, special: SpecialPoint) -> bool:
        """Whether a branch that has not been followed begins at a special point within the bounds."""
        if special.kind not in ("PD", "BPC") or not self.bounds[0] <= special.parameter <= self.bounds[1]:
            return False
        longer = special.orbit.periods * (2 if special.kind == "PD" else 1)
        if longer > self.max_period:
            return False
        return not any(
            branch.points[i].orbit.periods == longer
            and any(
                abs(place - special.parameter) < SAME_PLACE * max(1.0, abs(special.parameter))
                for place in (branch.points[i].parameter, branch.points[-1 - i].parameter)
            )
            for branch in self.branches
            for i in (0,)
            if branch.origin.startswith(special.kind) or special.kind in branch.ends[0] + branch.ends[1]
        )

    def _range(self, periods: int) -> tuple[float, float]:
        """How far a family is followed: where the range ends, or beyond for those that may be loops."""
        low, high = self.bounds
        return (low, high) if periods == 1 else (low, FOLLOWED * high if high > 0 else high)

    def _known(self, orbit: PeriodicOrbit) -> bool:
        value = float(orbit.solution.values[0])
        return any(
            same_orbit(orbit, other)
            for branch in self.branches
            if branch.parameters.min() <= value <= branch.parameters.max()
            for other in branch.at(value)
        )


def _tree(system: System, atlas: _Atlas, found: Search, max_period: int) -> xarray.DataTree:
    import xarray

    import saltus

    nodes: dict[str, Any] = {}
    for i, branch in enumerate(sorted(atlas.branches, key=lambda b: (b.points[0].orbit.periods, -len(b.points)))):
        nodes[f"branch_{i:03d}"] = _confirmed(branch)
    dots = found.settled
    nodes["attractors"] = xarray.Dataset(
        {
            "parameter": ("dot", dots.value, {"long_name": atlas.path}),
            "amplitude": ("dot", dots.amplitude),
            "highest": ("dot", dots.highest),
            "lowest": ("dot", dots.lowest),
            "periods": ("dot", dots.periods),
        }
    )
    nodes["bands"] = xarray.Dataset({"low": ("band", np.empty(0)), "high": ("band", np.empty(0)), "kind": ("band", np.empty(0, "U2"))})
    searched = xarray.Dataset(
        {
            "value": ("value", found.values),
            "unsettled": ("value", found.unsettled),
            "at_rest": ("value", found.at_rest),
        }
    )
    nodes["search"] = searched.rename({"value": "searched"}) if "value" in searched.dims else searched
    root = xarray.Dataset(
        attrs={
            "system": system.to_json(),
            "path": atlas.path,
            "coordinate": system.model.coordinates[0],
            "bounds": list(atlas.bounds),
            "max_period": max_period,
            "starts": found.starts,
            "region": list(found.region),
            "seed": found.seed,
            "complete": int(len(atlas.branches) < MOST_BRANCHES),
            "saltus": saltus.__version__,
        }
    )
    return xarray.DataTree.from_dict({"/": root, **nodes})


def _confirmed(branch: Branch) -> xarray.Dataset:
    """A branch's dataset with its orbits' distances from themselves by direct simulation."""
    data, orbits = branch.to_xarray(), branch.orbits
    stable = np.flatnonzero(data["stable"].values)
    kept = np.full(len(orbits), np.nan)
    if stable.size:
        kept[stable] = defects([orbits[i] for i in stable], KEPT_ROUNDS)
    data["defect"] = ("point", defects(orbits), {"long_name": "distance after one period, by the event-driven flow"})
    data["kept"] = ("point", kept, {"long_name": f"distance after {KEPT_ROUNDS} periods, where stable"})
    return data
