"""Compiling all kernels at once, before they are needed: for a machine, and for a wheel."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping

from saltus.continuation import arithmetic
from saltus.errors import SaltusError
from saltus.flow.programs.compiled import load_contacts_kernel, load_fillers, load_kernel
from saltus.flow.programs.compiled_lanes import load_driver, load_helpers
from saltus.flow.programs.orbit_segments import (
    load_contact_equations,
    load_contact_segments,
    load_segments,
)

# All kernels but those of proofs; what takes longest comes first.
KERNELS: dict[str, Callable[[], object]] = {
    "motions of several contacts": load_contacts_kernel,
    "lanes of several contacts": lambda: load_driver(True),
    "lanes of one contact": load_driver,
    "orbits of several contacts": load_contact_segments,
    "helpers of several contacts": lambda: load_helpers(True),
    "motions of one contact": load_kernel,
    "orbits of one contact": load_segments,
    "steps along branches": arithmetic,
    "helpers of one contact": load_helpers,
    "equations of several contacts": load_contact_equations,
    "tables": load_fillers,
}


def compile_kernels(
    workers: int, environment: Mapping[str, str] | None = None
) -> Iterator[tuple[str, int]]:
    """Compile the kernels that are not compiled yet, each in a process of its own, with more in its
    environment if asked; the names of those that are done, with how many are left.

    Raises
    ------
    SaltusError
        A process has failed.
    """
    waiting = list(KERNELS)
    running = dict[str, subprocess.Popen[bytes]]()
    found = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import KERNELS; "
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                name = waiting.pop(0)
                running[name] = subprocess.Popen(
                    [sys.executable, "-c", f"{found}KERNELS[{name!r}]()"],
                    env=os.environ | dict(environment or {}),
                )
            name = _first_done(running)
            if running.pop(name).returncode:
                raise SaltusError(f"the kernel for {name} could not be compiled")
            yield name, len(waiting) + len(running)
    finally:
        for process in running.values():  # one of them has failed, or nobody waits any longer
            process.terminate()


def _first_done(running: Mapping[str, subprocess.Popen[bytes]]) -> str:
    """The name of a process that has ended; waits until one has."""
    while True:
        for name, process in running.items():
            try:
                process.wait(0.1)
            except subprocess.TimeoutExpired:
                continue
            return name
