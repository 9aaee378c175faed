"""What works with what: each class of models with each verb, at the smallest size that shows it."""

from functools import cache

import matplotlib
import pytest
from what_works.model_classes import NAMES
from what_works.refused import REASONS, REFUSED, SUMS
from what_works.table import PAGE, written
from what_works.verbs import NODE, VERBS, Tried

import saltus

matplotlib.use("Agg")
TRIALS = {verb.name: verb.trial for verb in VERBS}


@cache
def tried(name):
    """A class of models, with what its verbs share."""
    return Tried(name)


@pytest.mark.parametrize("verb", TRIALS)
@pytest.mark.parametrize("name", NAMES)
def test_a_verb_works_with_a_class_of_models_or_is_refused(name, verb, tmp_path):
    words = REFUSED.get((name, verb))
    if words is not None:
        with pytest.raises(saltus.SaltusError) as refusal:
            TRIALS[verb](tried(name), tmp_path)
        assert words in str(refusal.value)
        assert "\n" not in str(refusal.value)
        return
    if verb == "page" and NODE is None:
        pytest.skip("node is not installed here")
    TRIALS[verb](tried(name), tmp_path)


def test_refusals_are_of_cells_that_exist_and_have_a_reason():
    assert {name for name, _ in REFUSED} <= set(NAMES)
    assert {verb for _, verb in REFUSED} <= set(TRIALS)
    assert set(REFUSED.values()) == set(REASONS)


def test_the_documentation_shows_this_table():
    assert PAGE.read_text() == written(), "write it anew: python tests/what_works/table.py"


@pytest.mark.parametrize("name", [name for (name, _), words in REFUSED.items() if words == SUMS])
def test_a_page_of_gaps_between_bodies_is_one_of_the_coordinates_of_the_gaps(name, tmp_path):
    system = tried(name).system.in_gap_coordinates
    assert saltus.page(system, path=tmp_path / "page.html").stat().st_size > 50_000
