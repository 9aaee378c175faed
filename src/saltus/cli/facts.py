"""The facts that `saltus info` prints, by model, as plain text; the closed forms are those of `saltus.theory`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from saltus.systems import Load, Signal, System

SMALL = 0.1  # rad; the start of the free vibration whose period is given where the study has none
PHASES = 64  # instants at which a load is compared with its mirror image half a period later


@dataclasses.dataclass(frozen=True)
class Block:
    """A titled list of rows of text."""

    title: str
    rows: list[tuple[str, ...]]
    heads: tuple[str, ...] = ()


def describe(system: System, start: float | None = None) -> Iterator[Block]:
    """What is known of `system`: first what holds for every model, then what closed forms add.

    Args:
        start: the angle, rad, from which the period of a free vibration is wanted.
    """
    from saltus.systems import Metainterface, RockingBlock, WallOscillator

    parameters: list[tuple[str, ...]] = [(path, number(value)) for path, value in system.parameters.items()]
    yield Block("Parameters", [*parameters, ("impact law", type(system.impact).__name__)])
    yield Block("Load", _load(system))
    model = system.model
    if isinstance(model, Metainterface):
        from saltus.cli.facts_metainterface import metainterface

        yield from metainterface(system, start)
    elif isinstance(model, RockingBlock):
        yield _rocking_block(system, start)
    elif isinstance(model, WallOscillator):
        yield _wall_oscillator(system)


def number(value: Any) -> str:
    """Eight digits, which is what a reader compares."""
    return f"{float(value):.8g}"


def angle(value: Any) -> str:
    """An angle in both units."""
    return f"{float(value):.8g} rad ({math.degrees(float(value)):.6g} deg)"


def attempt(formula: Callable[[], str]) -> str:
    """What a closed form gives, or why it does not apply."""
    from saltus.errors import ParameterError

    try:
        return formula()
    except ParameterError as error:
        return f"none: {error}"


def _load(system: System) -> list[tuple[str, ...]]:
    period = system.load.period
    rows: list[tuple[str, ...]] = [
        ("forcing period 2 pi / Omega", "none: the load has no frequency" if period is None else number(period))
    ]
    channels = ", ".join(system.load.channels) or "none"
    rows.append(("channels given", channels))
    rows.append(("channels that the model reads", ", ".join(system.model.channels) or "none"))
    rows.append(("symmetry", symmetry(system)))
    return rows


def symmetry(system: System) -> str:
    """Whether -theta moves as theta does: at once, half a forcing period later, or not at all."""
    mirrored = system.mirrored()
    if mirrored is None:
        return "none: the model has no mirror image under this load"
    shift = (system.load.period or 0.0) / 2
    if _equal(system.load, mirrored.load, 0.0):
        return "symmetric: the mirror image of a motion is a motion"
    if shift and _equal(system.load, mirrored.load, shift):
        return "symmetric: the mirror image of a motion, half a period later, is a motion"
    return "the model is symmetric, the load is not: the mirror image moves under the reversed load"


def _equal(load: Load, other: Load, shift: float) -> bool:
    """Whether `load` at t + shift is `other` at t in every channel."""
    import numpy as np

    span = load.period or max((s.time[-1] for s in _records(load)), default=1.0)
    times = span * np.arange(PHASES) / PHASES
    for name in load.channels:
        here, there = (np.broadcast_to(getattr(x, name)(t), times.shape) for x, t in ((load, times + shift), (other, times)))
        if not np.allclose(here, there, rtol=1e-12, atol=1e-12 * (1 + np.abs(there).max())):
            return False
    return True


def _records(load: Load) -> list[Any]:
    from saltus.systems import Record

    return [term for signal in load.channels.values() for term in getattr(signal, "terms", (signal,)) if isinstance(term, Record)]


def mean_load(load: Load) -> Load:
    """The constant part of every force: what closed forms for constant loads can be asked about."""
    from saltus.systems import Load

    return Load(**{name: mean(signal) for name, signal in load.channels.items() if not name.startswith("ground_")})


def mean(signal: Signal) -> float:
    """The constant part of a signal; that of a record is 0."""
    from saltus.systems import Constant, Harmonic, Sum

    if isinstance(signal, Sum):
        return sum(mean(term) for term in signal.terms)
    return signal.value if isinstance(signal, Constant) else signal.mean if isinstance(signal, Harmonic) else 0.0


def _rocking_block(system: System, start: float | None) -> Block:
    alpha = system.get("model.alpha")
    rows: list[tuple[str, ...]] = [
        ("overturning equilibria, theta = +-alpha", angle(alpha)),
        ("the block lies on its side at +-pi/2", angle(math.pi / 2)),
        ("rest is left where |zeta''| exceeds (1 + nu'') tan(alpha)", number(math.tan(alpha))),
        ("velocity factor of an inelastic impact (Housner)", number(system.model.inelastic_factor(1))),
    ]
    return Block("Closed forms", [*rows, *_rocking_periods(alpha, start or alpha / 2)])


def _rocking_periods(alpha: float, start: float) -> list[tuple[str, ...]]:
    from saltus.theory import rocking_period, slender_rocking_period

    return [
        (f"free rocking period from {angle(start)}", attempt(lambda: number(rocking_period(start, alpha=alpha)))),
        ("the same for a slender block", attempt(lambda: number(slender_rocking_period(start, alpha=alpha)))),
    ]


def _wall_oscillator(system: System) -> Block:
    k, c, wall = (system.get(f"model.{name}") for name in ("stiffness", "damping", "wall"))
    rows: list[tuple[str, ...]] = []
    if k > 0:
        frequency, ratio = math.sqrt(k), c / (2 * math.sqrt(k))
        rows += [("natural frequency sqrt(k)", number(frequency)), ("damping ratio c / (2 sqrt(k))", number(ratio))]
        if ratio < 1:
            rows.append(("free period away from the wall", number(2 * math.pi / (frequency * math.sqrt(1 - ratio**2)))))
        force = mean(system.load.channels["force"]) if "force" in system.load.channels else 0.0
        place = force / k
        held = f"on the wall, x = {number(wall)}" if place >= wall else f"x = {number(place)}"
        rows.append(("equilibrium under the mean force", held))
    rows.append(("rests on the wall while the force exceeds k d", number(k * wall)))
    return Block("Closed forms", rows)
