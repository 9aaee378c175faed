"""Certifying what motions end on: rest by proof, cycles by their own equations, the rest by a verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.attractors.attractor import NEAR, Attractor, Target
from saltus.attractors.stroboscopic_section import section_states
from saltus.errors import MotionError
from saltus.flow import Recurrence, motions_from, stroboscopic
from saltus.orbits import PeriodicOrbit, Problem, Signature, is_symmetric, orbit_from
from saltus.systems import System

CLOUD = 2048  # strobe points that stand for a chaotic set
VERDICT_PERIODS = 4000
OPEN, FAILED = -1, -2  # where a motion ends: not yet known; not to be decided
LOSSLESS = 1e-6  # sum of the exponents above which areas of states do not shrink: attractors have none
SPREAD = 64  # strobes of a motion that must lie on a sampled set


@dataclass
class Collection:
    """The attractors found so far; places in `targets` stand for them until they are labelled."""

    system: System
    targets: list[Target] = field(default_factory=list)
    orbits: list[PeriodicOrbit | None] = field(default_factory=list)
    ranges: list[tuple[float, float]] = field(default_factory=list)  # lowest and highest coordinate
    evidence: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    mirrors: dict[int, int] = field(default_factory=dict)

    def take(self, ends: Recurrence) -> np.ndarray:
        """The place of the attractor on which each motion ends, or OPEN, or FAILED with a reason, (n,)."""
        places = np.full(len(ends.period), OPEN)
        if ends.rest.any():
            places[ends.rest] = self.add_rest()
        self._say(ends.ended, "are ended by a margin of the model or cannot go on", places)
        for q in np.unique(ends.period[ends.period > 0]):
            rows = np.flatnonzero(ends.period == q)
            while rows.size:
                strobes = ends.states[rows[0], -q:]
                place = self._cycle(strobes)
                here = Target(0, "periodic", strobes).distance(ends.states[rows, -1]) < _near(strobes)
                here[0] = True
                places[rows[here]] = place
                rows = rows[~here]
        return places

    def _say(self, chosen: np.ndarray, what: str, places: np.ndarray) -> None:
        if chosen.any():
            places[chosen] = FAILED
            self.reasons.append(f"{int(chosen.sum())} motions {what}")

    def add_rest(self) -> int:
        """The place of rest at the contact."""
        for place, target in enumerate(self.targets):
            if target.kind == "rest":
                return place
        contact = float(self.system.model.contact)
        text = "proved: captured at the contact for all later loads, or at rest where no load ever pulls"
        return self._add(Target(0, "rest", np.array([[contact, 0.0]])), None, (contact, contact), text)

    def _cycle(self, strobes: np.ndarray) -> int:
        """The place of the attractor of a settled cycle; FAILED where its equations do not bear it out."""
        known = self.place_of(strobes)
        if known is not None:
            return known
        q, at = len(strobes), f"at ({strobes[-1, 0]:.6g}, {strobes[-1, 1]:.6g})"
        orbit = self.solved(strobes[-1], q)
        if orbit is None or Target(0, "periodic", strobes).distance(np.array(orbit.state)) > 100 * _near(strobes):
            self.reasons.append(f"motions repeat themselves every {q} periods {at}, but no orbit solves its equations there")
            return FAILED
        if not orbit.stable:
            largest = np.abs(orbit.multipliers).max()
            self.reasons.append(
                f"motions stay on an orbit of period {orbit.period} {at} with a multiplier of modulus {largest:.6g}"
            )
            return FAILED
        return self.add_orbit(orbit, strobes[-orbit.period :])

    def solved(self, state: np.ndarray, periods: int) -> PeriodicOrbit | None:
        """The orbit through a state at phase 0."""
        base = Problem(self.system, Signature((), 1))
        start = {self.system.model.coordinates[0]: float(state[0]), "velocity": float(state[1])}
        try:
            orbit = orbit_from(base, start, periods)
        except MotionError:
            return None
        return orbit if orbit is not None and orbit.admissible else None

    def add_orbit(self, orbit: PeriodicOrbit, strobes: np.ndarray | None = None) -> int:
        """The place of a stable orbit."""
        strobes = self.strobes_of(orbit) if strobes is None else strobes
        known = self.place_of(strobes)
        if known is not None:
            return known
        largest = np.abs(orbit.multipliers).max()
        text = f"orbit of period {orbit.period}: residual {orbit.residual:.1g}, largest multiplier {largest:.6g}"
        return self._add(Target(0, "periodic", strobes), orbit, (orbit.lowest, orbit.highest), text)

    def add_sampled(self, kind: str, cloud: np.ndarray, range_: tuple[float, float], evidence: str) -> int:
        """The place of a set that does not repeat, by many of its points."""
        return self._add(Target(0, kind, cloud), None, range_, evidence)

    def _add(self, target: Target, orbit: PeriodicOrbit | None, range_: tuple[float, float], evidence: str) -> int:
        self.targets.append(target)
        self.orbits.append(orbit)
        self.ranges.append((float(range_[0]), float(range_[1])))
        self.evidence.append(evidence)
        return len(self.targets) - 1

    def place_of(self, strobes: np.ndarray) -> int | None:
        """The place of the cycle, or of rest, with these strobe points; None if it is not known."""
        for place, target in enumerate(self.targets):
            if not target.dense and (target.distance(strobes) < _near(strobes)).all():
                return place
        return None

    def strobes_of(self, orbit: PeriodicOrbit) -> np.ndarray:
        """The points of an orbit at phase 0, (periods, 2)."""
        return section_states(self.system, np.array([orbit.state]), orbit.period)[0]

    def belonging(self, ends: Recurrence, places: np.ndarray) -> None:
        """Give motions that have not settled to the attractor on which, or within NEAR of which, they move."""
        for i in np.flatnonzero(places == OPEN):
            last = ends.states[i, -SPREAD:]
            for place, target in enumerate(self.targets):
                apart = target.distance(last)
                if (
                    (np.median(apart) < target.grain)
                    if target.dense
                    else (apart[-len(target.strobes) :].max() < _near(last[-1:]))
                ):
                    places[i] = place
                    break

    def judge(self, ends: Recurrence, i: int, max_period: int) -> int:
        """The place of what motion i, which does not settle, moves on, by its verdict; FAILED if there is none."""
        from saltus.attractors.verdict.classification import classify

        state = ends.states[i, -1]
        start: dict[str, Any] = {self.system.model.coordinates[0]: float(state[0]), "velocity": float(state[1])}
        verdict = classify(self.system, **start, periods=VERDICT_PERIODS, max_period=max(max_period, 16))
        if verdict.kind == "rest":
            return self.add_rest()
        if verdict.kind == "periodic" and verdict.orbit is not None:
            return self.add_orbit(verdict.orbit)
        if verdict.kind not in ("chaotic", "quasi-periodic"):
            self.reasons.append(f"from ({state[0]:.6g}, {state[1]:.6g}): {verdict.reason}")
            return FAILED
        if verdict.exponents is not None and float(verdict.exponents.values.sum()) > -LOSSLESS:
            self.reasons.append(
                f"from ({state[0]:.6g}, {state[1]:.6g}): {verdict.kind}, but areas do not shrink, so nothing attracts"
            )
            return FAILED
        cloud, range_ = self._sampled(state)
        return self.add_sampled(verdict.kind, cloud, range_, verdict.reason)

    def _sampled(self, state: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
        name = self.system.model.coordinates[0]
        sample = ("state", "extrema")
        result = motions_from(self.system, state[None], periods=CLOUD, sample=sample, last="all", tol=1e-10)
        low, high = (float(result[f"overall_{which}_{name}"].values[0]) for which in ("smallest", "largest"))
        return stroboscopic(self.system, result)[0], (low, high)

    def add_images(self) -> None:
        """Add the mirror image of every attractor of a system with that symmetry: it is an attractor as well."""
        if not is_symmetric(self.system):
            return
        for place in range(len(self.targets)):
            if place in self.mirrors:
                continue
            image = self._image(place)
            if image is not None:
                self.mirrors |= {place: image, image: place}

    def _image(self, place: int) -> int | None:
        target, (lowest, highest) = self.targets[place], self.ranges[place]
        strobes = -section_states(self.system, target.strobes, 0.5)[:, 0]
        if target.dense:
            for other, known in enumerate(self.targets):
                if known.dense and np.median(known.distance(strobes)) < known.grain:
                    return other
            text = f"mirror image of a {target.kind} one: {self.evidence[place]}"
            return self.add_sampled(target.kind, strobes, (-highest, -lowest), text)
        known_place = self.place_of(strobes)
        if known_place is not None:
            return known_place
        orbit = self.solved(strobes[-1], len(strobes))
        return self.add_orbit(orbit) if orbit is not None and orbit.stable else None

    def members(self, label_of: dict[int, int], counts: np.ndarray, of: int) -> tuple[Attractor, ...]:
        """The attractors by their labels, with how many of so many starts end on each."""
        result = []
        for place, (target, orbit, (low, high)) in enumerate(zip(self.targets, self.orbits, self.ranges, strict=True)):
            mirror = label_of.get(self.mirrors.get(place, OPEN), OPEN)
            named = Target(label_of[place], target.kind, target.strobes)
            result.append(Attractor(named, high, low, orbit, int(counts[place]), of, mirror, self.evidence[place]))
        return tuple(sorted(result, key=lambda member: member.label))


def _near(points: np.ndarray) -> float:
    return float(NEAR * max(1.0, np.abs(points).max()))
