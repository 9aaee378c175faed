"""The check that the arrays of a store are those of its plan: by its JSON, before Zarr reads any of it.

Zarr accepts whatever the metadata say: arrays of its older format, whose filters may be pickles that run code, any codec that is
installed, and shapes of any size. The store of a sweep has none of these; a store that has them was changed by somebody else.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from saltus.checks import check_memory
from saltus.errors import ParameterError
from saltus.sweep.chunk_grid import ChunkGrid

CODECS = ["bytes", "zstd", "crc32c"]  # as `store` makes them


def check_arrays(where: str, group: dict[str, Any], plan: dict[str, Any], chunks: ChunkGrid) -> None:
    """Refuse a store, called `where`, whose metadata describe other arrays than those of its plan.

    Raises
    ------
    ParameterError
        An array differs, which the message names; or the coordinates need more memory than there is.
    """
    try:
        expected = dict(_expected(plan, chunks))
        found = group["consolidated_metadata"]["metadata"]
        other = "" if group["zarr_format"] == 3 and set(found) == set(expected) else "the list of its arrays"
        other = other or next((f"the array {name!r}" for name, array in expected.items() if _described(found[name]) != array), "")
    except (KeyError, TypeError, ValueError, AttributeError):
        other = "what it says of its arrays"
    if other:
        raise ParameterError(f"{where} is no store that saltus has made: {other} is not that of its plan", "path")
    check_memory(where, 8.0 * sum(map(float, chunks.sizes.values())), "its coordinates")


def _expected(plan: dict[str, Any], chunks: ChunkGrid) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each array of a plan: its name, and the description that its metadata must match."""
    for name, size in chunks.sizes.items():
        yield name, _array(plan["axes"][name]["dtype"], [name], [size], [size])
    for name, variable in plan["variables"].items():
        extra, sizes = [str(each) for each, _ in variable["extra"]], [size for _, size in variable["extra"]]
        shape, chunk = [*chunks.sizes.values(), *sizes], [*chunks.chunk.values(), *sizes]
        yield name, _array(variable["dtype"], [*chunks.sizes, *extra], shape, chunk)


def _array(dtype: str, dimensions: list[str], shape: list[int], chunk: list[int]) -> dict[str, Any]:
    return {
        "zarr_format": 3,
        "node_type": "array",
        "data_type": dtype,
        "dimension_names": dimensions,
        "shape": shape,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "codecs": CODECS,
        "storage_transformers": [],
        "filled": True,  # Zarr before 3.1 would take 0 for a fill value that is not there
    }


def _described(metadata: dict[str, Any]) -> dict[str, Any]:
    """The description of an array by its metadata, in the form of `_array`."""
    said = {key: metadata.get(key) for key in _array("", [], [], [])}
    codecs = [codec if isinstance(codec, str) else codec["name"] for codec in metadata["codecs"]]
    filled = metadata.get("fill_value") is not None
    return said | {"codecs": codecs, "storage_transformers": list(metadata.get("storage_transformers") or []), "filled": filled}
