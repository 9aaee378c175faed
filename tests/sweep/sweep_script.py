"""Sweeps run as scripts of their own, so that they can be killed, interrupted and measured."""

import json
import resource
import subprocess
import sys

import numpy as np

from saltus.errors import SweepError
from saltus.sweep import Plan, Variable, run, status


def long_plan(chunks=120, **arguments):
    """A sweep of many small chunks; with `pause` each takes as many seconds."""
    variables = {"height": Variable(), "count": Variable(dtype="i4", extra=(("k", 3),))}
    axes = {"x": np.linspace(-1.0, 1.0, chunks), "y": np.linspace(0.0, 1.0, 16)}
    function = "sweep_toys:waves"
    return Plan(
        function=function,
        arguments=arguments,
        axes=axes,
        chunk={"x": 1},
        variables=variables,
        attrs={"kind": "waves"},
    )


def rows_plan(rows):
    """Rows, 25 000 in a chunk, of eight numbers each."""
    axes = {"start": np.linspace(0.0, 1.0, 1000), "row": np.arange(rows // 1000)}
    variables = {"end": Variable(extra=(("k", 8),))}
    return Plan(
        function="sweep_toys:rows", axes=axes, chunk={"start": 1000, "row": 25}, variables=variables
    )


def go_on(store, where, pause, quick=-2.0):
    """Run, saying when: with so many workers, 0 for none, or on the cluster at an address."""
    import zarr  # noqa: F401  # not to be timed

    plan = long_plan(pause=float(pause), quick=float(quick))
    print("go", flush=True)
    place = {"scheduler": where} if "://" in where else {"workers": int(where) or None}
    run(plan, store, progress=lambda _, what: print(what.split()[0], flush=True), **place)


def measure(store, rows):
    """The peak of the memory, in MB, of a sweep of so many rows, and the mean of what it wrote."""
    plan = rows_plan(int(rows))
    dataset = run(plan, store)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"peak": peak, "shape": dataset["end"].shape, "chunks": status(store).done}))


def fill_disk(folder):
    """Run on a small disk of one's own until it is full, make it larger, and go on."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "none", folder], check=True)
    plan, store = long_plan(), f"{folder}/store"
    try:
        run(plan, store)
    except SweepError as error:
        print(error)
    kept = status(store)
    print(kept.done, kept.total)
    print(
        subprocess.run(
            ["find", folder, "-name", ".*.part"], capture_output=True, text=True, check=True
        ).stdout.count("\n")
    )
    subprocess.run(["mount", "-o", "remount,size=64m", folder], check=True)
    dataset = run(plan, store)
    print(dataset.load().identical(run(plan)))


if __name__ == "__main__":
    {"go_on": go_on, "measure": measure, "fill_disk": fill_disk}[sys.argv[1]](*sys.argv[2:])
