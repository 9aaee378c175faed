"""Motions do not depend on units, origin, order, inert parts, rounding, mirror and shift."""

from collections.abc import Iterator

import numpy as np
import pytest
from answers import Difference, answer, difference
from random_systems import KINDS, Recipe, random_recipe

SAME = 1e-8  # numbers of motions without chaos over a few periods
STEADY = [kind for kind in KINDS if kind not in ("ball", "block", "resting")]


def in_other_words(recipe: Recipe, rng: np.random.Generator) -> Iterator[Recipe]:
    """The same motion, written down anew in all ways."""
    yield recipe.rounded(rng)
    length, time, mass = 10.0 ** rng.uniform(-2.0, 2.0, 3)
    yield recipe.in_units(length, time, mass)
    yield recipe.mirrored()
    yield recipe.in_order(rng)
    yield recipe.from_origin(rng.uniform(-3.0, 3.0, recipe.size))
    if recipe.frequency is not None:
        yield recipe.later(int(rng.integers(1, 50)))
    for part in recipe.inert_parts:
        yield recipe.with_inert(part)


def differences(kind: str, seed: int) -> list[tuple[str, Difference]]:
    """How a random motion differs from the same in other words."""
    rng = np.random.default_rng([seed, *kind.encode()])
    recipe = random_recipe(kind, rng)
    one = answer(recipe)
    return [(other.name, difference(one, answer(other))) for other in in_other_words(recipe, rng)]


@pytest.mark.parametrize("kind", STEADY)
def test_a_motion_is_the_same_in_other_words(kind: str) -> None:
    for seed in range(2):
        for name, found in differences(kind, seed):
            assert not found.discrete, f"{name}: {found.discrete}"
            assert found.numeric < SAME, name
