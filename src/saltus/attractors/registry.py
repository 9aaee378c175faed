"""The registry of the attractors found so far: rest by proof, orbits by their own equations, all others by a verdict."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from saltus.attractors.attractor import SAME_STATE, UNDECIDED, Attractor, Target
from saltus.attractors.kind import AttractorKind
from saltus.attractors.orbit_certificate import solved_orbit, stays_at_rest
from saltus.attractors.stroboscopic_section import section_states
from saltus.attractors.verdict.classification import classify
from saltus.flow import Recurrence, extrema_names, motions_from, stroboscopic
from saltus.orbits import PeriodicOrbit, is_symmetric, rest_state, start_at, state_vector
from saltus.systems import System, image_of


@dataclass(frozen=True)
class RegistrySettings:
    """The numbers by which motions are assigned to attractors."""

    sample: int = 2048  # Number of stroboscopic states that represent a set that does not repeat.
    last: int = 64  # A motion belongs to such a set if the median distance of this many of its last states from it is small.
    verdict_periods: int = 4000  # Number of forcing periods for which `classify` may follow a motion that does not settle.
    # If the sum of the exponents is above minus this, areas of the state plane do not shrink, and the set attracts nothing.
    lossless: float = 1e-6
    # The largest distance, in units of SAME_STATE, between an orbit and the states of the motions that settle on it.
    beside: float = 100.0


SETTINGS = RegistrySettings()


class NoLabel(IntEnum):
    """What a motion has instead of the label of an attractor."""

    OPEN = -1  # not known yet
    FAILED = -2  # cannot be decided; the registry's `reasons` say why


@dataclass
class Registry:
    """The attractors of a system with a forcing period; the label of each is its place in the list."""

    system: System
    members: list[Attractor] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)  # why motions are undecided

    def assign(self, ends: Recurrence) -> np.ndarray:
        """The label of the attractor on which each motion ends, or a `NoLabel`, (n,)."""
        labels = np.full(len(ends), int(NoLabel.OPEN))
        for row in np.flatnonzero(ends.rest):
            labels[row] = self.add_rest(self._rest_state(ends.last[row]))
        if ends.ended.any():
            labels[ends.ended] = NoLabel.FAILED
            self.reasons.append(f"{int(ends.ended.sum())} motions are ended by a margin of the model or cannot go on")
        for period in np.unique(ends.period[ends.periodic]):
            rows = np.flatnonzero(ends.period == period)
            while rows.size:
                states = ends.states[rows[0], -period:]
                here = _cycle(states).distance(ends.states[rows, -1]) < _near(states)
                here[0] = True
                labels[rows[here]] = self._settled(states)
                rows = rows[~here]
        return labels

    def _settled(self, states: np.ndarray) -> int:
        """The label of the orbit on whose states motions have settled; FAILED where its equations have no stable solution."""
        known = self.label_of(states)
        if known is not None:
            return known
        if len(states) == 1 and stays_at_rest(self.system, states[-1]):
            return self.add_rest(states[-1])
        where = f"at {_shown(states[-1])}"
        orbit = solved_orbit(self.system, states[-1], len(states))
        if orbit is None or _cycle(states).distance(orbit.section_state) > SETTINGS.beside * _near(states):
            return self._fail(
                f"motions repeat themselves every {len(states)} periods {where}, but no orbit solves its equations there"
            )
        if not orbit.stable:
            largest = np.abs(orbit.multipliers).max()
            return self._fail(
                f"motions stay on an orbit of period {orbit.period} {where} with a multiplier of modulus {largest:.6g}"
            )
        return self.add_orbit(orbit, states[-orbit.period :])

    def _fail(self, reason: str) -> int:
        self.reasons.append(reason)
        return int(NoLabel.FAILED)

    def _rest_state(self, last: np.ndarray) -> np.ndarray:
        """The state in which a motion with this last state rests: the contact or, with several contacts or frictions, this
        state."""
        return last if self.system.model.held else rest_state(self.system)

    def add_rest(self, state: np.ndarray) -> int:
        """The label of rest in a state (d,)."""
        for member in self.members:
            if member.kind is AttractorKind.REST and np.abs(member.states[0] - state).max() < _near(state):
                return member.label
        held = state[: len(self.system.model.coordinates)]
        evidence = "proved: captured at the contact for all later loads, or at rest where no load ever pulls"
        return self._add(AttractorKind.REST, state[None], (float(held.min()), float(held.max())), evidence)

    def add_orbit(self, orbit: PeriodicOrbit, states: np.ndarray | None = None) -> int:
        """The label of a stable orbit."""
        if states is None:
            states = section_states(self.system, orbit.section_state[None], orbit.period)[0]
        known = self.label_of(states)
        if known is not None:
            return known
        largest = np.abs(orbit.multipliers).max()
        evidence = f"orbit of period {orbit.period}: residual {orbit.residual:.1g}, largest multiplier {largest:.6g}"
        return self._add(AttractorKind.PERIODIC, states, (orbit.lowest, orbit.highest), evidence, orbit)

    def _add(
        self,
        kind: AttractorKind,
        states: np.ndarray,
        extrema: tuple[float, float],
        evidence: str,
        orbit: PeriodicOrbit | None = None,
    ) -> int:
        low, high = extrema
        target = Target(len(self.members), kind, states)
        self.members.append(Attractor(target, high, low, orbit, starts=0, of=0, mirror=UNDECIDED, evidence=evidence))
        return target.label

    def label_of(self, states: np.ndarray) -> int | None:
        """The label of the orbit, or of rest, with these states at phase 0; None if it is not known."""
        for member in self.members:
            if not member.target.dense and (member.target.distance(states) < _near(states)).all():
                return member.label
        return None

    def assign_unsettled(self, ends: Recurrence, labels: np.ndarray) -> None:
        """Label the unsettled motions that move on a known sampled attractor, or within SAME_STATE of a known orbit."""
        for i in np.flatnonzero(labels == NoLabel.OPEN):
            last = ends.states[i, -SETTINGS.last :]
            for target in (member.target for member in self.members):
                apart = target.distance(last)
                if np.median(apart) < target.grain if target.dense else apart[-len(target.states) :].max() < _near(last[-1:]):
                    labels[i] = target.label
                    break

    def judge(self, state: np.ndarray, max_period: int) -> int:
        """Classify a motion that does not settle, from a state (d,): the label of its attractor, or FAILED if it has none."""
        start, longest = start_at(self.system, state), max(max_period, 16)
        verdict = classify(self.system, **start, periods=SETTINGS.verdict_periods, max_period=longest)
        if verdict.kind is AttractorKind.REST:
            return self.add_rest(self._rest_state(state_vector(self.system, verdict.state)))
        if verdict.orbit is not None and verdict.kind is AttractorKind.PERIODIC:
            return self.add_orbit(verdict.orbit)
        where = f"from {_shown(state)}"
        if verdict.kind is AttractorKind.UNDECIDED or verdict.exponents is None:
            return self._fail(f"{where}: {verdict.reason}")
        if float(verdict.exponents.values.sum()) > -SETTINGS.lossless:
            return self._fail(f"{where}: {verdict.kind}, but areas do not shrink, so nothing attracts")
        sample = motions_from(
            self.system, state[None], periods=SETTINGS.sample, sample=("state", "extrema"), last="all", tol=1e-10
        )
        high, low = (float(sample[f"overall_{name}"].values[0]) for name in extrema_names(self.system.model.coordinates))
        return self._add(verdict.kind, stroboscopic(self.system, sample)[0], (low, high), verdict.reason)

    def add_images(self) -> None:
        """Add the mirror image of every attractor of a system with that symmetry: it is an attractor as well."""
        if not is_symmetric(self.system):
            return
        for label in range(len(self.members)):
            image = self._image(self.members[label]) if self.members[label].mirror == UNDECIDED else None
            if image is not None:
                for one, other in ((label, image), (image, label)):
                    self.members[one] = replace(self.members[one], mirror=other)

    def _image(self, member: Attractor) -> int | None:
        """The label of the mirror image of an attractor."""
        states = image_of(self.system.model, section_states(self.system, member.states, 0.5)[:, 0])
        if member.target.dense:
            for other in (known.target for known in self.members if known.target.dense):
                if np.median(other.distance(states)) < other.grain:
                    return other.label
            evidence = f"mirror image of a {member.kind} one: {member.evidence}"
            return self._add(member.kind, states, (-member.highest, -member.lowest), evidence)
        known_label = self.label_of(states)
        if known_label is not None:
            return known_label
        orbit = solved_orbit(self.system, states[-1], len(states))
        return self.add_orbit(orbit) if orbit is not None and orbit.stable else None


def _cycle(states: np.ndarray) -> Target:
    return Target(0, AttractorKind.PERIODIC, states)


def _shown(state: np.ndarray) -> str:
    return f"({', '.join(f'{value:.6g}' for value in state)})"


def _near(states: np.ndarray) -> float:
    return float(SAME_STATE * max(1.0, np.abs(states).max()))
