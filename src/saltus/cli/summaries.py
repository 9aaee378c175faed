"""Summaries of a motion and of the answers to a study's questions, in a few lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

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


MOST_LISTED = 8  # the most special points, or failed chunks, that are named; further ones are only counted


def summarise(kind: str, data: Any) -> Iterator[str]:
    """The lines that `saltus run` prints of the answer to a question of this kind."""
    return SUMMARIES[kind](data)


def _portrait(data: Any) -> Iterator[str]:
    stable = int(data["stable"].sum())
    unstable = data.sizes["equilibrium"] - stable
    why = data.attrs.get("no_separatrices")
    count = f"no separatrices ({why})" if why else f"{data.sizes['separatrix']} separatrices"
    yield f"{data.sizes['motion']} motions, {stable} stable and {unstable} unstable equilibria, {count}."


def _chart(data: Any) -> Iterator[str]:
    if "chart" in getattr(data, "children", ()):
        yield from _chart(data["chart"].to_dataset())
        yield from _borders(data)
        return
    moving, unit = int((data["count"] > 0).sum()), data["amplitude"].attrs["units"].replace("1", "")
    text = f"Stable motions beside rest in {moving} of {data['count'].size} cells"
    yield text + (f", the largest amplitude is {float(data['amplitude'].max()):.4g} {unit}".rstrip() + "." if moving else ".")
    outcome = data["outcome"]
    for value, name in zip(outcome.attrs["flag_values"], outcome.attrs["flag_meanings"].split(), strict=True):
        number = int((outcome == value).sum())
        if number and name in ("chaos", "motions_and_chaos", "long", "undecided"):
            yield f"{name.replace('_', ' ').capitalize()} in {number} cells."


def _borders(tree: Any) -> Iterator[str]:
    """What is known of the changes between neighbouring cells."""
    from saltus.plots import border_curves

    left, kinds = tree["disagreements"].to_dataset(), [str(curve.attrs["kind"]) for curve in border_curves(tree)]
    curves = ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds))) or "none"
    total, located, harmless = (int(left.attrs[name]) for name in ("changes", "located", "harmless"))
    added = int(tree["chart"].attrs["added_by_continuation"])
    yield (
        f"Exact borders: {curves} as curves. Of {total} ends of motions between neighbouring cells {located} are located between "
        f"them, {harmless} are none, as the same motion goes on, and {left.sizes['change']} are not explained."
    )
    if added:
        yield f"{added} motions of cells, to which no start leads, are known from their neighbours."


def _diagram(tree: Any) -> Iterator[str]:
    from saltus.branch_tables import branches_of

    path = tree.attrs["path"]
    for number, branch in branches_of(tree):
        special = (branch[name].values for name in ("kind", "special_parameter"))
        kinds = [f"{kind} {value:.6g}" for kind, value in zip(*special, strict=True)]
        more = f" and {len(kinds) - MOST_LISTED} more" if len(kinds) > MOST_LISTED else ""
        period = int(branch["period"].max())  # at an end at its own image, a branch has the orbit of half the period
        x, listed = branch["parameter"].values, ", ".join(kinds[:MOST_LISTED]) or "no special points"
        yield (
            f"branch {number}: period {period}, {path} {x.min():.6g} to {x.max():.6g}, "
            f"{int(branch['stable'].sum())} of {x.size} points stable; {listed}{more}"
        )
    for low, high, rate in zip(*(tree["bands"][name].values for name in ("low", "high", "exponent")), strict=True):
        yield f"chaos: {path} {low:.6g} to {high:.6g}, largest exponent {rate:.3g}"


def _sweep(data: Any) -> Iterator[str]:
    path, reached = data.attrs["path"], int(data["amplitude"].notnull().all("direction").sum())
    yield f"{reached} values of {path} up and down; they differ at {int(data['hysteresis'].sum())}."
    for jump in range(data.sizes["jump"]):
        way, *numbers = (data[f"jump_{name}"].values[jump] for name in ("direction", "before", "after"))
        sizes = (float(data[f"jump_amplitude_{when}"][jump]) for when in ("before", "after"))
        yield "{}: a jump between {:.8g} and {:.8g}, amplitude {:.4g} to {:.4g}".format(way, *numbers, *sizes)


def _attractors(data: Any) -> Iterator[str]:
    share, of = ("cells", "cells") if "cells" in data else ("fraction", "starts")
    for i, label in enumerate(data["attractor"].values):
        periods = int(data["attractor_period"][i])
        kind = str(data["attractor_kind"].values[i]) + (f", period {periods}" if periods else "")
        part, size = 100 * float(data[share][i]), float(data["amplitude"][i])
        yield f"{int(label)}: {kind}, amplitude {size:.4g}, {part:.3g} % of the {of}"
    left = float(data.attrs.get("undecided", 0.0))
    if left:
        yield f"undecided: {100 * left:.3g} % of the {of}"


SUMMARIES: dict[str, Callable[[Any], Iterator[str]]] = {
    "phase_portrait": _portrait,
    "response_spectrum": _diagram,
    "bifurcation_diagram": _diagram,
    "frequency_sweep": _sweep,
    "attractors": _attractors,
    "basins": _attractors,
    "stability_chart": _chart,
}
