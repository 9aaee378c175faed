"""Compile the kernels for each level of processors, into the folder of the package from which the
wheel is built: machine code for this system, this Python and its numba.

    python release/ship_kernels.py [FOLDER]        (of the sources, by default src of this tree)

It takes a minute for each level on two cores.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]


def main(sources: Path) -> None:
    """Compile for all levels."""
    # this tree may be installed, and the sources be another one
    os.environ["PYTHONPATH"] = str(sources)
    sys.path.insert(0, str(sources))
    from saltus.flow import available_cores
    from saltus.preparation import compile_kernels
    from saltus.taylor import shipped

    for name in shipped.LEVELS:
        began = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            asked = {"SALTUS_CACHE_DIR": folder} | shipped.environment_of(name)
            for _ in compile_kernels(available_cores(), asked):
                pass
            count = shipped.ship(Path(folder), name)
        size = sum(path.stat().st_size for path in shipped.folder_of(name).iterdir())
        passed = time.perf_counter() - began
        print(f"{name}: {count} functions, {size / 2**20:.1f} MiB, {passed:.0f} s", flush=True)


if __name__ == "__main__":
    os.environ.pop("SALTUS_LANES", None)
    main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "src")
