"""`saltus info`: what is known of a system before it moves, in closed form, and how it is
printed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from saltus.errors import ParameterError
from saltus.systems import (
    Constant,
    Harmonic,
    Load,
    Metainterface,
    Model,
    RockingBlock,
    Signal,
    Sum,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.theory import (
    critical_horizontal,
    equilibria,
    fold_horizontal,
    high_frequency_onset,
    linear_period,
    peaks,
    rocking_period,
    slender_rocking_period,
    subcritical_vertical,
    unloaded_fold,
    vibrations,
)

if TYPE_CHECKING:
    from rich.table import Table

LEAST_START = 1e-6  # rad; smaller angles at the start count as none


def print_info(path: Path) -> None:
    """Print what is known of the system in the study at `path`.

    Raises
    ------
    SaltusError
        A bad study, or a model that cannot be traced, so that no motion of it could be computed.
    """
    from saltus.config import Ask, load_study
    from saltus.taylor import trace

    study = load_study(path, questions=False)
    study.answer(Ask(kind="model", options={}), trace)
    console = Console(highlight=False)
    console.print(f"[bold]{type(study.system.model).__name__}[/] ", end="")
    console.print(f"from {path}", markup=False, soft_wrap=True)
    theta = study.simulate.arguments.get("theta", 0.0) if study.simulate else 0.0
    start = theta if abs(theta) >= LEAST_START else None
    for block in describe(study.system, start):
        console.print()
        console.print(block.title, style="bold", markup=False)
        console.print(block_table(block))


# Instants at which a load is compared with its mirror image: enough to see every harmonic below the
# 32nd.
PHASES = 64


def describe(system: System, start: float | None = None) -> Iterator[Block]:
    """What is known of `system`.

    Parameters
    ----------
    start
        The angle, rad, at which the free vibration starts whose period is given.
    """
    parameters: list[Row] = [(path, number(value)) for path, value in system.parameters.items()]
    yield Block("Parameters", [*parameters, ("impact law", type(system.impact).__name__)])
    yield Block("Load", _load(system))
    for model, closed_forms in MODEL_FACTS.items():
        if isinstance(system.model, model):
            yield from closed_forms(system, start)


def _load(system: System) -> list[Row]:
    period = system.load.period
    rows: list[Row] = [
        (
            "forcing period 2 pi / Omega",
            "none: the load has no frequency" if period is None else number(period),
        )
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
    span = load.period or max((_end(s) for s in _passing(load)), default=1.0)
    times = span * np.arange(PHASES) / PHASES
    for name in load.channels:
        # for the ground only the acceleration matters
        order = 2 if name.startswith("ground") else 0
        pairs = ((load, times + shift), (other, times))
        here, there = (
            np.broadcast_to(x.channels[name].derivative(t, x.frequency, order), times.shape)
            for x, t in pairs
        )
        if not np.allclose(here, there, rtol=1e-12, atol=1e-12 * (1 + np.abs(there).max())):
            return False
    return True


def _passing(load: Load) -> list[Any]:
    """The records and pulses of a load."""
    return [
        term
        for signal in load.channels.values()
        for term in getattr(signal, "terms", (signal,))
        if term.once
    ]


def _end(signal: Any) -> float:
    return float(signal.time[-1] if hasattr(signal, "time") else signal.settled)


# rad; the start of the free vibration whose period is given if the study has no start
SMALL_START = 0.1


def _metainterface(system: System, start: float | None) -> Iterator[Block]:
    """Equilibria under the mean load, vibrations and periods, critical loads, limits of the
    mechanism.
    """
    model = system.model
    assert isinstance(model, Metainterface)
    model = dataclasses.replace(model, smoothing=None)
    still = System(model=model, load=mean_load(system.load), impact=system.impact)
    yield _equilibria(still)
    yield _vibrations(still, model, start or SMALL_START)
    yield _critical_loads(still, model, system.load.frequency)
    yield _limits(model)


def _equilibria(system: System) -> Block:
    rows: list[Row] = []
    for e in equilibria(system):
        place = "" if e.within_line else "beyond the straight line"
        rows.append(
            (
                number(e.theta),
                f"{math.degrees(e.theta):.6g}",
                e.stability.value,
                number(e.energy),
                place,
            )
        )
    title = (
        f"Equilibria under the mean load (H = {float(system.load.horizontal(0.0)):g}, V = "
        f"{float(system.load.vertical(0.0)):g})"
    )
    return Block(title, rows, ("theta (rad)", "(deg)", "", "energy P / K2", ""))


def _vibrations(system: System, model: Metainterface, start: float) -> Block:
    rows: list[Row] = []
    try:
        for name, v in zip(("lower", "upper"), vibrations(system), strict=True):
            rows.append(
                (
                    f"apparent frequency, {name} layer",
                    f"{number(v.frequency)}, damping ratio {number(v.damping_ratio)}",
                )
            )
    except ParameterError as error:
        rows.append(("apparent frequencies", f"none: {error}"))
    free = system.with_({"model.damping": 0.0, "impact": VelocityReduction(1.0)})
    rows.append(
        (
            f"undamped free period from theta = {start:g} rad",
            attempt(lambda: number(peaks(free, start).period)),
        )
    )
    vertical = float(system.load.vertical(0.0))
    if _alike(model) and not any(
        getattr(system.load, name)(0.0) for name in system.load.channels if name != "vertical"
    ):
        small = attempt(lambda: number(linear_period(start, beta0=model.beta0, vertical=vertical)))
        rows.append(("the same, small angles: T0 (t-beta)", small))
    forth, back = (float(model.inelastic_factor(side)) for side in (1, -1))
    factors = (
        number(forth)
        if forth == back
        else f"{number(forth)} from lower to upper, {number(back)} back"
    )
    rows.append(("velocity factor of an inelastic impact", factors))
    return Block("Vibrations", rows)


def _alike(model: Metainterface) -> bool:
    """Whether the layers are equal, as closed forms for k = 1, m = 0 assume."""
    return (model.stiffness_ratio, model.mass_ratio) == (1.0, 0.0)


def _critical_loads(system: System, model: Metainterface, frequency: float | None) -> Block:
    beta0 = model.beta0
    vertical = float(system.load.vertical(0.0))
    rows: list[Row] = [
        (
            "Hcr = |V / tan(beta0)|, the undeformed state is lost",
            attempt(lambda: number(critical_horizontal(beta0, vertical))),
        )
    ]
    if _alike(model) and beta0 < math.pi / 2:
        least = subcritical_vertical(beta0)
        rows.append(("the buckling at Hcr is subcritical for V below", number(least)))
        rows.append(
            ("deformed equilibria exist without any H for V below", number(unloaded_fold(beta0)[0]))
        )
        if vertical <= least:
            rows.append(
                (
                    "fold of equilibria, at |H|",
                    attempt(lambda: number(fold_horizontal(beta0, vertical))),
                )
            )
    if (
        _alike(model)
        and model.dissipation_ratio == 1
        and model.damping > 0
        and frequency is not None
    ):
        damping = model.damping
        onset = attempt(
            lambda: number(
                high_frequency_onset(frequency, beta0=beta0, vertical=vertical, damping=damping)
            )
        )
        rows.append(("period-1 motion exists above H amplitude (fast load, e = 1)", onset))
    return Block("Critical loads", rows)


def _limits(model: Metainterface) -> Block:
    opening = math.pi - model.beta0
    return Block(
        "Limits of the mechanism, |theta|",
        [
            ("straight line, pi - beta0", angle(opening)),
            ("kinematic limit, 2 (pi - beta0)", angle(2 * opening)),
        ],
    )


def _rocking_block(system: System, start: float | None) -> Iterator[Block]:
    """Overturning, rest, and the free periods."""
    alpha = system.get("model.alpha")
    rows: list[Row] = [
        ("overturning equilibria, theta = +-alpha", angle(alpha)),
        ("the block lies on its side at +-pi/2", angle(math.pi / 2)),
        ("rest is left where |zeta''| exceeds (1 + nu'') tan(alpha)", number(math.tan(alpha))),
        (
            "velocity factor of an inelastic impact (Housner)",
            number(system.one_contact.inelastic_factor(1)),
        ),
    ]
    yield Block("Closed forms", [*rows, *_rocking_periods(alpha, start or alpha / 2)])


def _rocking_periods(alpha: float, start: float) -> list[Row]:
    return [
        (
            f"free rocking period from {angle(start)}",
            attempt(lambda: number(rocking_period(start, alpha=alpha))),
        ),
        (
            "the same for a slender block",
            attempt(lambda: number(slender_rocking_period(start, alpha=alpha))),
        ),
    ]


def _wall_oscillator(system: System, start: float | None) -> Iterator[Block]:
    """Frequency, damping ratio and rest."""
    k, c, wall = (system.get(f"model.{name}") for name in ("stiffness", "damping", "wall"))
    rows: list[Row] = []
    if k > 0:
        frequency = math.sqrt(k)
        ratio = c / (2 * math.sqrt(k))
        rows += [
            ("natural frequency sqrt(k)", number(frequency)),
            ("damping ratio c / (2 sqrt(k))", number(ratio)),
        ]
        if ratio < 1:
            rows.append(
                (
                    "free period away from the wall",
                    number(2 * math.pi / (frequency * math.sqrt(1 - ratio**2))),
                )
            )
        force = mean(system.load.channels["force"]) if "force" in system.load.channels else 0.0
        place = force / k
        held = f"on the wall, x = {number(wall)}" if place >= wall else f"x = {number(place)}"
        rows.append(("equilibrium under the mean force", held))
    rows.append(("rests on the wall while the force exceeds k d", number(k * wall)))
    yield Block("Closed forms", rows)


MODEL_FACTS: dict[type[Model], Callable[[System, float | None], Iterator[Block]]] = {
    Metainterface: _metainterface,
    RockingBlock: _rocking_block,
    WallOscillator: _wall_oscillator,
}


Row = tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Block:
    """A titled list of rows of text."""

    title: str
    rows: list[Row]
    heads: Row = ()


def block_table(block: Block) -> Table:
    """The rows of a block as a table for the terminal; brackets are text, no style."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, pad_edge=False, show_header=bool(block.heads))
    for head in block.heads or ("", ""):
        table.add_column(head, header_style="dim", overflow="fold")
    for row in block.rows:
        table.add_row(*map(escape, row))
    return table


def number(value: Any) -> str:
    """A number with eight digits, which suffice for comparisons."""
    return f"{float(value):.8g}"


def angle(value: Any) -> str:
    """An angle in both units."""
    return f"{float(value):.8g} rad ({math.degrees(float(value)):.6g} deg)"


def attempt(formula: Callable[[], str]) -> str:
    """The result of a closed form, or why it does not apply."""
    try:
        return formula()
    except ParameterError as error:
        return f"none: {error}"


def mean_load(load: Load) -> Load:
    """The constant parts of all forces, to which closed forms for constant loads can be applied."""
    return Load(
        **{
            name: mean(signal)
            for name, signal in load.channels.items()
            if not name.startswith("ground")
        }
    )


def mean(signal: Signal) -> float:
    """The constant part of a signal; 0 for a record."""
    if isinstance(signal, Sum):
        return sum(mean(term) for term in signal.terms)
    return (
        signal.value
        if isinstance(signal, Constant)
        else signal.constant_part
        if signal.repeats
        else signal.mean
        if isinstance(signal, Harmonic)
        else 0.0
    )
