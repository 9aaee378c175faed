"""Dense output, the Taylor series of every step, the validity of a motion, by the margins along it,
and why none leads beyond.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.flow.kernel.layout import LOSSLESS
from saltus.flow.programs.compiled import contact_rows_at, program
from saltus.progress import html_table, rows_table
from saltus.systems import System, energy_gain, friction_margins

# samples in each step to find changes of sign; a step is shorter than the time scale of a margin
STEP_SAMPLES = 12
# of Ridders' method, each of which doubles the correct digits or at least halves the bracket
RIDDERS_ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class DenseOutput:
    """The steps of a motion: step i starts at `start[i]` on `side[i]` (0: at rest) and holds the
    coordinates' Taylor series.

    `series` has shape (steps, degrees of freedom, order + 2), in powers of the time since the
    step's start.
    """

    start: np.ndarray
    length: np.ndarray
    side: np.ndarray
    series: np.ndarray

    @property
    def end(self) -> float:
        """When the last step ends."""
        return float(self.start[-1] + self.length[-1])

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates and velocities, each (degrees of freedom, n), and sides (n,); at an impact,
        those after it.
        """
        step = np.clip(np.searchsorted(self.start, times, side="right") - 1, 0, None)
        tau = times - self.start[step]
        used = step
        series = self.series
        # else all steps are turned round once, in place of one for each time
        if times.size < 4 * len(self.start):
            used = np.arange(times.size)
            series = self.series[step]
        rows = np.ascontiguousarray(series.transpose(2, 1, 0))  # of one power each
        value = np.take(rows[-1], used, axis=1)
        slope = np.zeros_like(value)
        for row in rows[-2::-1]:  # Horner's scheme, differentiated
            slope *= tau
            slope += value
            value *= tau
            value += np.take(row, used, axis=1)
        return value, slope, self.side[step]

    def accelerations(self, times: np.ndarray) -> np.ndarray:
        """The second derivatives of the coordinates, (degrees of freedom, n)."""
        step = np.clip(np.searchsorted(self.start, times, side="right") - 1, 0, None)
        powers = np.arange(2, self.series.shape[2])
        return np.asarray(
            evaluate(
                self.series[step][:, :, 2:] * (powers * (powers - 1)), times - self.start[step]
            )
        )


