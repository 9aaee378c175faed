"""An attractor of the stroboscopic map: its kind, its states, the share of motions that end on it,
and the table of all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.stroboscopic_section import is_constant
from saltus.checks import check_count
from saltus.flow import Ending, extrema_names, state_names, unit_of
from saltus.orbits import PeriodicOrbit
from saltus.progress import html_table, rows_table
from saltus.result import Result, provenance
from saltus.systems import System, Window, driven_displacements

if TYPE_CHECKING:
    import xarray

    from saltus.systems import System

DEVIATIONS = 1.96  # standard deviations to each side of a 95 % interval


def share_interval(number: int, sample: int) -> tuple[float, float]:
    """The 95 % interval (Wilson's) of a share that is estimated from a sample; nan without a
    sample.

    Parameters
    ----------
    number
        How many of the sample were found.
    sample
        The size of the sample.

    Raises
    ------
    ParameterError
        More found than there are in the sample.

    Examples
    --------
    >>> low, high = saltus.attractors.share_interval(4, 400)
    >>> round(low, 4), round(high, 4)
    (0.0039, 0.0254)
    """
    check_count("sample", sample, 0)
    check_count("number", number, 0, sample)
    if not sample:
        return (math.nan, math.nan)
    share = number / sample
    spread = DEVIATIONS**2 / sample
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = math.sqrt(spread * (share * (1.0 - share) + 0.25 * spread)) / (1.0 + spread)
    return (max(0.0, middle - half), min(1.0, middle + half))


UNDECIDED = -1  # the label of motions that end on no known attractor
REST = 0  # the label of rest at the contact, always
# of a motion that does not settle, which lies on a set if their median distance is small; most that
# are written
LAST_STATES = 64
# two states at phase 0 this near to one another count as one, relative to their size or to natural
# units
SAME_STATE = 1e-6


@dataclass(frozen=True, eq=False)
class Target:
    """The states of an attractor on the stroboscopic section, phase 0 of the load: all states of an
    orbit, or a sample of a set that does not repeat."""

    label: int
    kind: Ending
    states: np.ndarray  # (n, d), coordinates and velocities at phase 0
    # the natural units of the state variables, (d,), in which distances are measured
    units: Any = 1.0
    # whether it is the closed curve of a cycle without a load, which has all phases of the clock
    curve: bool = False

    @property
    def dense(self) -> bool:
        """Whether the states are a sample of infinitely many."""
        return self.curve or self.kind not in (Ending.REST, Ending.PERIODIC)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.states / self.units)

    @cached_property
    def grain(self) -> float:
        """The distance within which a state counts as one of a sampled set: twice the distance
        within which 95 % of the sample have a neighbour; 0 for other sets."""
        if not self.dense:
            return 0.0
        apart, _ = self._tree.query(self.states / self.units, k=2, p=np.inf)
        return float(2.0 * np.quantile(apart[:, 1], 0.95))

    def distance(self, points: np.ndarray) -> np.ndarray:
        """The distances of states (..., d) from the attractor's nearest state, as the largest
        difference of a variable in its unit, (...).
        """
        if self.dense:
            finite = np.isfinite(points).all(axis=-1)
            apart, _ = self._tree.query(
                np.where(finite[..., None], points, 0.0) / self.units, p=np.inf
            )
            return np.where(finite, apart, np.inf)
        distance = np.full(points.shape[:-1], np.inf)
        for state in self.states:
            np.fmin(distance, np.abs((points - state) / self.units).max(axis=-1), out=distance)
        return distance

    def to_dict(self) -> dict[str, Any]:
        """A dictionary that can be written as JSON."""
        known = {"label": self.label, "kind": str(self.kind), "states": self.states.tolist()}
        return known | ({"curve": True} if self.curve else {})

    def size(self, states: np.ndarray) -> Any:
        """The largest variable of states (..., d) in natural units, at least 1, (...)."""
        return np.maximum(1.0, np.abs(states / self.units).max(axis=-1))

    @classmethod
    def from_dict(cls, data: dict[str, Any], units: Any = 1.0) -> Target:
        """The inverse of `to_dict`."""
        kind = Ending[str(data["kind"]).upper().replace("-", "_")]
        states = np.atleast_2d(np.asarray(data["states"], dtype=float))
        return cls(int(data["label"]), kind, states, units, bool(data.get("curve", False)))


@dataclass(frozen=True, eq=False)
class Attractor:
    """One attractor, with its evidence.

    Attributes
    ----------
    target
        Its label, its kind and its states at phase 0 of the load.
    highest
        The largest coordinate on it; of several coordinates the one that the load drives.
    lowest
        The smallest one.
    orbit
        The orbit if it is periodic, solved by its own equations and stable by its multipliers; else
        None.
    starts
        The number of initial states whose motions end there.
    of
        The number of all initial states.
    mirror
        The label of its mirror image: its own if it is symmetric, UNDECIDED if the system has no
        mirror symmetry.
    evidence
        The evidence for its kind.

    Examples
    --------
    >>> found = saltus.find_attractors(system, starts=16)
    >>> found.of(1).orbit.stable
    True
    """

    target: Target
    highest: float
    lowest: float
    orbit: PeriodicOrbit | None
    starts: int
    of: int
    mirror: int
    evidence: str

    @property
    def label(self) -> int:
        """Its number: 0 for rest, from 1 on for all others."""
        return self.target.label

    @property
    def kind(self) -> Ending:
        """What it is."""
        return self.target.kind

    @property
    def states(self) -> np.ndarray:
        """Its states at phase 0 of the load, (n, d)."""
        return self.target.states

    @property
    def period(self) -> Any:
        """Forcing periods after which it repeats, of a cycle without a load the time; 0 for rest and
        for sets that do not repeat.
        """
        return 0 if self.orbit is None else self.orbit.period

    @property
    def amplitude(self) -> float:
        """max abs of the coordinate; of several, of the one that the load drives."""
        return max(abs(self.highest), abs(self.lowest))

    @property
    def fraction(self) -> float:
        """p, the share of the initial states that end there; nan where none were sampled."""
        return self.starts / self.of if self.of else math.nan

    @property
    def error(self) -> float:
        """The binomial standard error of the fraction, sqrt(p (1 - p) / n).

        It is 0 if none or all of n starts end there; the true share then differs from p by less
        than 3 / n with a probability of 95 %.
        """
        return math.sqrt(self.fraction * (1.0 - self.fraction) / self.of) if self.of else math.nan

    def labelled(self, label_of: Mapping[int, int], **changes: Any) -> Attractor:
        """A copy of the attractor with other labels, its mirror image's included.

        Parameters
        ----------
        label_of
            The new label by the old one.
        changes
            Other fields to be changed.
        """
        target = replace(self.target, label=label_of[self.label])
        return replace(self, target=target, mirror=label_of.get(self.mirror, UNDECIDED), **changes)

    def in_words(self) -> str:
        """Rest, an equilibrium, a period, or the kind of what does not repeat itself."""
        if self.orbit is None:
            return str(self.kind)
        load = self.orbit.system.load
        # under a constant load the section has a period of its own, see `with_clock`
        stands = load.period is not None and is_constant(load)
        return "equilibrium" if stands else f"period {self.period:.9g}"

    def __repr__(self) -> str:
        share = (
            f", {100 * self.fraction:.3g} +- {100 * self.error:.2g} % of the starts"
            if self.of
            else ""
        )
        return f"Attractor({self.label}: {self.in_words()}, amplitude={self.amplitude:.9g}{share})"


@dataclass(frozen=True, eq=False)
class Attractors(Result):
    """The attractors that were found, by their labels, and what was searched.

    Attributes
    ----------
    system
        What moves.
    members
        The attractors.
    states
        (n, d): the initial states that were sampled.
    assigned
        (n,): the label of the attractor on which the motion from each of these ends, or UNDECIDED.
    carried
        (k,): these labels for the further states that were given as `also`.
    window
        The window of the initial states.
    seed
        The seed of the initial states.
    tol
        The error that one step might make.
    reasons
        Why motions are undecided.
    device
        The card that followed motions, or nothing.

    Examples
    --------
    >>> found = saltus.find_attractors(system, starts=16)
    >>> len(found), found.undecided
    (1, 0)
    """

    system: System
    members: tuple[Attractor, ...]
    states: np.ndarray
    assigned: np.ndarray
    carried: np.ndarray
    window: Window
    seed: int
    tol: float
    reasons: tuple[str, ...]
    device: str = ""

    def __len__(self) -> int:
        return len(self.members)

    def __iter__(self) -> Iterator[Attractor]:
        return iter(self.members)

    def of(self, label: int) -> Attractor:
        """The attractor of a label.

        Parameters
        ----------
        label
            Its label.

        Raises
        ------
        KeyError
            There is none.
        """
        for member in self.members:
            if member.label == label:
                return member
        raise KeyError(
            f"no attractor {label}; there are {[member.label for member in self.members]}"
        )

    @property
    def undecided(self) -> int:
        """The number of initial states whose motions end on none of the attractors, as far as they
        were followed.
        """
        return int((self.assigned == UNDECIDED).sum())

    @property
    def targets(self) -> tuple[Target, ...]:
        """The states of the attractors on the stroboscopic section."""
        return tuple(member.target for member in self.members)

    def to_xarray(self) -> xarray.Dataset:
        """A row for each attractor: kind, periods, fraction and its error, extrema, multipliers,
        points at phase 0.
        """
        return attractors_dataset(self)

    def _repr_html_(self) -> str:
        members = self.members
        columns = {
            "attractor": [m.label for m in members],
            "kind": [m.in_words() for m in members],
            "amplitude": [m.amplitude for m in members],
            "share of the starts": [
                f"{100 * m.fraction:.3g} +- {100 * m.error:.2g} %" if m.of else "" for m in members
            ],
            "evidence": [m.evidence for m in members],
        }
        facts = {"starts": len(self.states), "undecided": self.undecided} | self._facts()
        return html_table("Attractors", facts) + rows_table(columns)

    def __repr__(self) -> str:
        lines = "".join(f"\n  {member!r}" for member in self.members)
        return (
            f"Attractors({len(self.members)} from {len(self.states)} states, {self.undecided} "
            f"of them undecided{lines})"
        )


def attractors_dataset(found: Attractors) -> xarray.Dataset:
    """The table of the attractors, with their states at phase 0, and the initial states with the
    labels of their ends.
    """
    import xarray

    table = attractor_table(found.members, found.system)
    for i, (name, unit) in enumerate(state_units(found.system).items()):
        table[f"start_{name}"] = variable("start", found.states[:, i], unit, f"{name} at the start")
    table["end"] = variable(
        "start", found.assigned, "1", "attractor on which it ends, -1 for undecided"
    )
    attributes = about(
        found.system,
        "attractors",
        tol=found.tol,
        seed=found.seed,
        window=np.ravel(found.window).tolist(),
        plane=list(state_plane(found.system)),
        undecided=found.undecided,
        reasons=list(found.reasons),
        **({"device": found.device} if found.device else {}),
    )
    return xarray.Dataset(table, {"attractor": labels(found.members)}, attributes)


def variable(dims: str | tuple[str, ...], values: Any, unit: str, text: str) -> Any:
    """A variable with its unit and its name in words, as xarray takes it."""
    return dims, values, {"units": unit, "long_name": text}


def about(system: System, kind: str, **numbers: Any) -> dict[str, Any]:
    """The attributes of a dataset: what it holds, the kind of load, and where it comes from."""
    load = "constant" if is_constant(system.load) else "periodic"
    attributes = {
        "title": f"{kind} computed by saltus",
        "kind": kind,
        "load": load,
        "Conventions": "CF-1.8",
    }
    return attributes | provenance(system, **numbers)


def state_units(system: System) -> dict[str, str]:
    """The units of the state variables by their names; as time is dimensionless, a velocity has the
    unit of its coordinate.
    """
    names = system.model.coordinates
    return dict(
        zip(state_names(names), 2 * [system.model.unit_of(name) for name in names], strict=True)
    )


def state_plane(system: System) -> tuple[str, str]:
    """The two state variables over which attractors are drawn: the first coordinate and its
    velocity.
    """
    names = state_names(system.model.coordinates)
    return names[0], names[len(names) // 2]


def labels(members: Iterable[Attractor]) -> Any:
    """The coordinate `attractor`."""
    return (
        "attractor",
        np.array([member.label for member in members], dtype=int),
        {"long_name": "label; 0 is rest"},
    )


def attractor_columns(system: System) -> dict[str, tuple[str, str, str]]:
    """The columns of a table of attractors by their names: the property of `Attractor`, the unit
    and the text of each.
    """
    driven = driven_displacements(system)
    unit = unit_of(system, driven[0])
    high, low = extrema_names(driven)
    name = " or ".join(driven)
    return {
        "fraction": ("fraction", "1", "share of the initial states that end there"),
        "error": ("error", "1", "binomial standard error of the share"),
        "amplitude": ("amplitude", unit, f"max abs({name})"),
        high: ("highest", unit, f"the largest {name}"),
        low: ("lowest", unit, f"the smallest {name}"),
        "period": ("period", "1", "forcing periods after which it repeats, 0 where it does not"),
    }


def attractor_table(members: tuple[Attractor, ...], system: System) -> dict[str, Any]:
    """The variables over (attractor,), and those of the states at phase 0 over (attractor,
    state).
    """
    most = max([1, *(min(len(m.states), LAST_STATES) for m in members)])
    states = np.full((len(members), most, system.dimension), np.nan)
    for row, member in zip(states, members, strict=True):
        row[: len(member.states)] = member.states[:LAST_STATES, : system.dimension]
    columns: dict[str, Any] = {}
    for key, (part, units, text) in attractor_columns(system).items():
        found = [getattr(member, part) for member in members]
        # that of a cycle without a load is a time
        whole = key == "period" and not any(isinstance(value, float) for value in found)
        values = np.array(found, dtype=int if whole else float)
        columns[{"error": "fraction_error", "period": "attractor_period"}.get(key, key)] = variable(
            "attractor", values, units, text
        )
    more = {
        "attractor_kind": (
            np.array([str(m.kind) for m in members], dtype=str),
            "rest, periodic, quasi-periodic or chaotic",
        ),
        "multiplier": (
            np.array([_multiplier(m) for m in members], dtype=float),
            "largest modulus of its multipliers",
        ),
        "mirror": (np.array([m.mirror for m in members], dtype=int), "label of its mirror image"),
        "evidence": (np.array([m.evidence for m in members], dtype=str), "why it is one"),
    }
    columns |= {
        key: variable("attractor", values, "1", text) for key, (values, text) in more.items()
    }
    for i, (label, unit) in enumerate(state_units(system).items()):
        columns[f"section_{label}"] = variable(
            ("attractor", "state"), states[:, :, i], unit, f"{label} at phase 0 of the load"
        )
    return columns


def _multiplier(member: Attractor) -> float:
    return float("nan") if member.orbit is None else member.orbit.largest_multiplier
