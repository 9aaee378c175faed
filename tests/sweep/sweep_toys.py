"""Cheap functions to sweep, with NumPy alone; each is a function of its arguments and its block."""

import os
import time
from pathlib import Path

import numpy as np


def waves(arguments, block):
    """A real and an integer array over a grid of two axes, one with a dimension of its own; some
    values are NaN.

    It takes `pause` seconds, or where x is at most `quick` none.
    """
    if block["x"][0] > arguments.get("quick", -1e9):
        time.sleep(arguments.get("pause", 0.0))
    x, y = np.meshgrid(block["x"], block["y"], indexing="ij")
    height = np.where(x * y < arguments.get("hole", -1e9), np.nan, np.sin(3 * x) * np.cos(y))
    return {"height": height, "count": (10 * x[..., None] + np.arange(3)).astype("i4")}


def draws(arguments, block):
    """Random numbers, from a seed that the arguments and the block give."""
    x, y = block["x"], block["y"]
    rng = np.random.default_rng(
        [arguments["seed"], x.tobytes()[0], *np.frombuffer(x.tobytes() + y.tobytes(), dtype="u4")]
    )
    return {
        "height": rng.normal(size=(len(x), len(y))),
        "count": rng.integers(0, 9, size=(len(x), len(y), 3)),
    }


def fails(arguments, block):
    """Raises in the chunks that hold the x in `bad`, until the file `until`, if there is one,
    exists.
    """
    if (
        set(arguments["bad"]) & set(block["x"].tolist())
        and not Path(arguments.get("until", "/none")).exists()
    ):
        raise ValueError(f"no wave at {block['x'][0]}")
    return waves(arguments, block)


def fails_once(arguments, block):
    """Raises the first time that each chunk is tried; the folder `seen` remembers."""
    mark = Path(arguments["seen"]) / f"{block['x'][0]}-{block['y'][0]}"
    if not mark.exists():
        mark.touch()
        raise RuntimeError("not the first time")
    return waves(arguments, block)


def dies(arguments, block):
    """Ends its process where x holds `bad`, once or always."""
    mark = Path(arguments["mark"])
    if arguments["bad"] in block["x"].tolist() and not mark.exists():
        if not arguments.get("always"):
            mark.touch()
        os._exit(9)
    return waves(arguments, block)


def returns(arguments, block):
    """What the arguments ask for instead of what was planned."""
    result = waves(arguments, block)
    wrong = arguments["wrong"]
    if wrong == "no dict":
        return [1.0]
    if wrong == "missing":
        del result["count"]
    elif wrong == "too many":
        result["heigth"] = result["height"]
    elif wrong == "shape":
        result["height"] = result["height"].T
    elif wrong == "type":
        result["count"] = result["count"].astype(float)
    elif wrong == "range":
        result["count"] = result["count"].astype("i8") + 2**40
    return result


def kinds(arguments, block):
    """A value of x as every kind of number."""
    return {kind: block["x"].astype(kind) for kind in arguments["kinds"]}


def greedy(arguments, block):
    """Spoils its arguments and its block."""
    result = waves({"hole": arguments["list"].pop()}, block)
    block["x"][:] = 0.0
    return result


def rows(arguments, block):
    """Eight numbers for each of many rows."""
    start, row = np.meshgrid(block["start"], block["row"], indexing="ij")
    return {"end": np.sin(start[..., None] + row[..., None] * np.arange(1, 9))}


not_a_function = 3
