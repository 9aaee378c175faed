"""Impact scenarios: an impact classified by the states before and after it (paper, Table 1, erratum
16).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.catalogue.two_layer import TwoLayer

Two = tuple[float, float]


class Scenario(Enum):
    """The behaviour of the impacting layer (`impact_condition1` to `impact_condition3`).

    Examples
    --------
    >>> sorted({row.scenario.name for row in saltus.systems.table_1()})
    ['BOUNCING', 'NO_BOUNCING', 'PARTIAL_BOUNCING']
    """

    NO_BOUNCING = "no bouncing"  #: it stops
    # : it turns back, and is the only one to move, or the other one was open already
    BOUNCING = "bouncing"
    # : it turns back, and the other one, closed until then, opens
    PARTIAL_BOUNCING = "partial bouncing"


class LayerState(NamedTuple):
    """The state of both layers at one instant.

    Attributes
    ----------
    theta
        The angles (theta_1, theta_2), rad.
    velocity
        Their rates.

    Examples
    --------
    >>> saltus.systems.LayerState(theta=(0.0, -0.3), velocity=(-1.0, 0.5)).velocity
    (-1.0, 0.5)
    """

    theta: Two
    velocity: Two


class NamedImpact(NamedTuple):
    """A classified impact: the scenario, the impacting layer s (1 lower, 2 upper) and the numbers
    of deformed layers.
    """

    scenario: Scenario
    layer: int
    deformed_before: int
    deformed_after: int


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row of Table 1, its conditions in the velocities, as angles cannot jump (erratum 16)."""

    deformed_before: int
    before: str
    deformed_after: int
    after: str
    scenario: Scenario


def table_1() -> tuple[TableRow, ...]:
    """Table 1 as erratum 16 corrects it: s the impacting layer, j the other one; angles are those
    at the impact.

    Examples
    --------
    >>> [(row.before, row.after) for row in saltus.systems.table_1()][0]
    ("theta_s = 0, theta_j = 0, theta_j'(-) = 0", "theta_s'(+) = 0, theta_j'(+) != 0")
    """
    one = "theta_s = 0, theta_j = 0, theta_j'(-) = 0"
    two = "theta_s = 0, theta_j != 0"
    stops = "theta_s'(+) = 0"
    turns = "theta_s'(-) theta_s'(+) < 0"
    balance = "M_sj [theta_s'] + M_jj [theta_j'] = 0"
    return (
        TableRow(1, one, 1, f"{stops}, theta_j'(+) != 0", Scenario.NO_BOUNCING),
        TableRow(1, one, 1, f"{turns}, theta_j'(+) = 0", Scenario.BOUNCING),
        TableRow(1, one, 2, f"{turns}, theta_j'(+) != 0", Scenario.PARTIAL_BOUNCING),
        TableRow(2, two, 1, f"{stops}, {balance}", Scenario.NO_BOUNCING),
        TableRow(2, two, 2, f"{turns}, {balance}", Scenario.BOUNCING),
    )


