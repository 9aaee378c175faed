"""The results of a search, each computed once: in memory, or in files that are named by a digest of
their inputs.

A search has no plan, as its next step depends on its results so far. But its long computations are
pure functions of values that JSON has, and of arrays. A search that was stopped runs again from its
beginning and finds what it had; another search in the same store finds what both have in common. A
file holds one chunk of results, as JSON and the bytes of arrays: reading it makes numbers and
texts, and runs nothing. It is written beside its place and moved there, and ends with a checksum;
one that is damaged, or was made by other equations, is computed again.
"""

from __future__ import annotations

import hashlib
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, SweepError
from saltus.files import checked_content, sealed, write_durably
from saltus.progress import Progress, silent
from saltus.sweep.chunks import Index, Raised
from saltus.sweep.execution import SweepInterrupted, outcomes
from saltus.sweep.store_files import FOLDER, SUFFIX, files_of, packed, unpacked

if TYPE_CHECKING:
    from saltus.sweep.workers import Workers

# Seconds for which this process computes alone before others are started, each of which needs some
# time to load its code.
PATIENCE = 4.0

Column = np.ndarray | list[Any]  # an entry for each input


@dataclass(frozen=True)
class MemoKind:
    """A kind of results: its name, the function, "package.module:name", and how many inputs are
    computed together.

    The function is called as `function(arguments, inputs)`, and returns a dict of columns: arrays,
    or lists of what JSON has and of arrays, with an entry for each input.
    """

    name: str
    function: str
    chunk: int
    # whether it uses all cores itself; then no further processes are started for it
    threaded: bool = True


@dataclass(frozen=True)
class Batches:
    """Chunks of inputs, computed as those of a plan are."""

    function: str
    arguments: Mapping[str, Any]
    inputs: Sequence[list[Any]]

    def block(self, index: Index) -> list[Any]:
        """The inputs of a chunk."""
        return self.inputs[index[0]]


class Memo:
    """The results of one search, in memory, or remembered in the folder `parts` of a store.

    `common` are the arguments of all functions; results that were computed with others are not
    taken.
    """

    def __init__(
        self,
        common: Mapping[str, Any],
        store: Path | None = None,
        workers: int | Workers | None = None,
        scheduler: str | None = None,
        patience: float | None = None,
    ) -> None:
        self.common = dict(common)
        self.store = store
        self.workers = workers
        self.scheduler = scheduler
        self.patience = PATIENCE if patience is None else patience
        self.spent = 0.0  # seconds spent on what other processes could compute
        # each input with its result, by the kind and the input's digest
        self.known: dict[str, tuple[Any, dict[str, Any]]] = {}
        # the keys of what was asked for in this run, whatever the store had
        self.asked: set[str] = set()
        for file in files_of(store) if store is not None else ():
            try:
                found = unpacked(checked_content(file))
                if found["common"] == self.common:
                    self._keep(found["kind"], found["inputs"], found["columns"])
            except (ParameterError, KeyError, TypeError, ValueError):
                continue

    def results(
        self, kind: MemoKind, inputs: Sequence[Any], progress: Progress = silent
    ) -> list[dict[str, Any]]:
        """For each input the entry of each column; only what is not known is computed.

        Raises
        ------
        SweepError
            The function has raised twice for a chunk, or a cluster does not answer.
        SweepInterrupted
            Ctrl-C; the chunks that were computed are kept.
        """
        keys = [_key(kind.name, given) for given in inputs]
        fresh = {
            key: given for key, given in zip(keys, inputs, strict=True) if key not in self.asked
        }
        self.asked.update(keys)
        # Chunks are cut from what this run has not asked for before, so that they are the same
        # after a kill.
        rows = list(fresh.items())
        cut = [rows[i : i + kind.chunk] for i in range(0, len(rows), kind.chunk)]
        missing = [[given for key, given in chunk if key not in self.known] for chunk in cut]
        self._compute(kind, [chunk for chunk in missing if chunk], progress)
        return [self.known[key][1] for key in keys]

    def remembered(self, kind: MemoKind) -> Iterator[tuple[Any, dict[str, Any]]]:
        """Every input of a kind that is known, with its result."""
        return (entry for key, entry in self.known.items() if key.startswith(f"{kind.name} "))

    def _compute(self, kind: MemoKind, chunks: list[list[Any]], progress: Progress) -> None:
        if not chunks:
            return
        alone = kind.threaded or sum(map(len, chunks)) == 1 or self.spent < self.patience
        batches = Batches(kind.function, self.common, chunks)
        queue = deque[Index]((i,) for i in range(len(chunks)))
        begun = time.monotonic()
        failed = set[Index]()
        done = 0
        try:
            with closing(
                outcomes(batches, queue, None if alone else self.workers, self.scheduler)
            ) as found:
                for index, outcome in found:
                    if not isinstance(outcome, Raised):
                        self._write(kind.name, chunks[index[0]], outcome)
                        done += 1
                        progress(
                            done / len(chunks),
                            f"{done} of {len(chunks)} chunks" if len(chunks) > 1 else "computing",
                        )
                    elif index in failed:
                        raise SweepError(f"{kind.name} cannot be computed: {outcome.error}")
                    else:
                        failed.add(index)
                        queue.append(index)
        except KeyboardInterrupt:
            kept = (
                f"{self.store} keeps what was computed: run the same again to go on"
                if self.store
                else "nothing is kept"
            )
            raise SweepInterrupted(
                f"interrupted; {kept}{'' if self.store else ' without a store'}"
            ) from None
        self.spent += 0.0 if kind.threaded else time.monotonic() - begun

    def _write(self, name: str, inputs: list[Any], columns: dict[str, Column]) -> None:
        if self.store is not None:
            content = sealed(
                packed({"kind": name, "common": self.common, "inputs": inputs, "columns": columns})
            )
            file = (
                self.store / FOLDER / f"{name}_{_key(name, [self.common, inputs])[-64:-48]}{SUFFIX}"
            )
            try:
                write_durably(file, content, flush=False)
            except OSError as error:
                raise SweepError(
                    f"{file} cannot be written ({(error.strerror or str(error)).lower()}); what was"
                    " computed before is kept: correct this, and the same call continues from there"
                ) from error
        self._keep(name, inputs, columns)

    def _keep(self, name: str, inputs: Sequence[Any], columns: Mapping[str, Column]) -> None:
        for i, given in enumerate(inputs):
            self.known[_key(name, given)] = (
                given,
                {column: entries[i] for column, entries in columns.items()},
            )


def _key(name: str, given: Any) -> str:
    return f"{name} {hashlib.sha256(packed(given)).hexdigest()}"
