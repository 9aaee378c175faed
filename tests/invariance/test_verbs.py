"""What the verbs answer does not depend on units, origin, order, inert parts, mirror and
rounding.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
import pytest
from random_systems import Recipe, random_recipe
from test_motions import UNITS
from test_motions import differences as motion_differences
from verb_answers import VERBS, says, steady

SAME = 1e-6
# Exponents of several coordinates over a finite run depend on the lengths in which their first
# frame is measured, by the logarithm of a ratio of lengths over the run, 2 pi 64 / frequency.
SAME_EXPONENTS = 2e-2
KINDS = ("wall", "passing", "stops", "block", "chain", "belt", "soft", "lag", "structure")
# Attractors are looked for from starts that are spread over a window: another coordinate and a
# mirror spread them otherwise, and the default window is around a place that an origin moves.
OTHERWISE_SPREAD = ("inert coordinate", "mirrored")
NO_DEFAULT_WINDOW = ("origin", "inert")


def in_other_words(recipe: Recipe, rng: np.random.Generator) -> Iterator[Recipe]:
    """The same in other words."""
    yield recipe.in_units(*10.0 ** rng.uniform(*UNITS))
    yield recipe.mirrored()
    yield recipe.rounded(rng)
    yield recipe.in_order(rng)
    yield recipe.from_origin(rng.uniform(-3.0, 3.0, recipe.size))
    for part in recipe.inert_parts:
        yield recipe.with_inert(part)
    if recipe.frequency is not None:
        yield recipe.later(3)


def is_asked(verb: str, recipe: Recipe) -> bool:
    """Whether a verb can be asked the same question in other words."""
    begins_later = recipe.view.begin > 0.0
    if verb == "basins_of_attraction":
        return recipe.size == 1 and recipe.lag is None and not begins_later
    if "attractors" in verb and begins_later:
        return False
    if "default window" in verb and any(word in recipe.name for word in NO_DEFAULT_WINDOW):
        return False
    return "attractors" not in verb or not any(word in recipe.name for word in OTHERWISE_SPREAD)


def differences(verb: str, kind: str, seed: int) -> list[str]:
    """How the answers of a verb to a random recipe in other words differ, in words."""
    rng = np.random.default_rng([seed, *kind.encode(), 5])
    recipe = steady(random_recipe(kind, rng))
    others = list(in_other_words(recipe, rng))
    if recipe.frequency is None or not is_asked(verb, recipe):
        return []
    one = says(verb, recipe)
    found = []
    for other in others:
        if not is_asked(verb, other):
            continue
        said = says(verb, other)
        if said.discrete != one.discrete:
            found.append(f"{verb} of {other.name}: {said.discrete} and {one.discrete}")
        elif len(said.numbers) == len(one.numbers) > 0:
            apart = np.abs(np.array(said.numbers) - np.array(one.numbers)).max()
            of_frames = verb == "lyapunov_spectrum" and recipe.size + (recipe.lag is not None) > 1
            if not apart < (SAME_EXPONENTS if of_frames else SAME):
                found.append(f"{verb} of {other.name}: apart by {apart:g}")
    return found


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("kind", ["wall", "stops"])
def test_a_verb_answers_a_first_model_the_same_in_other_words(verb: str, kind: str) -> None:
    assert not differences(verb, kind, 0)


@pytest.mark.thorough
@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_verb_answers_the_same_in_other_words(verb: str, kind: str) -> None:
    for seed in range(int(os.environ.get("SALTUS_MODELS", "3"))):
        assert not differences(verb, kind, seed)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_motions_answer_the_same_in_other_words(kind: str) -> None:
    for seed in range(2, 2 + int(os.environ.get("SALTUS_MODELS", "20"))):
        for name, found in motion_differences(kind, seed):
            assert not found.discrete, f"{name}: {found.discrete}"
            assert found.numeric < SAME, name
