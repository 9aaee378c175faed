"""Refusals that many functions share name the function, the argument, and what would be right."""

import pickle
from enum import StrEnum

import numpy as np
import pytest

import saltus
from saltus import checks
from saltus.checks import answered, check_memory, check_work, checked_by, free_memory
from saltus.errors import ParameterError, near


@checked_by(lambda **arguments: None)
def searched(system, *, window=None, starts=8):
    return starts


@pytest.mark.parametrize(
    ("given", "named", "sentence"),
    [
        ((1,), {"windw": 2}, r"searched\(\) has no argument 'windw'; did you mean 'window'\?$"),
        (
            (1,),
            {"region": 2},
            r"searched\(\) has no argument 'region'; known here: starts, system, window$",
        ),
        ((), {}, r"searched\(\) missing a required argument: 'system'$"),
        (
            (1, 2),
            {},
            (
                r"searched\(\) too many positional arguments; give the arguments after the"
                r" first by "
                r"their names$"
            ),
        ),
    ],
)
def test_arguments_that_do_not_fit_are_refused_with_the_name_of_the_function(
    given, named, sentence
):
    with pytest.raises(ParameterError, match=sentence):
        searched(*given, **named)


def test_where_all_arguments_have_names_none_is_said_to_do_without():
    with pytest.raises(
        ParameterError,
        match=r"^Contact\(\) too many positional arguments; give all arguments by their names$",
    ):
        saltus.Contact("wall", coordinate="x")
    # a load has any names as channels
    with pytest.raises(ParameterError, match=r"^Load\(\) too many positional arguments"):
        saltus.Load(1.2, saltus.Harmonic(0.5))


@pytest.mark.parametrize("step", [0, -0.1, float("nan"), 1e4, "long"])
def test_a_step_that_leads_nowhere_is_refused(step):
    forced = SYSTEM.with_(
        {
            "load.horizontal": saltus.Harmonic(amplitude=0.5),
            "load.vertical": -0.5,
            "model.damping": 0.1,
        }
    )
    orbit = saltus.find_orbit(forced, theta=0.3)
    with pytest.raises(ParameterError, match=r"^step must "):
        saltus.continue_orbit(orbit, "load.frequency", (0.9, 1.1), step=step)


def test_near_names_are_those_that_a_user_writes():
    colour = StrEnum("colour", ["RED", "GREEN"])
    assert near("rd", colour) == "did you mean 'red'?"
    assert near("grean", colour, ("greens",)) == "did you mean 'green' or 'greens'?"
    assert near("x", colour, ("blue",)) == "known here: green, red; the arguments are blue"


# --- every public function ---------------------------------------------------

SYSTEM = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(frequency=1.0))


def test_a_package_that_is_called_names_the_function_that_is_meant():
    with pytest.raises(
        ParameterError,
        match=r"saltus.attractors is a package, not a function; did you mean 'find_attractors'",
    ):
        saltus.attractors(SYSTEM)
    with pytest.raises(ParameterError, match=r"saltus.theory is a package, not a function"):
        saltus.theory()


def test_a_public_function_can_be_pickled():
    assert pickle.loads(pickle.dumps(saltus.simulate)) is saltus.simulate


def test_a_mistake_of_saltus_stays_one():
    def mistaken(count):
        raise TypeError("a mistake")

    with pytest.raises(TypeError, match="a mistake"):
        answered(mistaken)(3)
    with pytest.raises(
        ParameterError, match=r"^mistaken\(\) has no argument 'cuont'; did you mean 'count'\?$"
    ):
        answered(mistaken)(cuont=3)


def test_a_sentence_from_python_is_one_line_of_at_most_400_characters():
    for refused in (
        lambda: saltus.load("z" * 100_000),
        lambda: saltus.Chirp(1.0, 1.0, 2.0, 3.0, quantity="a\n" * 10**5),
    ):
        with pytest.raises(ParameterError) as refusal:
            refused()
        assert len(str(refusal.value)) < 400
        assert "\n" not in str(refusal.value)
    text = str(ParameterError("begin " + "x" * 5000 + " end"))
    assert text.startswith("begin")
    assert text.endswith("end")


def test_memory_and_work_are_estimated(monkeypatch):
    monkeypatch.setattr(checks, "free_memory", lambda: 1e9)
    check_memory("starts", 0.7e9, "starts")
    with pytest.raises(
        ParameterError,
        match=r"^starts is too large: 9 starts need about 0.9 GB of memory, and 1 GB are free$",
    ):
        check_memory("starts", 0.9e9, "9 starts")
    with pytest.raises(
        ParameterError, match=r"^starts is too large: 1000000 starts need about 2.05 GB"
    ):
        saltus.find_attractors(SYSTEM, starts=1_000_000)
    with pytest.raises(
        ParameterError,
        match=r"^periods is too large: 1e\+06 periods of a motion kept whole \(dense=False",
    ):
        saltus.simulate(SYSTEM, theta=0.1, periods=1_000_000)
    with pytest.raises(ParameterError, match=r"take about 40 days of one core"):
        check_work("periods", 1e6, 1e7)
    with pytest.raises(ParameterError, match=r"^threads must lie in \[1, 1024\], got 100000$"):
        saltus.simulate_many(SYSTEM, theta=[0.1], periods=1, threads=10**5)


def test_the_free_memory_is_told():
    assert 1e6 < free_memory() < 1e15


VAST = np.broadcast_to(np.float64(1.0), 10**12)  # eight bytes
FORCED = SYSTEM.with_({"load.horizontal": saltus.Harmonic(amplitude=0.3), "load.vertical": -0.5})


@pytest.mark.parametrize(
    ("name", "ask"),
    [
        ("values", lambda: saltus.attractors_along(FORCED, "load.frequency", VAST)),
        ("labels", lambda: saltus.attractors.uncertainty_exponent(VAST)),
        ("series", lambda: saltus.zero_one_test(range(10**9))),
        ("time", lambda: saltus.Record(range(10**9), [0.0, 1.0])),
        ("times", lambda: saltus.simulate(FORCED, theta=0.1, periods=1, times=range(10**9))),
        (
            "theta",
            lambda: saltus.basins_of_attraction(FORCED, theta=range(10**9), velocity=[0.0, 1.0]),
        ),
        (
            "theta",
            lambda: saltus.simulate_many(
                FORCED, theta=np.zeros((10**5, 1)), velocity=np.zeros(10**5), periods=1
            ),
        ),
    ],
)
def test_sizes_are_looked_at_before_arrays_are_made(name, ask):
    with pytest.raises(ParameterError, match=r"are allowed|are the most|GB of memory") as refusal:
        ask()
    assert refusal.value.parameter == name
