"""What users most often write in another way than it is meant, and that the answer says how."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import saltus
from saltus.checks import as_numbers

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5)),
)


@dataclass(frozen=True, kw_only=True)
class Branching(saltus.Model):
    coordinates = ("x",)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        return np.where(x > 0, -x, -2 * x)


HINTS: dict[str, tuple[Callable[[], Any], str]] = {
    "an argument of another library": (
        lambda: saltus.simulate(SYSTEM, theta=0.3, periods=1, n_jobs=2),
        "no coordinate 'n_jobs'; known here: theta; the arguments are .*periods.*times.*tol",
    ),
    "an argument of nobody": (
        lambda: saltus.simulate_many(SYSTEM, theta=0.3, periods=1, n_jobs=2),
        "n_jobs.*known here: theta; the arguments are .*sensitivities.*threads",
    ),
    "a misspelt argument": (
        lambda: saltus.simulate(SYSTEM, theta=0.3, periods=1, stopat=()),
        "did you mean 'stop_at'",
    ),
    "a state without its name": (
        lambda: saltus.simulate(SYSTEM, 0.3, periods=1),
        "by their names: theta=0.3$",
    ),
    "arrays for each with each": (
        lambda: saltus.simulate_many(SYSTEM, theta=np.zeros(3), velocity=np.zeros(4), periods=1),
        r"theta=xr.DataArray\(values, dims='theta'\)",
    ),
    "a number as an impact law": (
        lambda: SYSTEM.with_(impact=0.9),
        r"VelocityReduction\(e\).*NewtonImpact\(e\)",
    ),
    "a path without its part": (
        lambda: SYSTEM.with_(damping=0.2),
        r"no parameter 'damping'; did you mean 'model.damping'",
    ),
    "a branch in a model": (
        lambda: saltus.simulate(saltus.System(model=Branching()), x=0.3, duration=1.0),
        "OneContactModel, whose `side`",
    ),
    "too many motions": (
        lambda: saltus.simulate_many(
            SYSTEM, theta=np.zeros((100_000, 1)), velocity=np.zeros(100_000), periods=1
        ),
        "1e\\+10 motions need about .* GB",
    ),
}


@pytest.mark.parametrize("what", HINTS)
def test_the_refusal_says_how_it_is_meant(what: str) -> None:
    ask, sentence = HINTS[what]
    with pytest.raises(saltus.SaltusError, match=sentence):
        ask()


def test_a_name_that_lives_in_a_room_is_answered_with_the_room() -> None:
    with pytest.raises(
        AttributeError, match=r"^saltus has no 'uncertainty_exponent'; it is in saltus\.attractors$"
    ):
        _ = saltus.uncertainty_exponent
    assert callable(saltus.attractors.uncertainty_exponent)


def test_a_motion_names_its_coordinates() -> None:
    with pytest.raises(AttributeError, match=r"no 'x'; known here: theta; it has time"):
        _ = saltus.simulate(SYSTEM, theta=0.3, periods=0).x


def test_angles_that_look_like_degrees_are_noticed_and_others_are_not() -> None:
    with pytest.warns(
        UserWarning,
        match=r"phase = 90 is read in radians; 90 degrees are np.radians\(90\) = 1.5708",
    ):
        saltus.Harmonic(amplitude=1.0, phase=90)
    with pytest.warns(UserWarning, match="theta = 30 is read in radians"):
        saltus.simulate(SYSTEM, theta=30, periods=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        saltus.Harmonic(amplitude=1.0, phase=7.5)
        saltus.simulate(SYSTEM, theta=3.0, periods=0)


def test_a_record_in_milliseconds_is_noticed() -> None:
    cell = saltus.PhysicalCell(length=0.1, upper_mass=0.5, upper_stiffness=2.0)
    seconds, values = 0.01 * np.arange(1000.0), np.sin(np.arange(1000.0))
    record = saltus.Record(time=1000.0 * seconds, value=values, quantity="acceleration")
    with pytest.warns(UserWarning, match="divide those in milliseconds by 1000"):
        cell.load(saltus.Load(ground_horizontal=record))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cell.load(
            saltus.Load(
                ground_horizontal=saltus.Record(time=seconds, value=values, quantity="acceleration")
            )
        )


def test_numbers_without_an_end_are_refused() -> None:
    with pytest.raises(saltus.ParameterError, match="values"):
        as_numbers(itertools.count(), "values")


@pytest.fixture(scope="module")
def results():
    """Results of several kinds, by their names."""
    orbit = saltus.find_orbit(SYSTEM, theta=0.3)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.99, 1.01))
    motion = saltus.simulate(SYSTEM, theta=0.3, periods=2)
    return {
        "motion": motion,
        "periodicorbit": orbit,
        "branch": branch,
        "verdict": saltus.classify(SYSTEM, theta=0.3),
        "motionevents": motion.events,
    }


@pytest.mark.parametrize(
    ("method", "function"),
    [("save", "saltus.save("), ("to_netcdf", "saltus.save("), ("plot", "saltus.plot(")],
)
def test_a_method_of_other_packages_is_answered_with_the_function(results, method, function):
    for result in results.values():
        with pytest.raises(AttributeError) as refused:
            getattr(result, method)
        assert function in str(refused.value)
        assert type(result).__name__ in str(refused.value)
        assert not hasattr(result, "_repr_png_")  # as IPython asks of everything


def test_a_time_that_is_no_number_is_refused_in_a_sentence():
    with pytest.raises(saltus.ParameterError, match="time must be a finite number, got 'now'"):
        saltus.lyapunov_spectrum(SYSTEM, theta=0.3, periods=40, time="now")


def test_a_reason_alone_is_printed_without_places_for_numbers():
    for reason in (*saltus.orbits.OrbitEnd, *saltus.continuation.CurveEnd):
        assert "{" not in str(reason)
        assert "}" not in str(reason)
