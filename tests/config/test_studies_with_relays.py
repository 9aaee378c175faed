"""Studies of models with relays, which are a class in a file beside the study."""

import math

import pytest

from saltus import ParameterError, load_study

ROOM = """
from dataclasses import dataclass
from typing import ClassVar

import saltus


@dataclass(frozen=True, kw_only=True)
class StudiedRoom(saltus.ContactModel):
    power: float = 3.0

    coordinates: ClassVar[tuple[str, ...]] = ("T",)
    first_order: ClassVar[tuple[str, ...]] = ("T",)
    surfaces: ClassVar = (saltus.Relay(name="heater", on="cold", off="warm"),)

    def cold(self, t, T, velocity, load):
        return 19.0 - T

    def warm(self, t, T, velocity, load):
        return T - 21.0

    def force(self, t, T, velocity, load, sides):
        return -(T - 10.0) / 10.0 + self.power * (1.0 + sides.heater) / 2.0
"""
STUDY = """
[model]
type = "room.py:StudiedRoom"

[simulate]
T = 20.0
duration = 0.4
relays = {relays}

[frequency_sweep]
path = "model.power"
values = [3.0, 3.5]
T = 20.0
relays = {{ heater = true }}
"""


def study(folder, relays):
    (folder / "room.py").write_text(ROOM)
    path = folder / "study.toml"
    path.write_text(STUDY.format(relays=relays))
    return load_study(path)


def test_a_study_says_which_relays_are_on(tmp_path):
    found = study(tmp_path, "{ heater = true }")
    motion = found.run()
    assert motion.position == pytest.approx(40.0 - 20.0 * math.exp(-0.04), abs=1e-13)
    (ask,) = found.asks
    swept = found.answer(ask, ask.function)
    rounds = [10.0 * math.log(ratio * 11.0 / 9.0) for ratio in (21.0 / 19.0, 26.0 / 24.0)]
    assert swept.period.values[0] == pytest.approx(rounds, rel=1e-11)


@pytest.mark.parametrize(
    ("relays", "words"),
    [
        ("{ heater = 1 }", "a table of names with true or false"),
        ("true", "a table of names with true or false"),
        ("{ motor = true }", "StudiedRoom has heater"),
    ],
)
def test_relays_that_say_nothing_are_refused_with_their_place(tmp_path, relays, words):
    with pytest.raises(ParameterError, match=words) as refusal:
        study(tmp_path, relays).run()
    assert str(refusal.value).startswith(str(tmp_path / "study.toml"))
    assert "\n" not in str(refusal.value)
