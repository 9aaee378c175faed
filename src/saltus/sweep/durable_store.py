"""Zarr's store in a folder, made to last. Zarr is imported with this module, so this module is imported only when needed."""

from __future__ import annotations

import asyncio

from zarr.core.buffer import Buffer
from zarr.storage import LocalStore

from saltus.sweep.store_files import write_whole


class WholeStore(LocalStore):
    """A folder in which every file is brought to the disk before it has its name.

    Zarr's own writes beside and renames too, but without that a power failure may leave a name without content, and here a name
    means done; and what a kill leaves half-written has a name here by which it is found.
    """

    async def set(self, key: str, value: Buffer) -> None:
        """Write a file, whole."""
        self._check_writable()
        await asyncio.to_thread(write_whole, self.root / key, value.to_bytes())

    def set_sync(self, key: str, value: Buffer) -> None:
        """Write a file, whole."""
        self._check_writable()
        write_whole(self.root / key, value.to_bytes())
