"""Zarr's store in a folder, made to last. Zarr is imported with this module, so this module is imported only when needed."""

from __future__ import annotations

import asyncio

from zarr.core.buffer import Buffer
from zarr.storage import LocalStore

from saltus.files import write_durably


class DurableStore(LocalStore):
    """A folder in which every file is flushed to the disk before it gets its name.

    Zarr's own store also writes a file under another name and renames it, but does not wait for the disk, so that after a power
    failure a name may stand without its content. Here a name means that the chunk is done. Files that a killed run has left
    half-written have names by which they are found.
    """

    async def set(self, key: str, value: Buffer) -> None:
        """Write a file so that it is complete or not there."""
        self._check_writable()
        await asyncio.to_thread(write_durably, self.root / key, value.to_bytes())

    def set_sync(self, key: str, value: Buffer) -> None:
        """Write a file so that it is complete or not there."""
        self._check_writable()
        write_durably(self.root / key, value.to_bytes())
