"""Parts of a search whose next computations depend on its results so far: each part is computed once and remembered.

Such a search has no plan, but its long computations are pure functions of JSON, called for many inputs at once. Each such call is
a sweep of its own, whose chunks are kept in a folder that is named by a digest of the computation. A search that was stopped runs
again from its beginning and finds the parts that it had; another search in the same folder finds the parts that both have in
common.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, SweepError
from saltus.progress import Progress, silent
from saltus.sweep.execution import run
from saltus.sweep.plan import Plan, Variable
from saltus.sweep.store import open_store
from saltus.sweep.store_status import StoreStatus, status

if TYPE_CHECKING:
    from saltus.sweep.workers import Workers

END = b"\n"  # marks the end of a text, which may itself end with zeros, as rows are padded with zeros
PARTS = "parts"  # the folder of a store in which its parts are kept


@dataclass(frozen=True)
class PartsSettings:
    """When it pays to start other processes."""

    # Seconds for which this process computes alone before others are started, each of which needs some time to load its code.
    patience: float = 4.0


SETTINGS = PartsSettings()


@dataclass(frozen=True)
class Part:
    """A kind of parts: the function that computes them, and the row of numbers that it gives for each input.

    The function is called as that of a `Plan`: `arguments["inputs"]` has all inputs, `block["row"]` the numbers of those to
    compute, and it returns {"result": array (rows, width)}.
    """

    name: str
    function: str
    width: int
    chunk: int  # rows that are computed together
    dtype: str = "f8"  # "u1" for text, filled up with zeros
    threaded: bool = True  # whether it uses all cores itself; then no further processes are started for it


class Parts:
    """The parts of one search, in memory, or remembered in the folder `parts` of a store."""

    def __init__(
        self,
        common: Mapping[str, Any],
        store: Path | None = None,
        workers: Workers | None = None,
        scheduler: str | None = None,
    ) -> None:
        self.common = dict(common)  # arguments of all functions
        self.folder = None if store is None else store / PARTS
        self.workers, self.scheduler = workers, scheduler
        self.spent = 0.0  # seconds spent on parts that other processes could compute
        self.known: dict[str, tuple[Any, np.ndarray]] = {}  # each input with its row, by the kind and a digest of the input
        for found in parts_of(store) if store is not None else ():
            if found.complete:
                self._remember(found.path)

    def rows(self, part: Part, inputs: Sequence[Any], progress: Progress = silent) -> list[np.ndarray]:
        """The row of numbers for each input; only rows that are not known are computed."""
        keys = [_key(part.name, given) for given in inputs]
        missing = {key: given for key, given in zip(keys, inputs, strict=True) if key not in self.known}
        if missing:
            plan = self._plan(part, list(missing.values()))
            folder = None if self.folder is None else self.folder / f"{part.name}_{_digest(plan.describe())[:16]}"
            alone = part.threaded or len(missing) == 1 or self.spent < SETTINGS.patience
            begun = time.monotonic()
            found = run(plan, folder, workers=None if alone else self.workers, scheduler=self.scheduler, progress=progress)[
                "result"
            ].values
            self.spent += 0.0 if part.threaded else time.monotonic() - begun
            self._keep(part.name, missing.values(), found)
        return [self.known[key][1] for key in keys]

    def texts(self, part: Part, inputs: Sequence[Any], progress: Progress = silent) -> list[bytes]:
        """The text for each input, for a part of dtype "u1" whose rows `text_rows` makes; b"" for a text that was too long."""
        return [row.tobytes().removesuffix(END) for row in self.rows(part, inputs, progress)]

    def _plan(self, part: Part, inputs: list[Any]) -> Plan:
        return Plan(
            function=part.function,
            arguments={**self.common, "inputs": inputs},
            axes={"row": np.arange(len(inputs))},
            chunk={"row": part.chunk},
            variables={"result": Variable(dtype=part.dtype, extra=(("number", part.width),))},
            attrs={"kind": part.name},
        )

    def _remember(self, folder: Path) -> None:
        """Read the rows of a part from its folder; a part that is damaged, or of another function, is skipped and recomputed."""
        from saltus.sweep.store_status import read_plan

        try:
            arguments = read_plan(folder)["arguments"]
            rows = open_store(folder)["result"].values
        except (ParameterError, SweepError):
            return
        if {name: value for name, value in arguments.items() if name != "inputs"} == self.common:
            self._keep(folder.name.rsplit("_", 1)[0], arguments["inputs"], rows)

    def _keep(self, name: str, inputs: Iterable[Any], rows: np.ndarray) -> None:
        for given, row in zip(inputs, rows, strict=True):
            self.known[_key(name, given)] = given, _trimmed(row)

    def remembered(self, part: Part) -> Iterator[tuple[Any, np.ndarray]]:
        """Every input of a kind that is known, with its row."""
        return (entry for key, entry in self.known.items() if key.startswith(f"{part.name} "))


def text_rows(texts: Sequence[bytes], width: int) -> np.ndarray:
    """Texts as the rows of a part of dtype "u1"; one that is longer than a row is left out."""
    kept = [text + END if len(text) < width else b"" for text in texts]
    return np.stack([np.frombuffer(text.ljust(width, b"\0"), np.uint8) for text in kept])


def parts_of(store: Path, verify: bool = False) -> Iterator[StoreStatus]:
    """The states of all parts in a store; with `verify` all of their files are read."""
    folder = store / PARTS
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        if (path / "zarr.json").is_file():
            yield status(path, verify=verify)


def _trimmed(row: np.ndarray) -> np.ndarray:
    """A row; for a text, without the zeros that pad it."""
    return row if row.dtype != np.uint8 else np.trim_zeros(row, "b").copy()


def _key(name: str, given: Any) -> str:
    return f"{name} {_digest(given)}"


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
