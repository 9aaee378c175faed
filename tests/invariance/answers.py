"""The motion of a recipe in the terms of the recipe that it was made of, and how two of them
differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from random_systems import INERT, Recipe

import saltus

SAME_TIME = 1e-7  # in units of the recipe: events so close together have no order


@dataclass(frozen=True)
class Answer:
    """What a motion says, without units, origin, order and inert parts."""

    stop: str
    events: tuple[tuple[str, tuple[str, ...]], ...]  # kinds and the names of their parts
    times: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    highest_speed: float
    closed: frozenset[str]
    sliding: dict[str, int]
    sides: dict[str, int]
    error: str = ""


@dataclass(frozen=True)
class Difference:
    """How two answers differ: what is discrete, in words ("" if it is equal), and the largest
    difference of numbers, in units of their own size (at least 1).
    """

    discrete: str
    numeric: float


def states_in_first_terms(recipe: Recipe, position: Any, velocity: Any) -> list[np.ndarray]:
    """Coordinates and velocities as those of the first recipe, without lag; (n, ...) each."""
    view = recipe.view
    places = list(view.places or range(recipe.size))
    origin = np.array(view.origin or [0.0] * len(places))
    model: Any = recipe.system().model
    found = []
    for values, unit in ((position, view.length), (velocity, view.length / view.time)):
        values = np.atleast_1d(np.asarray(values, dtype=float))
        if recipe.kind == "structure":
            values = model.displacements(values)
        found.append(view.mirror * values[places] / unit)
    moved = origin.reshape(-1, *(1,) * (found[0].ndim - 1))
    return [found[0] - view.mirror * view.mirror * moved, found[1]]


def names_of(event: Any, recipe: Recipe) -> tuple[str, ...]:
    """The names of the parts of an event, without those of inert ones."""
    if not hasattr(event, "contact"):
        return ("edge",)
    contacts = [contact.name for contact in recipe.contacts]
    called = contacts if event.contact == "both" else event.contact.split("+")
    return tuple(sorted(name for name in called if name and not name.startswith(INERT)))


def read(recipe: Recipe, motion: saltus.Motion) -> Answer:
    """A motion in the terms of the first recipe."""
    view = recipe.view
    rows = []
    for event in motion.events:
        names = names_of(event, recipe)
        kind = str(event.kind)
        # of motions with inert parts, which may move on, "rest" of the whole says nothing
        if names and kind != "rest":
            rows.append((event.time / view.time - view.begin, kind, names))
    rows.sort()
    ordered: list[Any] = []
    for row in rows:
        if ordered and row[0] - ordered[-1][0][0] < SAME_TIME:
            ordered[-1].append(row)
        else:
            ordered.append([row])
    rows = [row for group in ordered for row in sorted(group, key=lambda row: row[1:])]
    position, velocity = states_in_first_terms(recipe, motion.position, motion.velocity)
    speeds = np.abs(velocity).max()
    several = hasattr(motion.events, "_contacts")
    kept = lambda parts: {k: v for k, v in parts.items() if not k.startswith(INERT)}  # noqa: E731
    slides = kept(motion.sliding) if several and recipe.frictions else {}
    sides = kept(motion.sides) if several and recipe.surfaces else {}
    return Answer(
        stop="horizon" if motion.stop in (saltus.Stop.REST, saltus.Stop.HORIZON) else motion.stop,
        events=tuple((kind, names) for _, kind, names in rows),
        times=np.array([time for time, _, _ in rows]),
        position=position,
        velocity=velocity,
        highest_speed=float(speeds),
        closed=frozenset(name for name in motion.closed if not name.startswith(INERT))
        if several
        else frozenset(),
        # 2 is the friction of an open contact
        sliding={name: s if s == 2 else s * view.mirror for name, s in slides.items()},
        sides=sides,
    )


def answer(recipe: Recipe, tol: float = 1e-12) -> Answer:
    """The motion of a recipe, in the terms of the first recipe; an error is an answer, too."""
    try:
        motion = saltus.simulate(recipe.system(), tol=tol, **recipe.arguments())
    except saltus.errors.MotionError as refused:
        nothing = np.zeros(0)
        empty = frozenset[str]()
        error = str(refused) or "refused"
        return Answer("", (), nothing, nothing, nothing, 0.0, empty, {}, {}, error)
    return read(recipe, motion)


def difference(one: Answer, other: Answer) -> Difference:
    """How two answers differ."""
    if bool(one.error) != bool(other.error):
        return Difference(f"refused: {(one.error or other.error)[:150]}", np.inf)
    for name in ("stop", "closed", "sliding", "sides"):
        if getattr(one, name) != getattr(other, name):
            said = f"{name}: {getattr(one, name)} and {getattr(other, name)}"
            return Difference(said, np.inf)
    if one.events != other.events:
        pairs = zip(one.events, other.events, strict=False)
        place = next((i for i, (a, b) in enumerate(pairs) if a != b), None)
        if place is None:
            said = f"{len(one.events)} and {len(other.events)} events"
        else:
            said = f"event {place}: {one.events[place]} and {other.events[place]}"
        return Difference(said, np.inf)
    largest = 0.0
    for a, b in (
        (one.times, other.times),
        (one.position, other.position),
        (one.velocity, other.velocity),
    ):
        if a.size:
            size = np.maximum(1.0, np.maximum(np.abs(a), np.abs(b)))
            largest = max(largest, float((np.abs(a - b) / size).max()))
    return Difference("", largest)
