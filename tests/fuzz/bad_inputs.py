"""Makers of bad studies, records, JSON and files: each is the same for the same seed."""

import copy
import json
import math
import random

import tomli_w

VALUES = (
    *(
        0,
        1,
        -1,
        2,
        0.5,
        -0.0,
        1e-320,
        1e22,
        1e308,
        -1e308,
        2**63 - 1,
        2**64,
        math.nan,
        math.inf,
        -math.inf,
        True,
        False,
    ),
    *(
        "",
        "a",
        "80 deg",
        "[red]",
        "[/]",
        "$x_",
        "\x1b[2J",
        "é" * 300,
        "self",
        "__class__",
        "../../etc/passwd",
        "load.frequency",
    ),
    *(
        [],
        [1],
        [1, 2],
        [2, 1],
        [[0, 1], [0, 1]],
        [math.nan],
        ["a"],
        {},
        {"self": 1},
        {"from": 0, "to": 1, "count": 2},
    ),
    *(
        {"from": 0, "to": 1, "count": 1e9},
        {"amplitude": 1e308},
        {"type": "Metainterface"},
        {"time": [0, 1], "value": [0, 1]},
    ),
)
STUDY = {
    "model": {"type": "Metainterface", "beta0": 1.4, "damping": 0.1},
    "load": {"frequency": 1.0, "horizontal": {"amplitude": 0.5}, "vertical": -0.5},
    "impact": {"type": "VelocityReduction", "e": 0.9},
    "simulate": {"theta": 0.3, "periods": 3},
    "bifurcation_diagram": {"path": "load.frequency", "bounds": [0.5, 1.0], "starts": 4, "seed": 1},
    "attractors": {"starts": 4, "seed": 1, "max_period": 2},
    "stability_chart": {
        "horizontal": [0.1, 0.2],
        "vertical": [-0.5, -0.4],
        "starts": 2,
        "periods": 40,
    },
}
# one of other classes: a structure with contacts, and a chain of cells
STRUCTURE = {
    "model": {
        "type": "Structure",
        "mass": [[1.0, 0.0], [0.0, 2.0]],
        "stiffness": [[2.0, -1.0], [-1.0, 1.0]],
        "contacts": [{"name": "wall", "coordinate": 1, "position": 0.5, "sign": -1}],
        "surfaces": [{"name": "soft", "coordinate": "x0", "position": 0.4, "stiffness": 3.0}],
        "friction": [],
        "forces": {"drive": [1.0, 0.0]},
    },
    "load": {"frequency": 1.0, "drive": {"amplitude": 0.5}},
    "impact": {"type": "NewtonImpact", "e": 0.5},
    "simulate": {"x0": 0.1, "x1": 0.0, "periods": 2},
}
CHAIN = {
    "model": {"type": "CellChain", "beta0": 1.4, "cells": 2},
    "load": {"frequency": 1.0, "horizontal": {"amplitude": 0.1}, "vertical": -0.5},
    "impact": {"type": "NewtonImpact", "e": 0.5},
    "attractors": {"starts": 4, "seed": 1, "max_period": 2},
}
NAMES = (
    *[
        "type",
        "beta0",
        "damping",
        "frequency",
        "amplitude",
        "order",
        "time",
        "value",
        "file",
        "self",
        "x",
        "theta",
        "seed",
        "starts",
        "window",
        "curves",
        "mass",
        "contacts",
        "position",
        "restitution",
        "interpolation",
        "quantity",
    ],
    "é",
    "a.b",
)


def mutated(rng: random.Random, tree, times: int):
    """A tree of dicts and lists with so many changes: a value replaced, a key renamed, added or
    left out.
    """
    tree = copy.deepcopy(tree)
    for _ in range(times):
        place = tree
        while isinstance(place, dict) and place:
            key = rng.choice(sorted(place))
            if isinstance(place[key], dict) and place[key] and rng.random() < 0.75:
                place = place[key]
                continue
            change = rng.randrange(4)
            if change == 0:
                del place[key]
            elif change == 1:
                place[rng.choice(NAMES)] = place.pop(key)
            elif change == 2:
                place[rng.choice(NAMES)] = copy.deepcopy(rng.choice(VALUES))
            else:
                place[key] = copy.deepcopy(rng.choice(VALUES))
            break
    return tree


