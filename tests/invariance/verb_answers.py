"""What the verbs of saltus say about a recipe, in the terms of the recipe that it was made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from random_systems import INERT, Recipe

import saltus
from saltus.errors import SaltusError

RANGE = 0.06  # of the frequency, on both sides, along which branches and sweeps go
STARTS = 12
BESIDE_A_GRAZING = 2e-7  # a share of the parameter within which a fold may be missed


@dataclass(frozen=True)
class VerbAnswer:
    """What is discrete, and numbers in units of the first recipe."""

    discrete: Any
    numbers: tuple[float, ...] = ()


def steady(recipe: Recipe) -> Recipe:
    """A recipe with more damping, so that its motions settle within few periods."""
    damped = recipe.damping + np.diag(np.full(recipe.size, 0.35))
    return replace(recipe, damping=damped)


def start_of(recipe: Recipe) -> dict[str, Any]:
    """The state at the start, by its names."""
    given = recipe.arguments()
    return {name: value for name, value in given.items() if name not in ("duration", "time")}


def names_of_contacts(text: str) -> tuple[str, ...]:
    """The contacts in a name such as wall_1+wall_2, without inert ones, in alphabetical order."""
    return tuple(sorted(x for x in text.split("+") if x and not x.startswith(INERT)))


def lengths_of(recipe: Recipe, values: Any) -> tuple[float, ...]:
    return tuple(np.ravel(np.asarray(values, dtype=float)) / recipe.view.length)


def frequencies(recipe: Recipe) -> tuple[float, float]:
    """The range of frequencies, exactly the same in all units up to rounding."""
    assert recipe.frequency is not None
    return recipe.frequency * (1.0 - RANGE), recipe.frequency * (1.0 + RANGE)


def orbit_of(recipe: Recipe) -> VerbAnswer:
    orbit = saltus.find_orbit(recipe.system(), **start_of(recipe))
    multipliers = np.sort(np.abs(orbit.multipliers))[::-1]
    largest = multipliers[:1] if recipe.has_inert_coordinate else multipliers
    return VerbAnswer(
        (orbit.period, orbit.impact_count, orbit.stable, orbit.admissible),
        (*largest.tolist(),),
    )


def branch_of(recipe: Recipe) -> VerbAnswer:
    orbit = saltus.find_orbit(recipe.system(), **start_of(recipe))
    branch = saltus.continue_orbit(orbit, "load.frequency", frequencies(recipe))
    special = sorted(
        (point.parameter * recipe.view.time, str(point.kind)) for point in branch.special
    )
    # Orbits of whole motions, as those with a surface, begin a little beyond a grazing.
    grazings = [place for place, kind in special if kind == "GR"]
    special = [
        (place, kind)
        for place, kind in special
        if kind != "LP" or not np.isclose(place, grazings, rtol=BESIDE_A_GRAZING, atol=0.0).any()
    ]
    ends = sorted(
        (str(end.reason.code), round(end.parameter * recipe.view.time, 6)) for end in branch.ends
    )
    return VerbAnswer(
        ([kind for _, kind in special], [code for code, _ in ends]),
        tuple(place for place, _ in special),
    )


def sweep_of(recipe: Recipe) -> VerbAnswer:
    values = np.linspace(*frequencies(recipe), 5)
    data = saltus.frequency_sweep(recipe.system(), values, **start_of(recipe))
    outcome = tuple(map(str, np.ravel(data.outcome.values))) if "outcome" in data else ()
    return VerbAnswer(outcome)


def verdict_of(recipe: Recipe) -> VerbAnswer:
    verdict = saltus.classify(recipe.system(), **start_of(recipe))
    return VerbAnswer((str(verdict.kind), verdict.period))


def exponents_of(recipe: Recipe) -> VerbAnswer:
    found = saltus.lyapunov_spectrum(recipe.system(), **start_of(recipe), periods=64, transient=60)
    largest = found.values[:1] if recipe.has_inert_coordinate else found.values
    finite = np.where(np.isfinite(largest), largest, 0.0) * recipe.view.time
    return VerbAnswer((bool(found.note), bool(found.positive)), tuple(finite.tolist()))


def window_of(recipe: Recipe, half: float = 0.8) -> tuple[tuple[float, float], ...]:
    """A window about the start: half widths of 0.8 in the first recipe's units, in the order of the
    model's coordinates."""
    view = recipe.view
    model: Any = recipe.system().model
    start = start_of(recipe)
    places = [start[name] for name in model.coordinates]
    speeds = np.atleast_1d(start["velocity"]).tolist()[: len(model.moving)]
    # amplitudes of modes have the unit of a displacement times the root of a mass
    local = getattr(model, "local_count", len(places))
    lengths = [
        half * view.length * (1.0 if i < local else view.mass**0.5) for i in range(len(places))
    ]
    rates = [length / view.time for length in lengths]
    return (
        *((x - length, x + length) for x, length in zip(places, lengths, strict=True)),
        *((v - rate, v + rate) for v, rate in zip(speeds, rates, strict=False)),
    )


def attractors_of(recipe: Recipe) -> VerbAnswer:
    found = saltus.find_attractors(recipe.system(), window=window_of(recipe), starts=STARTS)
    kinds = sorted((str(each.kind), each.period) for each in found)
    return VerbAnswer((kinds, found.undecided))


def default_attractors_of(recipe: Recipe) -> VerbAnswer:
    found = saltus.find_attractors(recipe.system(), starts=STARTS)
    kinds = sorted((str(each.kind), each.period) for each in found)
    return VerbAnswer((kinds, found.undecided))


def basins_of(recipe: Recipe) -> VerbAnswer:
    view = recipe.view
    places = np.linspace(-0.4, 0.4, 4) * view.length * view.mirror + recipe.position[0]
    speeds = np.linspace(-0.4, 0.4, 3) * view.length / view.time * view.mirror
    order = np.argsort(places)
    found = saltus.basins_of_attraction(
        recipe.system(), **{recipe.coordinates[0]: np.sort(places)}, velocity=np.sort(speeds)
    )
    labels = np.asarray(found.label.values)
    labels = labels[:: view.mirror, :: view.mirror] if order.size else labels
    # labels are numbered as attractors are found: what counts is which cells go together
    _, first, same = np.unique(labels.ravel(), return_index=True, return_inverse=True)
    return VerbAnswer(tuple(first[same].tolist()))


VERBS: dict[str, Callable[[Recipe], VerbAnswer]] = {
    "find_orbit": orbit_of,
    "continue_orbit": branch_of,
    "frequency_sweep": sweep_of,
    "classify": verdict_of,
    "lyapunov_spectrum": exponents_of,
    "find_attractors": attractors_of,
    "find_attractors, default window": default_attractors_of,
    "basins_of_attraction": basins_of,
}


def says(verb: str, recipe: Recipe) -> VerbAnswer:
    """The answer of a verb; a refusal is an answer, too."""
    try:
        return VERBS[verb](recipe)
    except SaltusError as refused:
        return VerbAnswer(("refused", type(refused).__name__))
