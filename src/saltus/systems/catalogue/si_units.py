"""SI data of a cell or a block, and the dimensionless numbers that follow (paper, `timeT` to
`displ_ratio1`, `dim_less`).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from operator import mul, truediv
from typing import Any

from saltus.checks import check_number, with_answers
from saltus.errors import ParameterError
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.catalogue.metainterface import Metainterface
from saltus.systems.catalogue.oscillators import RockingBlock
from saltus.systems.catalogue.two_layer import TwoLayer
from saltus.systems.files.record_files import GRAVITY
from saltus.systems.impact_laws import ImpactLaw
from saltus.systems.loads.load import Load
from saltus.systems.loads.pulses import in_other_units
from saltus.systems.loads.signals import Record, Signal, Sum, Transient, scaled
from saltus.systems.system import System


@with_answers
class Physical:
    """Loads in SI units, made dimensionless by `units`, and back."""

    __slots__ = ()

    @property
    def units(self) -> dict[str, float]:
        """The SI value of 1 of each dimensionless quantity."""
        raise NotImplementedError

    def load(self, si: Load) -> Load:
        """The dimensionless form of a load in SI units: rad/s, N, and for the ground m, m/s or
        m/s^2; times of records in s.

        Parameters
        ----------
        si
            A load in SI units.
        """
        _notice_milliseconds(si)
        return self._convert(si, truediv, mul, -1)

    def load_in_si(self, load: Load) -> Load:
        """The inverse of `load`.

        Parameters
        ----------
        load
            A dimensionless load.
        """
        return self._convert(load, mul, truediv, 1)

    def _convert(
        self, load: Load, by_time: Callable[..., Any], by_rate: Callable[..., Any], power: int
    ) -> Load:
        """The load with times and rates converted by the unit of time, and values multiplied by the
        `power` of their unit.
        """
        units = self.units
        forces = [name for name in load.channels if not name.startswith("ground")]
        if forces and "force" not in units:
            raise ParameterError(
                f"a {type(self).__name__} has no unit of force for load.{forces[0]}",
                f"load.{forces[0]}",
            )

        def convert(signal: Signal, quantity: str) -> Signal:
            if isinstance(signal, Sum):
                return Sum(tuple(convert(term, quantity) for term in signal.terms))
            if isinstance(signal, Record):
                scale = signal.scale * units[signal.quantity] ** power
                time = by_time(signal.time, units["time"])
                return replace(signal, time=time, scale=scale)
            if isinstance(signal, Transient):
                return in_other_units(
                    signal, by_time, by_rate, units["time"], units[signal.quantity] ** power
                )
            own = getattr(signal, "quantity", quantity)  # of what is given between corners
            return scaled(signal, units[own] ** power)

        channels = {
            name: convert(signal, "displacement" if name.startswith("ground") else "force")
            for name, signal in load.channels.items()
        }
        return Load(
            frequency=None if load.frequency is None else by_rate(load.frequency, units["time"]),
            **channels,
        )


def _notice_milliseconds(load: Load) -> None:
    """Warn of long records whose samples are a second or more apart: instruments sample a hundred
    times a second, so that the times may be in milliseconds."""
    for signal in load.channels.values():
        for term in getattr(signal, "terms", (signal,)):
            if (
                isinstance(term, Record)
                and term.time.size > 100
                and term.time[-1] - term.time[0] >= term.time.size
            ):
                text = (
                    f"the samples of {term!r} are seconds apart, as times are in seconds; divide"
                    " those in milliseconds by 1000"
                )
                warnings.warn(text, UserWarning, stacklevel=2)


@with_answers
@dataclass(frozen=True, slots=True, kw_only=True)
class PhysicalCell(Physical):
    """Length, masses, rotational stiffnesses and dampings of a cell in SI units; layer 1 is the
    lower one, 2 the upper one.

    The characteristic time is T = sqrt(M2 l^2 / K2) (`timeT`), so that tau = t / T; forces are H l
    / K2 (`dim_less`), ground displacements U / l (`displ_ratio1`), the damping C = C2 T / (M2 l^2),
    all three as corrected by erratum 13; energies are per K2.

    Parameters
    ----------
    length
        l, the length of the inclined bars, m.
    upper_mass
        M2, the mass on the upper layer, kg.
    upper_stiffness
        K2, the stiffness of the upper layer's springs, N m / rad.
    lower_mass
        M1, the mass on the lower layer, kg.
    lower_stiffness
        K1, the stiffness of the lower layer's springs, N m / rad; None is K2.
    upper_damping
        C2, the damping of the upper layer, N m s / rad.
    lower_damping
        C1, the damping of the lower layer, N m s / rad; None is C2.

    Raises
    ------
    ParameterError
        A value out of range, or a lower damping without an upper one (c = C1 / C2 is then
        undefined).

    Examples
    --------
    >>> cell = saltus.PhysicalCell(length=0.1, upper_mass=0.5, upper_stiffness=2.0, upper_damping=0.01)
    >>> cell.metainterface(beta0=1.4).damping  # C2 / sqrt(M2 l^2 K2) = 0.01 / 0.1
    0.09999999999999998
    """

    length: float = field(metadata=number_range(above=0.0))
    upper_mass: float = field(metadata=number_range(above=0.0))
    upper_stiffness: float = field(metadata=number_range(above=0.0))
    lower_mass: float = field(default=0.0, metadata=number_range(at_least=0.0))
    lower_stiffness: float | None = field(default=None, metadata=number_range(above=0.0))
    upper_damping: float = field(default=0.0, metadata=number_range(at_least=0.0))
    lower_damping: float | None = field(default=None, metadata=number_range(at_least=0.0))

    def __post_init__(self) -> None:
        for name, twin in (
            ("lower_stiffness", "upper_stiffness"),
            ("lower_damping", "upper_damping"),
        ):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(self, twin))
        settle_numbers(self)
        if self.upper_damping == 0.0 and self.lower_damping != 0.0:
            raise ParameterError(
                f"lower_damping is {self.lower_damping!r} but upper_damping is 0, so the ratio C1 /"
                " C2 has no value; give the upper hinge a small damping",
                "lower_damping",
            )

    @classmethod
    def from_model(
        cls,
        model: Metainterface | TwoLayer,
        *,
        length: float,
        upper_mass: float,
        upper_stiffness: float,
    ) -> PhysicalCell:
        """The cell of this length, upper mass and upper stiffness whose dimensionless numbers are
        those of `model`.

        Parameters
        ----------
        model
            The dimensionless model.
        length
            l, the length of the inclined bars, m.
        upper_mass
            M2, kg.
        upper_stiffness
            K2, N m / rad.
        """
        for name, value in (
            ("length", length),
            ("upper_mass", upper_mass),
            ("upper_stiffness", upper_stiffness),
        ):
            check_number(name, value, above=0.0)
        upper_damping = model.damping * math.sqrt(upper_mass * length**2 * upper_stiffness)
        return cls(
            length=length,
            upper_mass=upper_mass,
            upper_stiffness=upper_stiffness,
            lower_mass=model.mass_ratio * upper_mass,
            lower_stiffness=model.stiffness_ratio * upper_stiffness,
            upper_damping=upper_damping,
            lower_damping=model.dissipation_ratio * upper_damping,
        )

    @property
    def units(self) -> dict[str, float]:
        """The SI value of 1 of each dimensionless quantity: tau = t / units["time"], H = H_2 /
        units["force"] and so on.

        T = sqrt(M2 l^2 / K2) (`timeT`), 1 / T rad/s, K2 / l (`dim_less`), l and its rates, and the
        energy K2.
        """
        time = math.sqrt(self.upper_mass * self.length**2 / self.upper_stiffness)
        return {
            "time": time,
            "frequency": 1 / time,
            "force": self.upper_stiffness / self.length,
            "displacement": self.length,
            "velocity": self.length / time,
            "acceleration": self.length / time**2,
            "energy": self.upper_stiffness,
        }

    @property
    def ratios(self) -> dict[str, float]:
        """C, k, m, c as the models name them (`m_k_ratio`, `disip_ratio`); c is 1 where nothing is
        damped.
        """
        return {
            "damping": self.upper_damping * self.units["time"] / (self.upper_mass * self.length**2),
            "stiffness_ratio": (
                (self.lower_stiffness or self.upper_stiffness) / self.upper_stiffness
            ),
            "mass_ratio": self.lower_mass / self.upper_mass,
            "dissipation_ratio": (
                (self.lower_damping or 0.0) / self.upper_damping if self.upper_damping else 1.0
            ),
        }

    def metainterface(self, beta0: float) -> Metainterface:
        """The reduced model of this cell with the angle `beta0`, rad.

        Parameters
        ----------
        beta0
            The angle of the undeformed cell, rad, in (0, pi).
        """
        return Metainterface(beta0=beta0, **self.ratios)

    def two_layer(self, beta0: float) -> TwoLayer:
        """The two-layer model of this cell with the angle `beta0`, rad.

        Parameters
        ----------
        beta0
            The angle of the undeformed cell, rad, in (0, pi).
        """
        return TwoLayer(beta0=beta0, **self.ratios)


@with_answers
@dataclass(frozen=True, slots=True, kw_only=True)
class PhysicalBlock(Physical):
    """Width, height and gravity of a rigid rocking block in SI units; half of each, so that its
    half diagonal is R.

    The block has the slenderness tan(alpha) = b / h and the frequency p = sqrt(3 g / (4 R)), so
    that tau = p t; a ground motion is zeta = 3 U / (4 R), which makes 1 of a dimensionless
    acceleration the gravity g: the block begins to rock at tan(alpha).

    Parameters
    ----------
    half_width
        b, m.
    half_height
        h, m.
    gravity
        g, m/s^2.

    Raises
    ------
    ParameterError
        A value that is not above 0.

    Examples
    --------
    >>> block = saltus.PhysicalBlock(half_width=0.3, half_height=1.5)
    >>> round(block.frequency, 4), round(block.alpha, 4)
    (2.1927, 0.1974)
    >>> pulse = saltus.HalfSine(amplitude=3.0, frequency=2 * np.pi, quantity="acceleration")  # m/s^2, rad/s
    >>> system = block.system(saltus.Load(ground_horizontal=pulse))  # with Housner's loss at impacts
    >>> motion = saltus.simulate(system, theta=0.0, duration=10.0 * block.frequency)  # 10 s
    >>> str(motion.stop), round(float(motion.impacts.time[0]) / block.frequency, 4)
    ('rest', 0.8)
    """

    half_width: float = field(metadata=number_range(above=0.0))
    half_height: float = field(metadata=number_range(above=0.0))
    gravity: float = field(default=GRAVITY, metadata=number_range(above=0.0))

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def half_diagonal(self) -> float:
        """R = sqrt(b^2 + h^2), m."""
        return math.hypot(self.half_width, self.half_height)

    @property
    def alpha(self) -> float:
        """The slenderness angle arctan(b / h), rad."""
        return math.atan2(self.half_width, self.half_height)

    @property
    def frequency(self) -> float:
        """p = sqrt(3 g / (4 R)), rad/s."""
        return math.sqrt(0.75 * self.gravity / self.half_diagonal)

    @property
    def units(self) -> dict[str, float]:
        """The SI value of 1 of each dimensionless quantity: tau = t / units["time"], zeta = U /
        units["displacement"] and so on.

        1 / p, p, 4 R / 3 and its rates, of which the acceleration is g.
        """
        length = 4.0 * self.half_diagonal / 3.0
        return {
            "time": 1.0 / self.frequency,
            "frequency": self.frequency,
            "displacement": length,
            "velocity": length * self.frequency,
            "acceleration": self.gravity,
        }

    def rocking_block(self) -> RockingBlock:
        """The model of this block."""
        return RockingBlock(alpha=self.alpha)

    def system(self, si: Load, impact: ImpactLaw | None = None) -> System:
        """The dimensionless system of this block under a load in SI units.

        Parameters
        ----------
        si
            A load in SI units, as `load` takes it.
        impact
            The impact law; by default Housner's, `InelasticImpact`.
        """
        return System(
            model=self.rocking_block(),
            load=self.load(si),
            impact=impact or RockingBlock.usual_impact,
        )
