"""Summaries of a motion, of the answers to a study's questions, and of how far a sweep is (`saltus
status`), in a few lines.
"""

from __future__ import annotations

import datetime
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from saltus.errors import LONGEST_NAME, ParameterError, printable
from saltus.flow import EventKind

if TYPE_CHECKING:
    from saltus.flow import Motion
    from saltus.sweep import StoreStatus


def print_summary(motion: Motion, console: Console) -> None:
    """Print the end state, the impacts, why the motion ended, and whether the mechanism could
    follow it.
    """
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
    count = (
        "" if period is None else f", {(motion.time - motion.start) / period:.6g} forcing periods"
    )
    end = motion.stop.meaning + (f": {motion.limit}" if motion.limit else "")
    return [("end", end), ("time", f"{motion.start:.12g} to {motion.time:.12g}{count}"), *rows]


def _events(motion: Motion) -> list[tuple[str, str]]:
    impacts = motion.impacts
    last = (
        f", the last at {impacts.time[-1]:.12g} with speed"
        f" {np.abs(impacts.velocity_before[-1]).max():.6g}"
        if len(impacts)
        else ""
    )
    rows = [("impacts", f"{len(impacts)}{last}")]
    kinds = Counter(event.kind for event in motion.events if event.kind is not EventKind.IMPACT)
    if kinds:
        rows.append(
            ("other events", ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())))
        )
    rest = motion.rest_time
    rows.append(("at rest from", "not at rest at the end" if rest is None else f"{rest:.15g}"))
    if not motion.phase_known:
        rows.append(("phase", "not known exactly: impacts without loss were averaged"))
    return rows


def _validity(motion: Motion) -> list[tuple[str, str]]:
    rows = []
    for name, first in motion.validity.first.items():
        share = 100 * motion.validity.share[name]
        verdict = (
            "not passed"
            if first is None
            else f"passed first at {first:.9g}, beyond it {share:.3g} % of the time"
        )
        rows.append((name.replace("_", " "), verdict))
    return rows + [
        (f"impacts at {name}", motion.validity.gain(name)) for name in motion.validity.gains
    ]


# the most special points, or failed chunks, that are named; further ones are only counted
MOST_LISTED = 8


def summarise(kind: str, data: Any) -> Iterator[str]:
    """The lines that `saltus run` prints of the answer to a question of this kind."""
    return SUMMARIES[kind](data)


def _portrait(data: Any) -> Iterator[str]:
    stable = int(data["stable"].sum())
    unstable = data.sizes["equilibrium"] - stable
    why = data.attrs.get("no_separatrices")
    count = f"no separatrices ({why})" if why else f"{data.sizes['separatrix']} separatrices"
    yield (
        f"{data.sizes['motion']} motions, {stable} stable and {unstable} unstable equilibria,"
        f" {count}."
    )


def _chart(data: Any) -> Iterator[str]:
    if "chart" in getattr(data, "children", ()):
        yield from _chart(data["chart"].to_dataset())
        yield from _borders(data)
        return
    moving = int((data["count"] > 0).sum())
    unit = data["amplitude"].attrs["units"].replace("1", "")
    text = f"Stable motions beside rest in {moving} of {data['count'].size} cells"
    yield text + (
        f", the largest amplitude is {float(data['amplitude'].max()):.4g} {unit}".rstrip() + "."
        if moving
        else "."
    )
    outcome = data["outcome"]
    for value, name in zip(
        outcome.attrs["flag_values"], outcome.attrs["flag_meanings"].split(), strict=True
    ):
        number = int((outcome == value).sum())
        if number and name in ("chaos", "motions_and_chaos", "long", "undecided"):
            yield f"{name.replace('_', ' ').capitalize()} in {number} cells."