def evaluate(coefficients: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Horner's scheme for many series at once: (n, dof, order) at (n,) gives (dof, n)."""
    value = coefficients[:, :, -1]
    for k in range(coefficients.shape[2] - 2, -1, -1):
        value = value * tau[:, None] + coefficients[:, :, k]
    return value.T


@dataclass(frozen=True)
class Validity:
    """The validity of a motion: which margins of the model it passes, and for what share of the
    time.

    Attributes
    ----------
    first
        The dimensionless time at which each margin is first passed, or None.
    share
        The share of the motion's time that is spent beyond each margin.
    gains
        The contacts at which the impact law may raise the kinetic energy, and by what share of it
        (see `energy_gain`); not known of contacts of a `distance`.
    ties
        At how many instants several answers of Coulomb's law changed equally little.
    first_tie
        The first of these times, or None.
    together
        How often contacts that act on one another closed at one instant.
    first_together
        The first of these times, or None.

    Examples
    --------
    >>> validity = saltus.simulate(system, theta=0.3, periods=1).validity
    >>> validity.first["kinematic_limit"] is None  # never passed
    True
    """

    first: dict[str, float | None]
    share: dict[str, float]
    gains: dict[str, float] = field(default_factory=dict)
    ties: int = 0
    first_tie: float | None = None
    together: int = 0
    first_together: float | None = None

    @property
    def respected(self) -> bool:
        """Whether every margin stays positive throughout, and no impact can gain energy."""
        return not self.gains and all(time is None for time in self.first.values())

    def _repr_html_(self) -> str:
        if not self.first and not self.gains and not self.not_unique():
            return html_table("Validity", {"margins": str(self)})
        rows = {
            name: "not passed" if t is None else f"passed first at {t:.6g}"
            for name, t in self.first.items()
        }
        shares = [f"{100 * self.share[name]:.3g} %" for name in self.first]
        gained = {name: self.gain(name) for name in self.gains}
        gained |= self.not_unique()
        columns = {"margin": [*rows, *gained], "motion": [*rows.values(), *gained.values()]}
        return rows_table(columns | {"share of the time": [*shares, *[""] * len(gained)]})

    def __str__(self) -> str:
        parts = [
            f"{name}: "
            + (
                "not passed"
                if t is None
                else f"passed first at {t:.6g}, {100 * self.share[name]:.3g} % of the time"
            )
            for name, t in self.first.items()
        ]
        parts += [f"impacts at {name} {self.gain(name)}" for name in self.gains]
        parts += list(self.not_unique().values())
        return "; ".join(parts) or "the model has no margins"

    def not_unique(self) -> dict[str, str]:
        """Sentences about the instants at which the laws of friction, or of impact, leave a choice;
        empty if there are none.
        """
        sentences = {}
        if self.ties:
            sentences["frictions"] = (
                f"{_instants(self.ties, self.first_tie)} several answers of Coulomb's law change "
                "equally little, and the one with the least accelerations was taken"
            )
        if self.together:
            sentences["impacts"] = (
                f"{_instants(self.together, self.first_together)} contacts that act on one another "
                "close together, and a motion beside this one, in which they close one after the "
                "other, may differ from it by much"
            )
        return sentences

    def gain(self, contact: str) -> str:
        """A sentence about the energy that impacts may gain at a contact in `gains`.

        Parameters
        ----------
        contact
            Its name.
        """
        share = 100 * self.gains[contact]
        return (
            f"may raise the kinetic energy by {share:.3g} %: v+' M v+ > v-' M v- for v+ = -E v-; a"
            " smaller transfer would not"
        )


def _instants(count: int, first: float | None) -> str:
    """At how many instants, from when on, in words."""
    return f"at time {first:.6g}" if count == 1 else f"at {count} instants, first at {first:.6g},"


class ValidityCheck:
    """Evaluates the model's margins along dense output, given in one piece or in several; their
    zeros are found to rounding.

    A margin that is passed and regained within a twelfth of one step may be missed. Times of rest
    are left out.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        side = (*system.model.sides, 1)[0]
        state: Any = (
            0.0 if len(system.model.coordinates) == 1 else (0.0,) * len(system.model.coordinates)
        )
        names = system.model.margins(0.0, state, state, state, side, system.load)
        self._first: dict[str, float | None] = dict.fromkeys(names)
        self._beyond: dict[str, float] = dict.fromkeys(names, 0.0)

    def add(self, dense: DenseOutput) -> None:
        """Evaluate the margins along the next piece of dense output."""
        moving = np.flatnonzero((dense.side != 0) & (dense.length > 0))
        if not self._first or not moving.size:
            return
        step = np.repeat(moving, STEP_SAMPLES + 1)
        tau = (dense.length[moving, None] * np.linspace(0.0, 1.0, STEP_SAMPLES + 1)).ravel()
        for name, value in _margins(self._system, dense, tau, step, _grid(dense, moving)).items():
            first, beyond = _beyond(self._system, dense, name, value, tau, step)
            self._beyond[name] += beyond
            if self._first[name] is None:
                self._first[name] = first

    def result(self, duration: float) -> Validity:
        """The validity of a motion of this duration."""
        model = self._system.model
        shares = {
            name: beyond / duration if duration else 0.0 for name, beyond in self._beyond.items()
        }
        # where contacts are held by multipliers gains are not known
        known = model.contacts and not model.has_multipliers
        gains = energy_gain(self._system.contact_model, self._system.impact) if known else {}
        return Validity(
            dict(self._first),
            shares,
            {name: gain for name, gain in gains.items() if gain > LOSSLESS},
        )


def _beyond(
    system: System,
    dense: DenseOutput,
    name: str,
    value: np.ndarray,
    tau: np.ndarray,
    step: np.ndarray,
) -> tuple[float | None, float]:
    """The first time at which a margin is negative, and the total time for which it is, from its
    samples in every step.
    """
    value = np.broadcast_to(value, tau.shape)
    left = np.arange(value.size - 1)
    right = np.arange(1, value.size)
    same = step[left] == step[right]
    left, right = left[same], right[same]
    out_left = value[left] < 0
    out_right = value[right] < 0
    spent = np.where(out_left & out_right, tau[right] - tau[left], 0.0)
    starts = np.where(out_left, dense.start[step[left]] + tau[left], np.inf)
    mixed = np.flatnonzero(out_left != out_right)
    if mixed.size:
        change = _sign_change(system, dense, name, value, tau, step, left[mixed], right[mixed])
        spent[mixed] = np.where(
            out_left[mixed], change - tau[left[mixed]], tau[right[mixed]] - change
        )
        starts[mixed] = np.where(
            out_left[mixed], starts[mixed], dense.start[step[left[mixed]]] + change
        )
    first = starts.min() if starts.size else np.inf
    return (float(first) if np.isfinite(first) else None), float(spent.sum())


def _sign_change(
    system: System,
    dense: DenseOutput,
    name: str,
    value: np.ndarray,
    tau: np.ndarray,
    step: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
) -> np.ndarray:
    """The times at which a margin changes its sign between the samples `left` and `right`, by
    Ridders' method for all at once.
    """
    low = tau[left]
    high = tau[right]
    at_low = value[left]
    at_high = value[right]
    root = low
    for _ in range(RIDDERS_ITERATIONS):
        middle = 0.5 * (low + high)
        at_middle = _margins(system, dense, middle, step[left])[name]
        spread = np.sqrt(at_middle**2 - at_low * at_high)
        shift = np.where(
            spread > 0,
            (middle - low)
            * np.sign(at_low - at_high)
            * at_middle
            / np.where(spread > 0, spread, 1.0),
            0.0,
        )
        root = np.clip(middle + shift, low, high)
        at_root = _margins(system, dense, root, step[left])[name]
        for x, at_x in ((middle, at_middle), (root, at_root)):
            inside = (x >= low) & (x <= high)
            like_low = (at_x < 0) == (at_low < 0)
            low, at_low = (
                np.where(inside & like_low, x, low),
                np.where(inside & like_low, at_x, at_low),
            )
            high, at_high = (
                np.where(inside & ~like_low, x, high),
                np.where(inside & ~like_low, at_x, at_high),
            )
    return np.asarray(root)


def _grid(dense: DenseOutput, moving: np.ndarray) -> list[np.ndarray]:
    """Coordinates, velocities and accelerations at even times of every moving step: matrix
    products, for speed.
    """
    coefficients = dense.series[moving]
    h = dense.length[moving]
    fraction = np.linspace(0.0, 1.0, STEP_SAMPLES + 1)
    state = []
    for _ in range(3):
        powers = np.arange(coefficients.shape[2])
        values = (coefficients * h[:, None, None] ** powers) @ fraction ** powers[:, None]
        state.append(values.transpose(1, 0, 2).reshape(values.shape[1], -1))
        coefficients = coefficients[:, :, 1:] * powers[1:]
    return state


def _states(dense: DenseOutput, tau: np.ndarray, step: np.ndarray) -> list[np.ndarray]:
    """Coordinates, velocities and accelerations at the times `tau` after the starts of the given
    steps.
    """
    coefficients = dense.series[step]
    state = []
    for _ in range(3):
        state.append(evaluate(coefficients, tau))
        coefficients = coefficients[:, :, 1:] * np.arange(1, coefficients.shape[2])
    return state


def _margins(
    system: System,
    dense: DenseOutput,
    tau: np.ndarray,
    step: np.ndarray,
    state: list[np.ndarray] | None = None,
) -> dict[str, Any]:
    """The model's margins at the times `tau` after the starts of the given steps, from the steps'
    own series.
    """
    theta, velocity, acceleration = _states(dense, tau, step) if state is None else state
    if len(system.model.coordinates) == 1:
        theta, velocity, acceleration = theta[0], velocity[0], acceleration[0]
    return system.model.margins(
        dense.start[step] + tau, theta, velocity, acceleration, dense.side[step], system.load
    )


def crushed(system: System, time: float, state: np.ndarray, chosen: Sequence[int]) -> str:
    """Which contacts close in on a body between them at a state, of those that are chosen, in
    words; empty if none do.
    """
    model: Any = system.model
    if len(chosen) < 2:
        return ""
    if model.has_multipliers:
        chosen = _closing_in(system, time, state, chosen)
        if not chosen:
            return ""
    elif not system.dependent or not model.close_in(time, system.load, state, chosen):
        return ""
    names = " and ".join(repr(model.contacts[i].name) for i in chosen)
    return (
        f"a body is crushed between the contacts {names} at time {time:.9g}, which leave it no room"
        " there: no motion leads beyond; ask for a shorter time"
    )


# A sum of gaps does not depend on the state up to this share of its terms.
ROUNDED = 1e-9


def _closing_in(system: System, time: float, state: np.ndarray, chosen: Sequence[int]) -> list[int]:
    """Those of the contacts with rows W of which a sum of gaps with positive weights does not
    depend on the state, and falls by what moves them."""
    from scipy.optimize import nnls

    entries, drifts, _ = contact_rows_at(
        program(system, ()), time, system.load.period or 0.0, state
    )
    w = entries[list(chosen)]
    sizes = np.linalg.norm(w, axis=1)
    if not sizes.all():
        return []
    w = w / sizes[:, None]
    weights, _ = nnls(np.vstack([w.T, np.ones(len(w))]), np.append(np.zeros(w.shape[1]), 1.0))
    closed = np.abs(weights @ w).max() < ROUNDED * weights.max(initial=0.0)
    falls = weights @ (drifts[list(chosen)] / sizes) < 0.0
    return [i for i, share in zip(chosen, weights, strict=True) if share > ROUNDED] * bool(
        closed and falls
    )


def paradox(system: System, time: float, state: tuple[Any, Any]) -> str:
    """At which contact Painleve's paradox leaves no reaction or several, in words; empty if at
    none.
    """
    if not system.model.holds_coordinates or all(
        friction.contact is None for friction in system.contact_model.frictions
    ):
        return ""
    model = system.contact_model
    gaps = {
        contact: contact.gap(state[0][model.coordinates.index(contact.coordinate)])
        for contact in model.contacts
    }
    # or just closing
    closed = {
        contact.name: contact.coordinate for contact, gap in gaps.items() if np.isclose(gap, 0.0)
    }
    free = [float(name not in closed.values()) for name in model.coordinates]
    one, other = (
        friction_margins(model, time, *state, system.load, free, [s] * len(model.frictions))
        for s in (1.0, -1.0)
    )
    for friction in (each for each in model.frictions if each.contact in closed):
        pair = np.array([one[friction.limit], other[friction.limit]]) / (
            0.5 * (one[friction.limit] + other[friction.limit])
        )
        if pair.min() <= 0.0:
            way = "forwards" if pair[0] < pair[1] else "backwards"
            return (
                f"{friction.limit} at time {time:.9g}: while {friction.name} slides {way} no"
                " reaction is possible or several are, as 1 + s mu m_nt / m_tt must be positive"
                f" and is {pair.min():.6g}, with the mass matrix m of what is free; choose a"
                " smaller coefficient or another position"
            )
    return ""
