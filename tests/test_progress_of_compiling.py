"""Whoever watches the progress of a function is told what is compiled within it, by name."""

import io
import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus.checks import LIMITS
from saltus.progress import say
from saltus.taylor import kernels


@dataclass(frozen=True, kw_only=True)
class Unheard(saltus.Model):
    """x'' = sin(force - x) / (3 + x^2), an equation that no other test has."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return np.sin(load.force(t) - x) / (3.0 + x**2)


def test_compiling_is_said_by_name_in_any_function_and_the_fraction_never_falls(
    monkeypatch, tmp_path
):
    known = saltus.System(model=saltus.TwoStops(), load=saltus.Load(force=0.1))
    # loads the kernels
    saltus.simulate(saltus.System(model=saltus.WallOscillator()), x=0.1, duration=1.0)
    saltus.simulate(known, x=0.0, duration=1.0)
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(kernels, "LIMITS", replace(LIMITS, unsaid=0.0))
    system, told = saltus.System(model=Unheard(), load=saltus.Load(force=0.1)), []
    saltus.simulate(
        system, x=0.1, duration=1.0, progress=lambda fraction, what: told.append((fraction, what))
    )
    saltus.sensitivities(
        system, x=0.1, duration=1.0, progress=lambda fraction, what: told.append((fraction, what))
    )
    words = [what for _, what in told if what.startswith("compiling")]
    assert words == [
        "compiling Unheard, a model of 1 coordinate (some 0 s, once)",
        "compiling the sensitivities of Unheard, a model of 1 coordinate (some 0 s, once)",
    ]
    again = []
    saltus.simulate(
        system, x=0.2, duration=1.0, progress=lambda fraction, what: again.append(fraction)
    )
    assert again == sorted(again)
    assert len(again) == 2


class Terminal(io.StringIO):
    """A stream that a person sees."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "written"),
    [(Terminal(), "saltus: compiling a kernel\n"), (io.StringIO(), "")],
    ids=["terminal", "file"],
)
def test_a_terminal_shows_what_nobody_watches_and_a_file_does_not(monkeypatch, stream, written):
    monkeypatch.setattr(sys, "stderr", stream)
    say("compiling a kernel")
    assert stream.getvalue() == written


def test_nobody_is_told_what_nobody_watches():
    told = []
    orbit = saltus.find_orbit(
        saltus.System(
            model=saltus.WallOscillator(stiffness=1.0, damping=0.1),
            load=saltus.Load(frequency=1.1, force=saltus.Harmonic(0.2)),
            impact=saltus.VelocityReduction(0.8),
        ),
        x=0.1,
        progress=lambda fraction, what: told.append((fraction, what)),
    )
    say("afterwards")
    assert orbit.stable
    assert told[0] == (0.0, "following the motion")
    assert told[-1] == (1.0, "done")
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