def _borders(tree: Any) -> Iterator[str]:
    """What is known of the changes between neighbouring cells."""
    from saltus.plots import border_curves

    left = tree["disagreements"].to_dataset()
    kinds = [str(curve.attrs["kind"]) for curve in border_curves(tree)]
    curves = ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds))) or "none"
    total, located, harmless = (
        int(left.attrs[name]) for name in ("changes", "located", "harmless")
    )
    added = int(tree["chart"].attrs["added_by_continuation"])
    yield (
        f"Exact borders: {curves} as curves. Of {total} ends of motions between neighbouring cells"
        f" {located} are located between them, {harmless} are none, as the same motion goes on, and"
        f" {left.sizes['change']} are not explained."
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
        # at an end at its own image, a branch has the orbit of half the period
        period = int(branch["period"].max())
        x = branch["parameter"].values
        listed = ", ".join(kinds[:MOST_LISTED]) or "no special points"
        yield (
            f"branch {number}: period {period}, {path} {x.min():.6g} to {x.max():.6g}, "
            f"{int(branch['stable'].sum())} of {x.size} points stable; {listed}{more}"
        )
    for low, high, rate in zip(
        *(tree["bands"][name].values for name in ("low", "high", "exponent")), strict=True
    ):
        yield f"chaos: {path} {low:.6g} to {high:.6g}, largest exponent {rate:.3g}"


def _sweep(data: Any) -> Iterator[str]:
    path = data.attrs["path"]
    reached = int(data["amplitude"].notnull().all("direction").sum())
    yield f"{reached} values of {path} up and down; they differ at {int(data['hysteresis'].sum())}."
    for jump in range(data.sizes["jump"]):
        way, *numbers = (
            data[f"jump_{name}"].values[jump] for name in ("direction", "before", "after")
        )
        sizes = (float(data[f"jump_amplitude_{when}"][jump]) for when in ("before", "after"))
        yield "{}: a jump between {:.8g} and {:.8g}, amplitude {:.4g} to {:.4g}".format(
            way, *numbers, *sizes
        )


def _attractors(data: Any) -> Iterator[str]:
    share, of = ("cells", "cells") if "cells" in data else ("fraction", "starts")
    for i, label in enumerate(data["attractor"].values):
        periods = int(data["attractor_period"][i])
        kind = str(data["attractor_kind"].values[i]) + (f", period {periods}" if periods else "")
        part = 100 * float(data[share][i])
        size = float(data["amplitude"][i])
        yield f"{int(label)}: {kind}, amplitude {size:.4g}, {part:.3g} % of the {of}"
    left = float(data.attrs.get("undecided", 0.0))
    if left:
        yield f"undecided: {100 * left:.3g} % of the {of}"


def _theorems(data: Any) -> Iterator[str]:
    statements = data["special_statement"].values if "special_statement" in data else ()
    yield from (str(statement) for statement in statements if statement)
    yield str(data.attrs["statement"])
    yield f"Assumed: {data.attrs['assumptions']}."


SUMMARIES: dict[str, Callable[[Any], Iterator[str]]] = {
    "phase_portrait": _portrait,
    "response_spectrum": _diagram,
    "bifurcation_diagram": _diagram,
    "frequency_sweep": _sweep,
    "attractors": _attractors,
    "basins": _attractors,
    "stability_chart": _chart,
    "prove": _theorems,
}


SEARCH = "diagram"  # the kind of a store whose number of parts is not known beforehand


def print_status(path: Path, verify: bool = False) -> None:
    """Print how far the sweep in the store at `path` is, from its files alone: it may be running,
    stopped or killed.

    Of a folder with stores inside, each is told. With `verify`, every file is compared with its
    checksum; `path` may then also be a netCDF file.

    Raises
    ------
    ParameterError
        There is no store of a sweep at `path`, or what was verified is damaged.
    """
    from saltus.sweep import damage, status

    if (
        verify
        and not (path / "zarr.json").is_file()
        and (path.suffix != ".zarr" or not path.exists())
    ):
        print_verified(path)
        return
    within = (
        sorted(path.rglob("*.zarr")) if path.is_dir() and not (path / "zarr.json").is_file() else []
    )
    if within:
        for store in within:
            print_status(store)
        return
    found = status(path, verify=verify)
    console = Console(highlight=False)
    kind = printable(found.kind, LONGEST_NAME)
    console.print(Text(f"{kind[:1].upper()}{kind[1:].replace('_', ' ')} ", style="bold"), end="")
    console.print(f"in {path}", markup=False, soft_wrap=True)
    if console.is_terminal and found.kind != SEARCH:
        console.print(ProgressBar(total=found.total, completed=found.done), "", sep="\n")
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for head, text in rows(found):
        table.add_row(head, Text(printable(text)))
    console.print(table)
    if found.damaged:
        raise ParameterError(f"{damage(found)}; start the sweep again to compute their chunks anew")
    console.print(ending(found), markup=False, soft_wrap=True)
    if verify:
        console.print("Every file is what was written.", markup=False)


def print_verified(path: Path) -> None:
    """Print whether the netCDF file at `path`, or each result below that folder, is still as it was
    written.

    Raises
    ------
    ParameterError
        Damaged results, all of which the error names; or no result at `path`.
    """
    from saltus.files import UNCHECKED, checked_content, has_checksum
    from saltus.sweep import damage, status

    found = (
        [path] if path.is_file() else [*sorted(path.rglob("*.nc")), *sorted(path.rglob("*.zarr"))]
    )
    console = Console(highlight=False)
    wrong = list[str]()
    if not found:
        raise ParameterError(
            f"there is no result of saltus at {path}; give a .nc file, a .zarr folder, or a folder"
            " with such"
        )
    for file in found:
        try:
            if file.is_dir():
                store = status(file, verify=True)
                said = "sound"
                bad = damage(store) if store.damaged else ""
            else:
                checked_content(file)
                said = "sound" if has_checksum(file.read_bytes()) else UNCHECKED
                bad = ""
        except ParameterError as error:
            bad = str(error)
        wrong += [bad] if bad else []
        console.print(f"{file}: {'damaged' if bad else said}", markup=False, soft_wrap=True)
    if wrong:
        more = f"; and {len(wrong) - 1} more of these results" if len(wrong) > 1 else ""
        raise ParameterError(f"{wrong[0]}{more}")


def rows(found: StoreStatus) -> Iterator[tuple[str, str]]:
    """The lines of the table: heads and values."""
    if found.kind != SEARCH:
        yield "chunks", f"{found.done} of {found.total} done ({100 * found.done // found.total} %)"
        yield "grid", ", ".join(f"{size} along {name}" for name, size in found.sizes.items())
    for kind, count in found.remembered.items():
        yield kind, f"{count} chunk{'s' * (count > 1)} remembered"
    yield "size", "about " * found.estimated + size(found.bytes)
    yield "begun", moment(found.started)
    yield "last written", moment(found.updated) if found.updated else "nothing yet"
    if found.failures:
        yield "failed", str(found.failed)
    for failure in found.failures[:MOST_LISTED]:
        yield "", str(failure)
    if found.failed > MOST_LISTED:
        yield "", f"and {found.failed - MOST_LISTED} more"


def ending(found: StoreStatus) -> str:
    """Whether the sweep is running, and how it can be continued."""
    if found.complete:
        return "The sweep is complete."
    if found.running:
        return "A run is writing to it now."
    if found.running is None:
        return "If no run is writing to it, start the sweep again: it goes on from here."
    return "No run is writing to it; start the sweep again to go on from here."


def size(count: int) -> str:
    """A number of bytes, in the unit that fits."""
    value = float(count)
    unit = "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if value < 1000:
            break
        value, unit = value / 1000, larger
    return f"{value:.3g} {unit}" if unit != "B" else f"{count} B"


def moment(when: datetime.datetime) -> str:
    """A time, in the local time zone."""
    return when.strftime("%Y-%m-%d %H:%M:%S")
