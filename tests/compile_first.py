"""Compile what nearly every test needs, two parts at a time: workers that start together would each compile it for themselves."""

from concurrent.futures import ProcessPoolExecutor

from saltus.flow.compiled import load_kernel, load_segments
from saltus.flow.ensemble.compiled_lanes import load_driver, load_helpers


def compile_part(name: str) -> None:
    """One of the kernels that all models share."""
    {"driver": load_driver, "kernel": load_kernel, "segments": load_segments, "helpers": load_helpers}[name]()


if __name__ == "__main__":
    with ProcessPoolExecutor(2) as processes:
        list(processes.map(compile_part, ("driver", "kernel", "segments", "helpers")))
