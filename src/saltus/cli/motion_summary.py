"""The summary of a motion that `saltus simulate` prints."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from saltus.flow import EventKind

if TYPE_CHECKING:
    from saltus.flow import Motion


def print_summary(motion: Motion, console: Console) -> None:
    """Print the end state, the impacts, why the motion ended, and whether the mechanism could follow it."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for head, text in [*_state(motion), *_events(motion), *_validity(motion)]:
        table.add_row(head, text)
    console.print(table)


def _state(motion: Motion) -> list[tuple[str, str]]:
    names = motion.system.model.coordinates
    velocities = motion.velocity if len(names) > 1 else (motion.velocity,)
    positions = motion.position if len(names) > 1 else (motion.position,)
    rows = []
    for name, position, velocity in zip(names, positions, velocities, strict=True):
        rows.append((f"{name} at the end", f"{position:.15g}"))
        rows.append((f"{name}' at the end", f"{velocity:.15g}"))
    period = motion.system.load.period
    count = "" if period is None else f", {(motion.time - motion.start) / period:.6g} forcing periods"
    end = motion.stop.meaning + (f": {motion.limit}" if motion.limit else "")
    return [("end", end), ("time", f"{motion.start:.12g} to {motion.time:.12g}{count}"), *rows]


def _events(motion: Motion) -> list[tuple[str, str]]:
    if not (
        motion.system.model.has_one_contact or motion.system.model.holds_coordinates
    ):  # a model without contacts and frictions
        return []
    impacts = motion.impacts
    last = (
        f", the last at {impacts.time[-1]:.12g} with speed {np.abs(impacts.velocity_before[-1]).max():.6g}"
        if len(impacts)
        else ""
    )
    rows = [("impacts", f"{len(impacts)}{last}")]
    kinds = Counter(event.kind for event in motion.events if event.kind is not EventKind.IMPACT)
    if kinds:
        rows.append(("other events", ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))))
    rest = motion.rest_time
    rows.append(("at rest from", "not at rest at the end" if rest is None else f"{rest:.15g}"))
    if not motion.phase_known:
        rows.append(("phase", "not known exactly: impacts without loss were averaged"))
    return rows


def _validity(motion: Motion) -> list[tuple[str, str]]:
    rows = []
    for name, first in motion.validity.first.items():
        share = 100 * motion.validity.share[name]
        verdict = "respected" if first is None else f"passed first at {first:.9g}, beyond it {share:.3g} % of the time"
        rows.append((name.replace("_", " "), verdict))
    return rows + [(f"impacts at {name}", motion.validity.gain(name)) for name in motion.validity.gains]
