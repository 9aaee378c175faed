"""Compile what nearly every test needs, two parts at a time: workers that start together would each
compile it for themselves.
"""

from concurrent.futures import ProcessPoolExecutor
from functools import partial

from saltus.continuation import arithmetic
from saltus.flow.programs.compiled import load_contacts_kernel, load_kernel
from saltus.flow.programs.compiled_lanes import load_driver, load_helpers
from saltus.flow.programs.orbit_segments import (
    load_contact_equations,
    load_contact_segments,
    load_segments,
)
from saltus.web.objects import kernel_code

# The kernels that all models share, here and on pages, those that take longest first.
PARTS = {
    "driver": load_driver,
    "driver for contacts": partial(load_driver, several=True),
    "page's kernel for contacts": partial(kernel_code, True),
    "kernel": load_kernel,
    "kernel for contacts": load_contacts_kernel,
    "segments for contacts": load_contact_segments,
    "segments": load_segments,
    "page's kernel": partial(kernel_code, False),
    "arithmetic of curves": arithmetic,
    "equations for contacts": load_contact_equations,
    "helpers": load_helpers,
    "helpers for contacts": partial(load_helpers, several=True),
}


def compile_part(name: str) -> None:
    """One of the kernels that all models share."""
    PARTS[name]()


if __name__ == "__main__":
    with ProcessPoolExecutor(2) as processes:
        list(processes.map(compile_part, PARTS))
