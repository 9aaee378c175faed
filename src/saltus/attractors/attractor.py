"""An attractor of the stroboscopic map: its kind, its states, and the share of motions that end on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.kind import AttractorKind
from saltus.orbits import PeriodicOrbit
from saltus.result import Result
from saltus.systems import System
from saltus.window import Window

if TYPE_CHECKING:
    import xarray

UNDECIDED = -1  # the label of motions that end on no known attractor
REST = 0  # the label of rest at the contact, always
SAME_STATE = 1e-6  # two states at phase 0 this near to one another count as one, relative to their size or to 1


@dataclass(frozen=True, eq=False)
class Target:
    """The states of an attractor on the stroboscopic section, phase 0 of the load: all states of an orbit, or a sample of a set
    that does not repeat."""

    label: int
    kind: AttractorKind
    states: np.ndarray  # (n, d), coordinates and velocities at phase 0

    @property
    def dense(self) -> bool:
        """Whether the states are a sample of infinitely many."""
        return self.kind not in (AttractorKind.REST, AttractorKind.PERIODIC)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.states)

    @cached_property
    def grain(self) -> float:
        """The distance within which a state counts as one of a sampled set: twice the distance within which 95 % of the sample
        have a neighbour; 0 for other sets."""
        if not self.dense:
            return 0.0
        apart, _ = self._tree.query(self.states, k=2, p=np.inf)
        return float(2.0 * np.quantile(apart[:, 1], 0.95))

    def distance(self, points: np.ndarray) -> np.ndarray:
        """The distances of states (..., d) from the attractor's nearest state, as the largest difference of a variable, (...)."""
        if self.dense:
            finite = np.isfinite(points).all(axis=-1)
            apart, _ = self._tree.query(np.where(finite[..., None], points, 0.0), p=np.inf)
            return np.where(finite, apart, np.inf)
        distance = np.full(points.shape[:-1], np.inf)
        for state in self.states:
            np.fmin(distance, np.abs(points - state).max(axis=-1), out=distance)
        return distance

    def to_dict(self) -> dict[str, Any]:
        """A dictionary that can be written as JSON."""
        return {"label": self.label, "kind": str(self.kind), "states": self.states.tolist()}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Target:
        """The inverse of `to_dict`."""
        return cls(int(data["label"]), AttractorKind(data["kind"]), np.atleast_2d(np.asarray(data["states"], dtype=float)))


@dataclass(frozen=True, eq=False)
class Attractor:
    """One attractor, with its evidence.

    Attributes
    ----------
    target
        Its label, its kind and its states at phase 0 of the load.
    highest
        The largest coordinate on it; with several coordinates the largest of all.
    lowest
        The smallest coordinate on it.
    orbit
        The orbit if it is periodic, solved by its own equations and stable by its multipliers; else None.
    starts
        The number of initial states whose motions end there.
    of
        The number of all initial states.
    mirror
        The label of its mirror image: its own if it is symmetric, UNDECIDED if the system has no mirror symmetry.
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
    def kind(self) -> AttractorKind:
        """What it is."""
        return self.target.kind

    @property
    def states(self) -> np.ndarray:
        """Its states at phase 0 of the load, (n, d)."""
        return self.target.states

    @property
    def period(self) -> int:
        """Forcing periods after which it repeats; 0 for rest and for sets that do not repeat."""
        return 0 if self.orbit is None else self.orbit.period

    @property
    def amplitude(self) -> float:
        """max abs of the coordinate."""
        return max(abs(self.highest), abs(self.lowest))

    @property
    def fraction(self) -> float:
        """p, the share of the initial states that end there; nan where none were sampled."""
        return self.starts / self.of if self.of else math.nan

    @property
    def error(self) -> float:
        """The binomial standard error of the fraction, sqrt(p (1 - p) / n).

        It is 0 if none or all of n starts end there; the true share then differs from p by less than 3 / n with a probability of
        95 %.
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

    def __repr__(self) -> str:
        what = f"period {self.period}" if self.orbit is not None else self.kind
        share = f", {100 * self.fraction:.3g} +- {100 * self.error:.2g} % of the starts" if self.of else ""
        return f"Attractor({self.label}: {what}, amplitude={self.amplitude:.9g}{share})"


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
        raise KeyError(f"no attractor {label}; there are {[member.label for member in self.members]}")

    @property
    def undecided(self) -> int:
        """The number of initial states whose motions end on none of the attractors, as far as they were followed."""
        return int((self.assigned == UNDECIDED).sum())

    @property
    def targets(self) -> tuple[Target, ...]:
        """The states of the attractors on the stroboscopic section."""
        return tuple(member.target for member in self.members)

    def to_xarray(self) -> xarray.Dataset:
        """A row for each attractor: kind, periods, fraction and its error, extrema, multipliers, points at phase 0."""
        from saltus.attractors.attractors_dataset import attractors_dataset

        return attractors_dataset(self)

    def __repr__(self) -> str:
        lines = "".join(f"\n  {member!r}" for member in self.members)
        return f"Attractors({len(self.members)} from {len(self.states)} states, {self.undecided} of them undecided{lines})"
