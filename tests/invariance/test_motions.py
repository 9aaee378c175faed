"""Motions do not depend on units, origin, order, inert parts, rounding, mirror and shift."""

from collections.abc import Iterator

import numpy as np
import pytest
from answers import Difference, answer, difference, states_in_first_terms
from random_systems import KINDS, Recipe, random_recipe

import saltus
from saltus.flow.motion.motion import state_names

SAME = 1e-6  # numbers of motions without chaos over a few periods
# powers of ten of the units of length, time and mass
UNITS = ([-9.0, -6.0, -6.0], [6.0, 6.0, 6.0])


def in_other_words(recipe: Recipe, rng: np.random.Generator) -> Iterator[Recipe]:
    """The same motion, written down anew in all ways."""
    yield recipe.rounded(rng)
    length, time, mass = 10.0 ** rng.uniform(*UNITS)
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


@pytest.mark.parametrize("kind", KINDS)
def test_a_motion_is_the_same_in_other_words(kind: str) -> None:
    for seed in range(2):
        for name, found in differences(kind, seed):
            assert not found.discrete, f"{name}: {found.discrete}"
            assert found.numeric < SAME, name


def many_ends(recipe: Recipe) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of impacts and the states at the end, in the first recipe's terms, of an ensemble
    of starts beside that of the recipe.
    """
    view = recipe.view
    given = recipe.arguments()
    name = recipe.coordinates[view.places[0] if view.places else 0]
    moves = np.linspace(0.0, 0.05, 9) * view.length * view.mirror
    system = recipe.system()
    many = saltus.simulate_many(system, **{**given, name: given[name] + moves})
    names = state_names(system.model.coordinates)
    states = np.array([many[each].values for each in names])
    position, velocity = np.split(states, 2)
    found = states_in_first_terms(recipe, position, velocity)
    return many.impact_count.values, np.concatenate(found)


@pytest.mark.parametrize("kind", ["wall", "passing", "ball", "stops", "chain", "soft"])
def test_an_ensemble_is_the_same_in_other_units_and_from_another_origin(kind: str) -> None:
    rng = np.random.default_rng([7, *kind.encode()])
    recipe = random_recipe(kind, rng)
    length, time, mass = 10.0 ** rng.uniform(*UNITS)
    counts, states = many_ends(recipe)
    for other in (
        recipe.in_units(length, time, mass),
        recipe.from_origin(3.0),
        recipe.mirrored(),
    ):
        other_counts, other_states = many_ends(other)
        np.testing.assert_array_equal(other_counts, counts, err_msg=other.name)
        np.testing.assert_allclose(other_states, states, rtol=0, atol=1e-7, err_msg=other.name)


@pytest.mark.parametrize("kind", ["wall", "stops", "soft", "lag"])
def test_derivatives_are_the_same_in_other_units(kind: str) -> None:
    rng = np.random.default_rng([11, *kind.encode()])
    recipe = random_recipe(kind, rng)
    length, time, mass = 10.0 ** rng.uniform(*UNITS)
    found = []
    for each in (recipe, recipe.in_units(length, time, mass)):
        path = "load.on_q0.amplitude"
        result = saltus.sensitivities(each.system(), parameters=[path], **each.arguments())
        view = each.view
        count = each.size + (each.lag is not None)
        units = np.repeat([view.length, view.length / view.time], count)
        force = view.mass * view.length / view.time**2
        found.append(
            np.hstack(
                [
                    result.state * units / units[:, None],
                    result.parameters * force / units[:, None],
                ]
            )
        )
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-6 * np.abs(found[0]).max())