def name_impact(
    before: LayerState, after: LayerState, *, model: TwoLayer | None = None, tolerance: float = 1e-9
) -> NamedImpact:
    """The scenario of Table 1 that leads from the state just before an impact to the one just after
    it.

    A velocity below `tolerance` times the largest one counts as zero, an angle below `tolerance`
    rad as closed. With a `model`, an impact on one layer while the other is open must keep the
    balance of `other_impulse`. An impact that stops everything, as in errata 25 outside 45 to 135
    degrees, is no bouncing with no deformed layer after it.

    Parameters
    ----------
    before, after
        The states of both layers just before the impact and just after it.
    model
        The model whose balance is compared.
    tolerance
        What counts as zero.

    Raises
    ------
    ParameterError
        Angles that jump (`controtrot`), no layer or both layers impacting, a layer that
        closes further, or a balance that is not kept.

    Examples
    --------
    >>> before = saltus.systems.LayerState((0.0, 0.0), (-1.0, 0.0))
    >>> saltus.systems.name_impact(before, saltus.systems.LayerState((0.0, 0.0), (0.5, 0.0))).scenario.value
    'bouncing'
    """
    _check_states(before, after, tolerance)
    speed = tolerance * max(1e-300, *map(abs, before.velocity), *map(abs, after.velocity))
    closing = [abs(before.theta[i]) <= tolerance and _opening(before, i) < -speed for i in (0, 1)]
    if closing[0] == closing[1]:
        which = (
            "both layers impact at once"
            if closing[0]
            else "no layer that is closed moves towards its contact"
        )
        raise ParameterError(
            f"not an impact of Table 1: {which}, at angles {before.theta} with velocities"
            f" {before.velocity}"
        )
    s = closing.index(True)
    j = 1 - s
    for i in (0, 1):
        if abs(after.theta[i]) <= tolerance and _opening(after, i) < -speed:
            raise ParameterError(
                f"layer {i + 1} would close further after the impact, with velocity"
                f" {after.velocity[i]!r}"
            )
    other_open = abs(before.theta[j]) > tolerance or _opening(before, j) > speed
    if other_open and model is not None:
        _check_balance(model, before, after, s, tolerance)
    turns = abs(after.velocity[s]) > speed
    opens = other_open or abs(after.velocity[j]) > speed
    kind = Scenario.NO_BOUNCING
    if turns:
        kind = Scenario.PARTIAL_BOUNCING if opens and not other_open else Scenario.BOUNCING
    return NamedImpact(kind, s + 1, 1 + other_open, int(turns) + int(opens))


def other_impulse(model: TwoLayer, before: LayerState, after: LayerState, layer: int) -> float:
    """The impulse on the layer j that is not hit, M_js [[theta_s']] + M_jj [[theta_j']], with s =
    `layer` (from `eomnl`).

    It is zero while layer j is open, so its velocity jumps whenever that of layer s does (M_12 is
    not zero, erratum 16); on a closed layer its contact may act too, with an impulse that opens it:
    >= 0 for j = 1, <= 0 for j = 2.

    Parameters
    ----------
    model
        The two layers.
    before, after
        The states of both layers just before the impact and just after it.
    layer
        The layer that is hit, 1 or 2.

    Examples
    --------
    >>> before = saltus.systems.LayerState((0.0, 0.0), (-1.0, 0.0))
    >>> after = saltus.systems.LayerState((0.0, 0.0), (0.5, 0.0))
    >>> round(saltus.systems.other_impulse(saltus.TwoLayer(beta0=np.pi / 4), before, after, 1), 12)  # M_12 = 0
    0.0
    """
    s = layer - 1
    j = 2 - layer
    jump = np.subtract(after.velocity, before.velocity)
    row = model.mass_matrix(before.theta)[j]
    return float(row[s] * jump[s] + row[j] * jump[j])


def _opening(state: LayerState, i: int) -> float:
    """The velocity with which layer i opens: theta_1', or -theta_2'."""
    return state.velocity[i] if i == 0 else -state.velocity[i]


def _check_states(before: LayerState, after: LayerState, tolerance: float) -> None:
    for name, state in (("before", before), ("after", after)):
        if not all(math.isfinite(value) for pair in state for value in pair):
            raise ParameterError(f"the state {name} the impact must be finite, got {state}")
        if state.theta[0] < -tolerance or state.theta[1] > tolerance:
            raise ParameterError(
                f"the state {name} the impact needs theta_1 >= 0 and theta_2 <= 0, got"
                f" {state.theta}"
            )
    if any(abs(a - b) > tolerance for a, b in zip(before.theta, after.theta, strict=True)):
        raise ParameterError(
            f"angles are continuous at an impact, got {before.theta} before and {after.theta} after"
        )


def _check_balance(
    model: TwoLayer, before: LayerState, after: LayerState, s: int, tolerance: float
) -> None:
    impulse = other_impulse(model, before, after, s + 1)
    scale = max(1e-300, *map(abs, before.velocity), *map(abs, after.velocity)) * (
        1 + model.mass_ratio
    )
    if abs(impulse) > 10 * tolerance * scale:
        raise ParameterError(
            f"layer {2 - s} is open and not hit, but its momentum changes by {impulse:.3g} (per M2"
            " l^2 / T); its velocity must jump by -M_js / M_jj times the jump of the impacting"
            " layer"
        )
