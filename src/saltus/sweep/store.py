"""The Zarr store of a sweep: made in one step, written chunk by chunk, readable by any reader of
Zarr v3 at any time.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered
from saltus.errors import ParameterError, SweepError, shown
from saltus.files import write_durably
from saltus.sweep import store_files as files
from saltus.sweep.chunks import Arrays, Failure, Index
from saltus.sweep.plan import Plan, differences
from saltus.sweep.store_status import damage, damaged_chunks, read_plan, status

if TYPE_CHECKING:
    import xarray


# bytes: file systems allow 255, and half-written files have longer names
LONGEST_NAME_OF_A_FILE = 200
BEGIN_ANEW = "name another store, or begin anew (`sweep.remove_store`, `saltus run --fresh`)"

log = logging.getLogger("saltus.sweep")


class Store:
    """The arrays of a plan, in a folder.

    A chunk is done when the files of all variables are there. A file is written once, and is
    complete or not there. Its bytes depend on the computed numbers alone, not on who wrote the
    store, when, or in which order.
    """

    def __init__(self, plan: Plan, path: Path) -> None:
        import zarr

        self.plan = plan
        self.path = path
        self.zarr = _zarr_store(path)
        # Otherwise a chunk of nothing but fill values has no file, and would never be done.
        with zarr.config.set({"array.write_empty_chunks": True}):
            group: Any = zarr.open_group(self.zarr, mode="r+")
            self.arrays = {name: group[name] for name in plan.variables}

    def missing(self) -> list[Index]:
        """The chunks that are not done; a file that is damaged is removed first, so that its chunk
        is computed again.

        Raises
        ------
        SweepError
            A damaged file cannot be removed.
        """
        extra = {name: len(variable.extra) for name, variable in self.plan.variables.items()}
        for name, index in damaged_chunks(self.path, self.arrays, self.plan.chunks, extra):
            file = files.chunk_file(self.path, name, index, extra[name])
            log.warning("%s is damaged; its chunk is computed again", file)
            try:
                file.unlink()
            except OSError as error:
                raise SweepError(
                    f"{file} is damaged and cannot be removed ({reason(error)})"
                ) from error
        found = [
            files.chunks_of(self.path, name, self.plan.chunks.grid, count).there
            for name, count in extra.items()
        ]
        return [tuple(map(int, index)) for index in np.argwhere(~np.logical_and.reduce(found))]

    def write(self, index: Index, values: Arrays) -> None:
        """Keep a chunk: the files that are not there yet, if an earlier run was killed among them.

        Raises
        ------
        SweepError
            The store cannot be written to.
        """
        cut = self.plan.chunks.slices(index)
        try:
            for name, array in self.arrays.items():
                if not self._has(name, index):
                    array[cut] = values[name]
        except OSError as error:
            raise SweepError(
                f"chunk {'/'.join(map(str, index))} cannot be written to {self.path}"
                f" ({reason(error)}); the chunks before it are kept: correct this, and the same "
                f"call continues from there"
            ) from error

    def drop(self, index: Index) -> None:
        """Remove a chunk, which is then computed again."""
        for name, variable in self.plan.variables.items():
            files.chunk_file(self.path, name, index, len(variable.extra)).unlink(missing_ok=True)

    def note(self, failures: Iterable[Failure]) -> None:
        """Keep a list of the failed chunks beside the arrays, for `status`; without failures the
        file is removed.
        """
        entries = [
            {"index": f.index, "place": f.place, "error": f.error, "attempts": f.attempts}
            for f in failures
        ]
        file = self.path / files.FAILURES
        with contextlib.suppress(OSError):  # a full disk is reported when a chunk is written
            if entries:
                write_durably(file, json.dumps(entries).encode())
            else:
                file.unlink(missing_ok=True)

    def dataset(self) -> xarray.Dataset:
        """The dataset of the chunks that are there, read from the folder as it is needed."""
        return _dataset(self.zarr)[list(self.plan.variables)]

    def _has(self, name: str, index: Index) -> bool:
        extra = len(self.plan.variables[name].extra)
        return files.chunk_file(self.path, name, index, extra).exists()


@contextlib.contextmanager
def opened(plan: Plan, path: Path) -> Iterator[Store]:
    """The store of `plan` at `path`, made if it is not there, and locked.

    Raises
    ------
    ParameterError
        There is something else at `path`, or the store of another plan.
    SweepError
        The store cannot be made, or another run is writing to it.
    """
    check_store(plan, path)
    if not (path / files.METADATA).is_file():  # the lock is on this file
        (_restore if (path / files.CHECKSUMS).is_file() else _create)(plan, path)
    with files.locked(path) as got:
        if got is False:
            raise SweepError(
                f"another run is writing to {path}; wait for it, or stop it, and run again"
            )
        if got:
            files.sweep_up(path)
        if files.damaged_files(path):
            _restore(plan, path)
        yield Store(plan, path)


def check_store(plan: Plan, path: Path) -> None:
    """Refuse a path at which there is something else than the store of `plan`.

    Raises
    ------
    ParameterError
        The message says what is there, or what is so damaged that the plan of the store is not
        known.
    """
    if not 0 < len(os.fsencode(path.name)) <= LONGEST_NAME_OF_A_FILE:
        raise ParameterError(
            f"store must name a folder, such as 'chart.zarr', got {shown(str(path))}", "store"
        )
    if (path / files.METADATA).is_file() or (path / files.CHECKSUMS).is_file():
        if files.damaged_files(path):
            _restorable(plan, path)
            return
        differ = list(differences(read_plan(path), plan.describe()))
        if differ:
            more = f"; and {len(differ) - 3} more" if len(differ) > 3 else ""
            raise ParameterError(
                f"{path} is the store of another plan:"
                f" {'; '.join(f'{each:.90}' for each in differ[:3])}{more}; {BEGIN_ANEW}",
                "store",
            )
    elif path.is_file() or (path.is_dir() and any(path.iterdir())):
        kind = "a file" if path.is_file() else "a folder with something else in it"
        raise ParameterError(
            f"{path} is {kind}; name a store that does not exist yet, or one of this plan", "store"
        )


@answered
def remove_store(path: Path | str) -> None:
    """Remove the store at `path`, if there is one.

    Parameters
    ----------
    path
        The folder.

    Raises
    ------
    ParameterError
        There is something else at `path`.
    SweepError
        A run is writing to the store, or it cannot be removed.

    Examples
    --------
    >>> saltus.sweep.remove_store("nowhere.zarr")
    """
    path = Path(path)
    if not os.path.exists(path):  # also False for a name that is too long
        return
    if not ((path / files.METADATA).is_file() or (path / files.CHECKSUMS).is_file()):
        raise ParameterError(
            f"{path} is not a store, so it is not removed; name another place", "path"
        )
    if files.in_use(path):
        raise SweepError(f"a run is writing to {path}; wait for it, or stop it, and run again")
    try:
        shutil.rmtree(path)
    except OSError as error:
        raise SweepError(f"{path} cannot be removed ({reason(error)})") from error


def _restorable(plan: Plan, path: Path) -> dict[str, bytes]:
    """The content of the damaged files of a store that is made anew from its plan: metadata and
    coordinates, no chunks.

    Raises
    ------
    ParameterError
        The intact files do not show that the store is of this plan.
    """
    damaged = files.damaged_files(path)
    with tempfile.TemporaryDirectory() as folder:
        new = Path(folder)
        _make(plan, new)
        expected = files.checksums(new)
        content = {name: (new / name).read_bytes() for name in (*expected, files.CHECKSUMS)}
    try:
        kept = files.checksums(path)
    except (OSError, ValueError):
        kept = {}
    intact = {
        name
        for name in content
        if (path / name).is_file() and (path / name).read_bytes() == content[name]
    }
    # it holds the plan
    if files.METADATA in intact or kept.get(files.METADATA) == expected[files.METADATA]:
        return {name: content[name] for name in content if name not in intact}
    if files.METADATA not in damaged and all(
        kept.get(name, "") == expected.get(name) for name in damaged
    ):
        return {name: content[name] for name in damaged}
    raise ParameterError(
        f"{path / damaged[0]} is damaged, so the store cannot be continued; {BEGIN_ANEW}",
        "store",
    )


def _restore(plan: Plan, path: Path) -> None:
    """Write the damaged files of a store again, the list of checksums last."""
    for name, content in _restorable(plan, path).items():
        log.warning("%s is damaged; it is written again", path / name)
        try:
            write_durably(path / name, content)
        except OSError as error:
            raise SweepError(
                f"{path / name} is damaged and cannot be written again ({reason(error)})"
            ) from error


@answered
def open_store(path: Path | str, *, partial: bool = False) -> xarray.Dataset:
    """The dataset of a sweep's store, read as it is needed; `load()` reads it all.

    Parameters
    ----------
    path
        The store.
    partial
        Whether it may be incomplete; chunks that are not computed yet have each variable's fill
        value, NaN for reals.

    Raises
    ------
    ParameterError
        There is no store of a sweep at `path`.
    SweepError
        The store is incomplete or damaged.

    Examples
    --------
    >>> saltus.sweep.open_store("nowhere.zarr")
    Traceback (most recent call last):
        ...
    saltus.errors.ParameterError: there is no store at nowhere.zarr
    """
    found = status(path, verify=True)
    if found.damaged:
        raise SweepError(f"{damage(found)}; run the sweep again, and it is computed anew")
    if not (found.complete or partial):
        raise SweepError(
            f"{path} has {found.done} of {found.total} chunks; run the sweep again to complete it,"
            " or give partial=True"
        )
    try:
        return _dataset(_zarr_store(Path(path)))
    except (
        AttributeError,
        IndexError,
        KeyError,
        NotImplementedError,
        TypeError,
        ValueError,
    ) as error:  # as forged metadata may
        raise ParameterError(
            f"{path} cannot be read as a Zarr store ({type(error).__name__}: {error!s:.80})", "path"
        ) from None


def reason(error: OSError) -> str:
    """The operating system's reason for an error, as part of a sentence."""
    return (error.strerror or str(error)).lower()


