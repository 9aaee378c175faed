"""The same system with time running backward: the exact flow of its past.

With s = -t and theta(s) its velocity is -theta'(t), and the acceleration is the same function of
the state as before:

    d2 theta / ds2 = a(-s, theta, -d theta / ds),

so damping becomes anti-damping. A load F(t) becomes F(-s): its harmonics mean + A sin(n W t + phi)
become mean + A sin(n W s + pi - phi). An impact v- -> v+ = e v- is reversed: -v+ is the velocity
before and -v- = -v+ / e after it.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from saltus.errors import ParameterError
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.contracts.model import Model
from saltus.systems.impact_laws import ImpactLaw, VelocityReduction
from saltus.systems.loads.load import Load
from saltus.systems.loads.repeating import Repeating
from saltus.systems.loads.signals import Constant, Harmonic, Record, Signal, Sum
from saltus.systems.system import System, check_system

RESET_SPEEDS = (0.3, 2.0)  # speeds at which a reset is compared with its inverse


@dataclass(frozen=True, slots=True)
class VelocityGain(ImpactLaw):
    """v+ = v- / e, with e in (0, 1]: `VelocityReduction(e)` reversed in time."""

    e: float = field(default=1.0, metadata=number_range(above=0.0, at_most=1.0))

    def __post_init__(self) -> None:
        settle_numbers(self)

    def velocity_after(
        self, model: Model, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """v- / e."""
        return velocity / self.e


def reversed_system(system: System) -> System:
    """The system whose motions are those of `system` run backward, with the same parameters by the
    same paths.

    `simulate(reversed_system(system), theta=q, velocity=-v, time=-t, duration=T)` ends at the state
    that the forward motion had a time T before it came to (q, v) at t, with the other sign of the
    velocity. Rest at the contact has no past: motions come to it from many states in a finite time,
    and a backward motion never reaches it.

    Parameters
    ----------
    system
        The system to be reversed.

    Raises
    ------
    ParameterError
        An impact law without an inverse (`VelocityReduction` with e > 0 has one), or a reset of the
        model that this law does not undo.

    Examples
    --------
    >>> saltus.systems.reversed_system(system).model.damping
    0.1
    """
    check_system(system, "reversed_system")
    impact = system.impact
    if not isinstance(impact, VelocityReduction) or impact.e <= 0.0:
        raise ParameterError(
            f"{impact!r} cannot be followed backward; only VelocityReduction(e) with e > 0 can",
            "impact",
        )
    backward = VelocityReduction(1.0) if impact.e == 1.0 else VelocityGain(impact.e)
    result = System(
        model=reversed_model(system.model), load=reversed_load(system.load), impact=backward
    )
    _check_resets(system, result)
    return result


def reversed_model(model: Model) -> Model:
    """The model whose motions run backward; its numbers keep their names."""
    fields = {f.name: getattr(model, f.name) for f in dataclasses.fields(model)}  # type: ignore[arg-type]
    result: Model = _reversed_class(type(model))(**fields)  # type: ignore[arg-type]
    return result


def reversed_load(load: Load) -> Load:
    """The load F(-t)."""
    return Load(
        frequency=load.frequency,
        **{name: _reversed_signal(signal) for name, signal in load.channels.items()},
    )


def _reversed_signal(signal: Signal) -> Signal:
    if isinstance(signal, Constant):
        return signal
    if isinstance(signal, Harmonic):
        return Harmonic(signal.amplitude, signal.mean, math.pi - signal.phase, signal.order)
    if isinstance(signal, Sum):
        return Sum(tuple(_reversed_signal(term) for term in signal.terms))
    if isinstance(signal, Record):
        sign = -1.0 if signal.quantity == "velocity" else 1.0
        return dataclasses.replace(signal, time=-signal.time[::-1], value=sign * signal.value[::-1])
    if isinstance(signal, Repeating):
        return signal.backward()
    raise ParameterError(f"a {type(signal).__name__} cannot be run backward")


class _BackwardLoad:
    """A load that is reversed in time, as the forward model reads it: with first derivatives of the
    original sign.
    """

    def __init__(self, load: Any) -> None:
        self._load = load

    def __getattr__(self, name: str) -> Any:
        part = getattr(self._load, name)
        return part if name in ("frequency", "period") else _BackwardChannel(part)


class _BackwardChannel:
    def __init__(self, channel: Any) -> None:
        self._channel = channel

    def __call__(self, t: Any) -> Any:
        return self._channel(t)

    def velocity(self, t: Any) -> Any:
        return -self._channel.velocity(t)

    def acceleration(self, t: Any) -> Any:
        return self._channel.acceleration(t)


@cache
def _reversed_class(cls: type[Model]) -> Any:
    """The class of a model run backward: a subclass with the same fields."""

    def acceleration(self: Any, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        return cls.acceleration(self, t, theta, _turned(velocity), side, _BackwardLoad(load))

    def margins(
        self: Any, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any
    ) -> Any:
        return cls.margins(
            self, t, theta, _turned(velocity), acceleration, side, _BackwardLoad(load)
        )

    def reduce(self: Any) -> Any:
        return reversed_model, (
            cls(**{f.name: getattr(self, f.name) for f in dataclasses.fields(self)}),
        )

    body = {
        "__slots__": (),
        "__doc__": f"{cls.__name__} run backward in time.",
        "__module__": __name__,
        "__reduce__": reduce,
        "acceleration": acceleration,
        "margins": margins,
    }
    return type(f"Reversed{cls.__name__}", (cls,), body)


def _turned(velocity: Any) -> Any:
    return tuple(-v for v in velocity) if isinstance(velocity, tuple) else -velocity


def _check_resets(system: System, backward: System) -> None:
    """Refuse a model whose reset is not undone by the reversed law."""
    for side in system.model.sides:
        for speed in RESET_SPEEDS:
            before = -speed * system.one_contact.inward(side)
            following, after = system.one_contact.reset(
                0.0, before, side, system.load, system.impact
            )
            back, again = backward.one_contact.reset(
                0.0, -after, following, backward.load, backward.impact
            )
            if back != side or not math.isclose(float(again), -before, rel_tol=1e-12):
                raise ParameterError(
                    f"the reset of {type(system.model).__name__} cannot be followed backward: v+ ="
                    f" {float(after):g} on side {following} leads back to side {back} with"
                    f" {float(-again):g}, not to side {side} with {before:g}"
                )
