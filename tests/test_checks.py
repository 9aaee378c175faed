"""Refusals that many functions share name the function, the argument, and what would be right."""

from enum import StrEnum

import pytest

import saltus
from saltus.checks import check_kind, checked_by
from saltus.errors import ParameterError, near


@checked_by(lambda **arguments: None)
def searched(system, *, window=None, starts=8):
    return starts


@pytest.mark.parametrize(
    ("given", "named", "sentence"),
    [
        ((1,), {"windw": 2}, r"searched\(\) got an unexpected keyword argument 'windw'; did you mean 'window'\?$"),
        ((1,), {"region": 2}, r"searched\(\) got an unexpected keyword argument 'region'; known here: starts, system, window$"),
        ((), {}, r"searched\(\) missing a required argument: 'system'$"),
        ((1, 2), {}, r"searched\(\) too many positional arguments$"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_with_the_name_of_the_function(given, named, sentence):
    with pytest.raises(TypeError, match=sentence):
        searched(*given, **named)


def test_an_object_of_another_kind_is_refused_with_the_function_that_gives_the_right_one():
    check_kind("orbit", 1.0, int, float)
    with pytest.raises(ParameterError, match=r"^orbit must be an int, as find_orbit gives it, got 'x'$") as refusal:
        check_kind("orbit", "x", int, float, source="find_orbit")
    assert refusal.value.parameter == "orbit"


@pytest.mark.parametrize(
    ("function", "more", "name"),
    [
        (saltus.continue_orbit, ("load.frequency", (0.2, 3.0)), "orbit"),
        (saltus.continue_special, ("load.vertical",), "special"),
        (saltus.switch_branch, ((0.2, 3.0),), "special"),
        (saltus.doubling_cascade, ((0.2, 3.0),), "first"),
        (saltus.stable_manifold, (), "orbit"),
    ],
)
def test_what_is_no_orbit_or_special_point_is_refused(function, more, name):
    with pytest.raises(ParameterError, match=f"^{name} must be a .*gives it, got 3$"):
        function(3, *more)


def test_near_names_are_those_that_a_user_writes():
    colour = StrEnum("colour", ["RED", "GREEN"])
    assert near("rd", colour) == "did you mean 'red'?"
    assert near("grean", colour, ("greens",)) == "did you mean 'green' or 'greens'?"
    assert near("x", colour, ("blue",)) == "known here: green, red"