def damaged(rng: random.Random, content: bytes) -> bytes:
    """Bytes with a bit flipped, a part cut, zeroed, doubled or written over."""
    if not content:
        return bytes(rng.randrange(256) for _ in range(8))
    start, length = rng.randrange(len(content)), rng.choice((1, 4, 64, 1000))
    part = slice(start, start + length)
    change = rng.randrange(5)
    if change == 0:
        return (
            content[:start] + bytes([content[start] ^ 1 << rng.randrange(8)]) + content[start + 1 :]
        )
    if change == 1:
        return content[:start]
    new = (
        bytes(len(content[part])),
        content[part] * 2,
        rng.randbytes(min(length, len(content) - start)),
    )[change - 2]
    return content[:start] + new + content[part.stop :]


def study(rng: random.Random) -> bytes:
    """A study that is wrong in a few places, or whose text is."""
    whole = rng.choice((STUDY, STUDY, STRUCTURE, CHAIN))
    text = tomli_w.dumps(mutated(rng, whole, rng.randrange(1, 4))).encode("utf-8", "surrogatepass")
    return damaged(rng, text) if rng.random() < 0.3 else text


def record(rng: random.Random) -> bytes:
    """A record of a few samples that is wrong in a few places."""
    separator = rng.choice((",", ";", "\t", " ", ", "))
    rows = [
        [
            str(i),
            str(
                rng.choice((0.5, -1, 1e308, "nan", "1,5", "x", "", '"2"'))
                if rng.random() < 0.2
                else i
            ),
        ]
        for i in range(6)
    ]
    if rng.random() < 0.3:
        rows[rng.randrange(6)].append("7")
    if rng.random() < 0.2:
        rng.shuffle(rows)
    text = "\n".join(separator.join(row) for row in rows).encode()
    return damaged(rng, text) if rng.random() < 0.4 else text


HEADINGS = (
    "PEER\nA record\n{kind} TIME HISTORY IN UNITS OF {unit}\nNPTS= {count}, DT= {step} SEC\n",
    "PEER\nA record\n{kind} IN UNITS OF {unit}\n {count} {step} NPTS, DT\n",
    "Corrected\n {count} points of {kind} data equally spaced at {step} sec, in {unit}. (4f10.3)\n",
    "Corrected\n {count} POINTS OF {kind} DATA EQUALLY SPACED AT {step} SEC. (UNITS: {unit})\n",
    "Corrected\n {count} {kind} pts a 50 pts/sec, units={unit} (02),Format=(4F10.3)\n",
    "Corrected\n {count} {kind} pts, approx {step} secs, units={unit},Format=(4F10.3)\n",
)
FIELDS = {
    "kind": ("accel", "velocity", "DISPL", "", "acc" * 50),
    "unit": ("G", "cm/sec2", "CM/S", "g*100", "0.1 mm", "", "x" * 500, "gal"),
    "count": ("8", "8", "8", "0", "-1", "8.5", "9" * 30, "1e1", ""),
    "step": (".02", ".02", "2D-2", "1/50", "0", "-1", "nan", "1.2.3", "1e400", "20 m"),
}


def record_file(rng: random.Random) -> bytes:
    """A file of PEER, CSMIP or COSMOS that is wrong in a few places."""
    said = {
        name: rng.choice(values[:2] if rng.random() < 0.5 else values)
        for name, values in FIELDS.items()
    }
    numbers = [f"{rng.uniform(-1, 1):10.3f}" for _ in range(8)]
    if rng.random() < 0.2:
        numbers[rng.randrange(8)] = rng.choice(
            ("       nan", "*" * 10, "1" * 5000 + "x", "+1+1+1+1+1")
        )
    lines = "".join(numbers[:4]) + "\n" + "".join(numbers[4:]) + "\n"
    text = (rng.choice(HEADINGS).format(**said) + lines).encode()
    return damaged(rng, text) if rng.random() < 0.5 else text


def system_json(rng: random.Random) -> str:
    """The JSON of a system that is wrong in a few places, or whose text is."""
    tree = mutated(
        rng, {name: STUDY[name] for name in ("model", "load", "impact")}, rng.randrange(1, 4)
    )
    text = json.dumps(tree)
    if rng.random() < 0.3:
        text = damaged(rng, text.encode()).decode("utf-8", "replace")
    return rng.choice(("[" * 5000, '{"model":' * 5000, "1" * 5000)) if rng.random() < 0.01 else text
