"""The metainterface: the numbers of a cell, and its reduced model with one layer open at a time
(paper, `gov_eqn_theta_long`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from saltus.errors import ParameterError
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.contracts.model import IMAGE_ROUNDING, MarginKind, Model, OneContactModel
from saltus.systems.loads.load import Load, reversed_load
from saltus.systems.loads.signals import Constant, Signal, scaled, vanishes

BETWEEN_0_AND_PI = number_range(above=0.0, below=math.pi, unit="rad")


@dataclass(frozen=True, slots=True, kw_only=True)
class LayeredCell(Model):
    """A cell of two layers, the lower one with the index 1 and the upper one with 2, dimensionless
    (paper, `m_k_ratio`).
    """

    beta0: float = field(metadata=BETWEEN_0_AND_PI)  # angle of the undeformed cell
    damping: float = field(default=0.0, metadata=number_range(at_least=0.0))  # C
    stiffness_ratio: float = field(default=1.0, metadata=number_range(above=0.0))  # k = K1 / K2
    mass_ratio: float = field(default=0.0, metadata=number_range(at_least=0.0))  # m = M1 / M2
    dissipation_ratio: float = field(
        default=1.0, metadata=number_range(at_least=0.0)
    )  # c = C1 / C2

    dimensionless: ClassVar[bool] = True
    channels: ClassVar[tuple[str, ...]] = (
        "horizontal",
        "vertical",
        "lower_horizontal",
        "lower_vertical",
        "ground_horizontal",
        "ground_vertical",
    )

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def cell_numbers(self) -> dict[str, Any]:
        """The numbers of the cell, from which another model of it can be made."""
        return {each.name: getattr(self, each.name) for each in fields(LayeredCell)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Metainterface(LayeredCell, OneContactModel):
    """The single-degree-of-freedom metainterface (paper, `gov_eqn_theta_long`).

    theta > 0 is the lower layer open (side s = +1, P = 1), theta < 0 the upper one (s = -1, P = 0);
    dimensionless time tau:

        (1+m)^P theta'' + c^P C theta' + k^P theta =
              sin(abs(theta) + beta0) [(1+h)^P H - (1+m)^P zeta'']
          + s cos(abs(theta) + beta0) [(1+v)^P V - (1+m)^P nu'']

    The channels `horizontal`, `vertical` are H, V on the upper mass, `lower_horizontal`,
    `lower_vertical` are h H, v V on the lower one, `ground_horizontal`, `ground_vertical` the
    displacements zeta, nu of the ground.

    Margins, at which a motion may be asked to stop: `line_limit`, pi - beta0 - abs(theta)
    (`line_cond`, n = 1); `kinematic_limit`, 2 (pi - beta0) - abs(theta), where the slider closes
    again (errata 20); `reaction`, the closed layer's reaction, positive while it keeps the layer
    closed (errata 21). With the lower layer open it is -R2 = cos(2 beta0 + theta) theta'' - sin(2
    beta0 + theta) theta'^2 + (H - zeta'') sin beta0 - (V - nu'') cos beta0 >= 0. With the upper one
    open it is R1 = -cos(2 beta0 - theta) theta'' - sin(2 beta0 - theta) theta'^2 - [(1+h) H - (1+m)
    zeta''] sin beta0 - [(1+v) V - (1+m) nu''] cos beta0 >= 0, rows two and one of `eomnl`.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    damping
        C, the damping of the upper layer, at least 0.
    stiffness_ratio
        k = K1 / K2, above 0.
    mass_ratio
        m = M1 / M2, at least 0.
    dissipation_ratio
        c = C1 / C2, at least 0.
    smoothing
        B, if sgn(theta) is to be replaced by tanh(B theta / 2) (`smoothing`); None keeps the exact
        sign.

    Examples
    --------
    >>> saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1).coordinates
    ('theta',)
    """

    smoothing: float | None = field(default=None, metadata=number_range(above=0.0))

    units: ClassVar[tuple[str, ...]] = ("rad",)
    margin_kinds: ClassVar[dict[str, MarginKind]] = {
        "line_limit": MarginKind.LANDMARK,
        "kinematic_limit": MarginKind.LIMIT,
        "reaction": MarginKind.ASSUMPTION,
    }

    def __post_init__(self) -> None:
        LayeredCell.__post_init__(self)
        ratios = (self.stiffness_ratio, self.mass_ratio, self.dissipation_ratio)
        if self.smoothing is not None and ratios != (1.0, 0.0, 1.0):
            raise ParameterError(
                "smoothing is for symmetric layers only (stiffness_ratio 1, mass_ratio 0,"
                " dissipation_ratio 1); drop it to compute the exact motion of unequal ones",
                "smoothing",
            )

    def check_load(self, load: Load) -> None:
        """Refuse loads on the lower layer with a smoothed sign, which makes no difference between
        the layers (errata 18).
        """
        for name in ("lower_horizontal", "lower_vertical"):
            if self.smoothing is not None and not vanishes(load.channels.get(name, Constant(0.0))):
                raise ParameterError(
                    f"load.{name} cannot act with smoothing, which is for symmetric systems; drop"
                    " one of them",
                    f"load.{name}",
                )

    @property
    def sides(self) -> tuple[int, ...]:
        """Two sides, or none if the sign is smoothed."""
        return (1, -1) if self.smoothing is None else ()

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """theta'' of `gov_eqn_theta_long`, with `side` or, with `smoothing`, tanh(B theta / 2) in
        place of sgn(theta).
        """
        if self.smoothing is None:
            lower = (1 + side) / 2
            sign = side
            size = abs(theta)
        else:
            lower = 0.0
            sign = np.tanh(theta * (self.smoothing / 2))
            size = theta * sign
        mass = 1 + self.mass_ratio * lower
        damping = self.damping * (1 + (self.dissipation_ratio - 1) * lower)
        stiffness = 1 + (self.stiffness_ratio - 1) * lower
        across, along = self._forces(t, lower, load)
        push = np.sin(size + self.beta0) * across + sign * (np.cos(size + self.beta0) * along)
        return (push - damping * velocity - stiffness * theta) / mass

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """T / K2 of `kin_eng` with the other layer closed (errata 5): with x' = zeta' + theta'
        sin(beta0 + abs(theta)), y' = nu' + s theta' cos(beta0 + abs(theta)), (1+m)/2 (x'^2 + y'^2)
        on the lower layer and m/2 (zeta'^2 + nu'^2) + (x'^2 + y'^2)/2 on the upper one.
        """
        lower = (1 + side) / 2
        m = self.mass_ratio
        zeta = load.ground_horizontal.velocity(t)
        nu = load.ground_vertical.velocity(t)
        angle = self.beta0 + side * theta
        x = zeta + velocity * np.sin(angle)
        y = nu + side * velocity * np.cos(angle)
        return (1 + m * lower) / 2 * (x * x + y * y) + m * (1 - lower) / 2 * (zeta * zeta + nu * nu)

    def inelastic_factor(self, side: Any) -> Any:
        """-cos(2 beta0) from lower to upper, -cos(2 beta0) / (1+m) back, and 0 outside 45 to 135
        degrees (errata 25).
        """
        mass = 1 + self.mass_ratio * (1 - side) / 2
        return np.maximum(-np.cos(2 * self.beta0), 0.0) / mass

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load
    ) -> dict[str, Any]:
        """The straight line, the kinematic limit and the closed layer's reaction; all positive in
        the mechanism.
        """
        opening = math.pi - self.beta0
        size = (
            side * theta
            if self.smoothing is None
            else theta * np.tanh(theta * (self.smoothing / 2))
        )
        margins = {"line_limit": opening - size, "kinematic_limit": 2 * opening - size}
        if self.smoothing is None:
            across, along = self._forces(t, (1 - side) / 2, load)
            angle = 2 * self.beta0 + size
            margins["reaction"] = (
                side * (np.cos(angle) * acceleration)
                - np.sin(angle) * (velocity * velocity)
                + side * across * np.sin(self.beta0)
                - along * np.cos(self.beta0)
            )
        return margins

    def mirror(self, load: Load) -> Load | None:
        """The load with every horizontal channel reversed, for k = c = 1+m = 1+h = 1+v (errata 18);
        None otherwise.
        """
        ratio = 1 + self.mass_ratio
        channels = load.channels
        same = all(
            math.isclose(of_layers, ratio, rel_tol=IMAGE_ROUNDING)
            for of_layers in (self.stiffness_ratio, self.dissipation_ratio)
        )
        if not same or not all(
            _proportional(channels.get(f"lower_{name}"), channels.get(name), self.mass_ratio)
            for name in ("horizontal", "vertical")
        ):
            return None
        return reversed_load(load, "horizontal")

    def _forces(self, t: Any, lower: Any, load: Load) -> tuple[Any, Any]:
        """[(1+h)^P H - (1+m)^P zeta''] and [(1+v)^P V - (1+m)^P nu''], with P = `lower`."""
        mass = 1 + self.mass_ratio * lower
        across = (
            load.horizontal(t)
            + lower * load.lower_horizontal(t)
            - mass * load.ground_horizontal.acceleration(t)
        )
        along = (
            load.vertical(t)
            + lower * load.lower_vertical(t)
            - mass * load.ground_vertical.acceleration(t)
        )
        return across, along


def _proportional(lower: Signal | None, upper: Signal | None, ratio: float) -> bool:
    """Whether the lower load is `ratio` times the upper one; a channel that is not named is 0."""
    if lower is None or vanishes(lower):
        return ratio == 0.0 or upper is None or vanishes(upper)
    return upper is not None and lower == scaled(upper, ratio)