def _zarr_store(folder: Path) -> Any:
    """Zarr's store in a folder, in which every file is flushed to the disk before it gets its name.

    Zarr's own store also writes a file under another name and renames it, but does not wait for the
    disk, so that after a power failure a name may stand without its content. Here a name means that
    the chunk is done.
    """
    import asyncio

    from zarr.storage import LocalStore

    class DurableStore(LocalStore):
        async def set(self, key: str, value: Any) -> None:
            self._check_writable()
            await asyncio.to_thread(write_durably, self.root / key, value.to_bytes())

        def set_sync(self, key: str, value: Any) -> None:
            self._check_writable()
            write_durably(self.root / key, value.to_bytes())

    return DurableStore(folder)


def _dataset(store: Any) -> xarray.Dataset:
    import xarray

    # Nothing is decoded, so that a variable in seconds stays a number and a fill value stays a
    # value.
    dataset: xarray.Dataset = xarray.open_zarr(
        store, chunks=None, consolidated=True, zarr_format=3, decode_cf=False
    )
    return dataset


def _create(plan: Plan, path: Path) -> None:
    """Make the store of `plan`, without any chunk, at `path`, in one step.

    Ctrl-C waits until it is made: Zarr writes in a thread of its own, which would go on writing
    into a folder that is removed.
    """
    with files.deferred_interrupts() as raise_if_interrupted:
        try:
            part = files.begin(path)
            try:
                _make(plan, part)
            except BaseException:
                shutil.rmtree(part, ignore_errors=True)
                raise
            files.finish(part, path)
        except OSError as error:
            raise SweepError(
                f"the store {path} cannot be made ({reason(error)}); name another"
            ) from error
    raise_if_interrupted()


