"""Public signatures: no options that a user cannot see, and a name means one thing wherever it
stands.
"""

import importlib
import inspect
from collections import defaultdict

import pytest
from test_public_face import public

import saltus

# A name of an argument by what it takes; `| None` says that it may be left out. "number" is one or
# an array of them.
ALIKE = {
    "Numbers": "number",
    "Number": "number",
    "float": "number",
    "np.ndarray": "number",
    "Iterable[float]": "number",
    "Path | str": "path",
    "str | Path": "path",
    "Box": "window",
    "Metainterface | TwoLayer": "Model",
    "ContactModel": "Model",
    "int | Workers": "int",
}
# Names with two meanings, which are those of the field in both: what a dimension, a figure of a
# formula or a file is called.
SEVERAL = {
    "below": "an upper bound, or on which side of a surface the surface itself counts",
    "channels": "the names of a load's channels with their symbols, or signals",
    "changes": "values by dotted path, or parts of a system too",
    "coordinates": "starts of one motion or of many, by the names of the model's coordinates",
    "contacts": "the contacts of a model, or of a structure also by names of rows",
    "curves": "whether basins have their boundaries, or how many borders of a chart are followed",
    "damping": "a coefficient, or the matrix of a structure",
    "data": "what was measured, or a system as a dictionary",
    "e": "a coefficient of restitution, one or a matrix of several contacts",
    "equations": "of a model in symbols, or of an orbit",
    "function": "what is computed over a grid, or the name of a surface's method",
    "functions": (
        "quantities by name: of an orbit, of a motion, or of a motion at the times of a record"
    ),
    "known": "attractors, orbits or branches",
    "parameters": "values by dotted path, or the paths to differentiate to or to solve for",
    "position": "the number of a contact or a surface, or coordinates",
    "path": "a parameter's dotted path, or that of a file",
    "periods": "forcing periods; of one motion also a fraction",
    "points": "how many of a curve, or sums of displacements by name",
    "relays": "whether each is on, of one motion, of many or of a picture",
    "result": "one result, or to be drawn also several",
    "special": "one special point, or seeds of several",
    "start": "when a pulse begins, or the state with which a record begins",
    "starts": "how many initial states, or, of a phase portrait, which",
    "stiffness": "a coefficient, or the matrix of a structure",
    "surfaces": "surfaces and relays, of a structure also as tables",
    "time": "when a motion begins, or the times of a record",
    "velocity": "of a start, or at which a friction slides",
    "values": "of a parameter, or what was measured, or the unknowns of a fit",
}
# By which arguments a function takes names of its own: those of a model's coordinates, of a load's
# channels, of parameters, and those of the function that draws.
OWN_NAMES = {"coordinates", "channels", "more", "options"}


def function(name):
    """A public function, class or method by the name that the public face has for it."""
    room, _, own = name.partition(".")
    if name[0].isupper():
        return getattr(getattr(saltus, room), own) if own else getattr(saltus, room)
    return getattr(importlib.import_module("saltus" if room == "saltus" else f"saltus.{room}"), own)


@pytest.fixture(scope="module")
def arguments():
    """(name of the function, parameter) of all arguments."""
    return [
        (name, p)
        for name in public()
        for p in inspect.signature(function(name)).parameters.values()
        if p.name != "self"
    ]


def meaning(annotation):
    """What an argument takes, with or without None."""
    text = str(annotation).removesuffix(" | None")
    return ALIKE.get(text, text)


def test_no_option_is_hidden(arguments):
    hidden = {
        (name, p.name)
        for name, p in arguments
        if p.kind is p.VAR_KEYWORD and p.name not in OWN_NAMES
    }
    assert not hidden
    # which refuses others by their names
    assert {name for name, p in arguments if p.name == "options"} == {"saltus.plot"}


def test_a_name_means_one_thing(arguments):
    """Formulas of the theory are called with symbols and left out, as are the starts `velocity`,
    which may be several numbers.
    """
    meanings = defaultdict(lambda: defaultdict(list))
    for name, p in arguments:
        if not name.startswith("theory."):
            meanings[p.name][meaning(p.annotation)].append(name)
    assert len(meanings) > 100
    several = {name: dict(each) for name, each in meanings.items() if len(each) > 1}
    assert set(several) == set(SEVERAL), {
        name: each for name, each in several.items() if name not in SEVERAL
    }
    assert {"seed", "progress", "tol", "max_period", "window", "step", "system"} <= set(
        meanings
    ) - set(SEVERAL)


def test_what_stands_everywhere_has_one_default_or_a_scale_of_its_own(arguments):
    defaults = defaultdict(set)
    for _, p in arguments:
        if p.default is not p.empty and p.name in (
            "seed",
            "progress",
            "velocity",
            "store",
            "workers",
            "scheduler",
            "window",
        ):
            defaults[p.name].add(repr(p.default))
    assert defaults["seed"] <= {"0", "1"}
    assert len(defaults["progress"]) == 1
    assert all(defaults[name] == {"None"} for name in ("store", "workers", "scheduler"))
    assert defaults["velocity"] <= {"0.0", "None"}  # None of a grid: no axis of it
    assert defaults["window"] == {"None"}
