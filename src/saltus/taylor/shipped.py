"""Compiled kernels that come with a wheel, so that the first use of a model compiles none of them.

A wheel may hold the kernels' machine code for some levels of processors, as numba has compiled it
where the wheel was built (`release/ship_kernels.py`). Code is read from there only if all that it
depends on is the same. That is the kernel's text, of which a digest is in the file's name, the
versions of Python, numba and llvmlite, and the system. No setting may ask numba for another
processor, either. Otherwise the kernels are compiled, as without a wheel.
"""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
from llvmlite import binding

from saltus.taylor.cache import with_digest, without_digest


class Level(NamedTuple):
    """A level of processors."""

    needed: tuple[str, ...]  # the features that a processor of this level has
    lanes: int  # the width of its vectors, see `vectors.py`
    features: str = ""  # what LLVM is told beside the level's name


# The levels that a wheel may have code for, the highest first, by LLVM's names. LLVM would not use
# whole vectors of AVX-512, which slow processors of 2017 down.
LEVELS = {
    "x86-64-v4": Level(
        ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"), 16, "-prefer-256-bit"
    ),
    "x86-64-v3": Level(("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"), 4),
}
FOLDER = Path(__file__).parent / "shipped_kernels"
SUFFIX = ".code"


@cache
def level() -> str | None:
    """The highest level that this processor has, or None; also if numba is to compile for another
    processor.
    """
    from numba import config

    settings: Any = config
    other = settings.CPU_NAME is not None or settings.CPU_FEATURES is not None
    return None if other else level_of_machine()


def level_of_machine() -> str | None:
    """The highest level that this machine's processor has, or None."""
    features = binding.get_host_cpu_features()
    return next(
        (name for name, kind in LEVELS.items() if all(map(features.get, kind.needed))), None
    )


def folder_of(name: str) -> Path:
    """The folder of the code for a level, as this Python's packages compile it."""
    import numba

    made_by = f"numba-{numba.__version__}-llvmlite-{llvmlite.__version__}"
    return FOLDER / f"{made_by}-{binding.get_process_triple()}-{name}"


@cache
def _folder() -> Path | None:
    name = level()
    folder = None if name is None else folder_of(name)
    return folder if folder is not None and folder.is_dir() else None


def shipped_level() -> str | None:
    """The level of processors whose kernels came with this wheel and are used here, or None."""
    return None if _folder() is None else level()


def is_shipped(stem: str) -> bool:
    """Whether there is code of a module whose file has this name."""
    folder = _folder()
    python = f"py{sys.version_info[0]}{sys.version_info[1]}"
    return folder is not None and any(folder.glob(f"{stem}.*.{python}{SUFFIX}"))


def shipped_code(name: str) -> bytes | None:
    """The code of a function by the name that numba's cache has for it, or None."""
    folder = _folder()
    if folder is None:
        return None
    try:
        return without_digest((folder / f"{name}{SUFFIX}").read_bytes())
    except OSError:
        return None


def environment_of(name: str) -> dict[str, str]:
    """The environment of processes that compile for a level."""
    kind = LEVELS[name]
    return {
        "NUMBA_CPU_NAME": name,
        "NUMBA_CPU_FEATURES": kind.features,
        "SALTUS_LANES": str(kind.lanes),
    }


def ship(cached: Path, name: str) -> int:
    """Put the code of a cache that was compiled for a level where wheels have it; how many
    functions there were.

    numba writes into it where the source of a function and its own package lie. A wheel says
    nothing of the machine that built it.
    """
    import numba

    folders = (cached, Path(numba.__file__).parents[1])
    target = folder_of(name)
    target.mkdir(parents=True, exist_ok=True)
    count = 0
    for path in sorted((cached / "kernels" / "__pycache__").glob("*.nbc")):
        code = without_digest(path.read_bytes())
        if code is None:
            continue
        for folder in folders:
            code = _without_folder(code, folder)
        written = target / f"{path.name.removesuffix('.1.nbc')}{SUFFIX}"
        written.write_bytes(with_digest(code))
        os.utime(written, (0, 0))
        count += 1
    return count


def _without_folder(code: bytes, folder: Path) -> bytes:
    """Pickled code with another path of the same length, as pickles count bytes."""
    path = os.fsencode(folder)
    return code.replace(path, b".".ljust(len(path), b"/"))