def _make(plan: Plan, folder: Path) -> None:
    """Write the metadata and the coordinates, then their checksums; none of these files is ever
    written again.
    """
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    # Zarr's own choice, and a checksum of each chunk
    store = _zarr_store(folder)
    codecs = [ZstdCodec(level=0), Crc32cCodec()]
    group = zarr.create_group(store, zarr_format=3, attributes=plan.attributes)
    for name, values in plan.axes.items():
        coordinate = group.create_array(
            name,
            shape=values.shape,
            chunks=values.shape,
            dtype=values.dtype,
            dimension_names=[name],
            compressors=codecs,
        )
        coordinate[:] = values
    for name, variable in plan.variables.items():
        group.create_array(
            name,
            shape=plan.shape(name),
            chunks=(*plan.chunks.chunk.values(), *(size for _, size in variable.extra)),
            dtype=np.dtype(variable.dtype),
            dimension_names=list(plan.dimensions(name)),
            fill_value=variable.fill,
            compressors=codecs,
            attributes=dict(variable.attrs),
        )
    _consolidate(folder, sorted((*plan.axes, *plan.variables)))
    files.write_checksums(folder)


def _consolidate(folder: Path, names: list[str]) -> None:
    """Copy the metadata of all arrays into the group's, where xarray reads them at once.

    Zarr's own function for it warns that its specification does not have them yet, and Python
    cannot be told in one thread alone not to show a warning.
    """
    group = json.loads((folder / files.METADATA).read_text(encoding="utf-8"))
    arrays = {
        name: json.loads((folder / name / files.METADATA).read_text(encoding="utf-8"))
        for name in names
    }
    group["consolidated_metadata"] = {
        "kind": "inline",
        "must_understand": False,
        "metadata": arrays,
    }
    write_durably(folder / files.METADATA, json.dumps(group, indent=2).encode())
