"""A dry run: how many files a new kind of part takes, from a model to a branch and a plot."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import saltus

MOST_FILES = 4
# A toggle: its side turns whenever the side of another surface becomes +1, as a lamp does at each
# push of its button. No relay does this, as its side does not follow from where it was pushed. In
# each file, what is put behind which of its lines.
TOGGLE = {
    "systems/contracts/contact_model.py": {
        "# the largest imaginary part by which derivatives to a number of a model are taken\n": '''\
@dataclass(frozen=True, slots=True, kw_only=True)
class Toggle:
    """A switch that turns whenever the side of the surface `of` becomes +1."""

    name: str
    of: str

    kind: ClassVar[str] = "toggle"
    remembered: ClassVar[bool] = True
    coordinate: ClassVar[None] = None
    position: ClassVar[float] = 0.0
    sign: ClassVar[int] = 1
    stiffness: ClassVar[float] = 0.0
    damping: ClassVar[float] = 0.0
    after_event: ClassVar[None] = None
    function: ClassVar[str] = ""
    methods: ClassVar[tuple[str, ...]] = ()

    def guard(self, model: Any, side: Any, *at: Any) -> Any:
        return 1.0 * side  # it has no event of its own

    def start_side(self, model: Any, given: bool | None, *at: Any) -> int:
        return 1 if given else -1

    def marks(self, model: Any) -> dict[str, int]:
        names = [part.name for part in (*model.frictions, *model.surfaces)]
        return {"TURNED_BY": 1 + names.index(self.of)}


# the largest imaginary part by which derivatives to a number of a model are taken
'''
    },
    "__init__.pyi": {
        "from .systems.contracts.contact_model import Relay as Relay\n": (
            "from .systems.contracts.contact_model import Relay as Relay\n"
            "from .systems.contracts.contact_model import Toggle as Toggle\n"
        )
    },
    "flow/kernel/contact_layout.py": {
        "    RELAY = 4": "    TOGGLE = 5\n    RELAY = 4",
        "    EXCESS = 12\n": "    EXCESS = 12\n    TURNED_BY = 13\n",
    },
    "flow/contacts/part_events.py": {
        "    return bits\n": """\
    for k in range(motion.sided.shape[0]):
        if motion.sided[k, PartColumn.KIND] == PartKind.TOGGLE:
            other = motion.sided[motion.sided[k, PartColumn.TURNED_BY] - 1]
            passed = other[PartColumn.REACHED] == Reached.GUARD
            if passed and other[PartColumn.STATE] == Side.ABOVE:
                motion.sided[k, PartColumn.STATE] *= -1
    return bits
""",
        "    PartColumn,\n": "    PartColumn,\n    PartKind,\n",
    },
}
MOTION = """
import dataclasses, math, sys
import matplotlib
matplotlib.use("agg")
import numpy as np
import saltus

assert saltus.__file__.startswith(sys.argv[1]), saltus.__file__

@dataclasses.dataclass(frozen=True, kw_only=True)
class Lamp(saltus.ContactModel):
    gain: float = 1.0
    coordinates = ("u",)
    first_order = ("u",)
    channels = ("push",)
    surfaces = (
        saltus.Surface(name="button", function="pressed"),
        saltus.Toggle(name="lamp", of="button"),
    )
    def pressed(self, t, u, velocity, load):
        return load.push(t) - 0.5
    def force(self, t, u, velocity, load, sides):
        return self.gain * sides.lamp - u

load = saltus.Load(frequency=1.0, push=saltus.Harmonic(1.0))
system = saltus.System(model=Lamp(), load=load)
motion = saltus.simulate(system, u=0.0, duration=40.0)
lamp = [event for event in motion.events if event.contact == "lamp"]
button = [event for event in motion.events if event.contact == "button"]
pushes = math.pi / 6 + 2 * math.pi * np.arange(7)
assert np.allclose([event.time for event in lamp], pushes, rtol=1e-12), lamp
assert len(button) == 13, len(button)
u, side, before = 0.0, -1.0, 0.0
for time in [*pushes, 40.0]:
    u = side + (u - side) * math.exp(before - time)
    side, before = -side, time
assert abs(motion.position - u) < 1e-12, (motion.position, u)
assert motion.sides["lamp"] == 1

orbit = saltus.find_orbit(system, u=0.0, relays={"lamp": False})
assert abs(orbit.duration - 4 * math.pi) < 1e-12, orbit.duration
assert np.allclose(orbit.multipliers, math.exp(-4 * math.pi), rtol=1e-6), orbit.multipliers
branch = saltus.continue_orbit(orbit, "model.gain", (0.5, 2.0))
for point in branch.orbits:
    whole = point.motion()
    gain = point.system.model.gain
    tops = [abs(whole.at(e.time)[0]) for e in whole.events if e.contact == "lamp"]
    assert np.allclose(tops, gain * math.tanh(math.pi), rtol=1e-9), (gain, tops)
assert (min(branch.parameters), max(branch.parameters)) == (0.5, 2.0)
assert len(np.ravel(saltus.plot(motion))) and len(np.ravel(saltus.plot(branch)))
print(len(lamp), "turns")
"""


def changed():
    """The text of each file with the new kind of part."""
    for name, changes in TOGGLE.items():
        text = (Path(saltus.__file__).parent / name).read_text()
        for line, more in changes.items():
            assert text.count(line) == 1, f"{name}: {line}"
            text = text.replace(line, more)
        yield name, text


def test_a_new_kind_of_part_takes_few_files():
    """The files are those of the dry run below, and each still has the lines behind which it puts
    something.
    """
    assert len(TOGGLE) <= MOST_FILES
    for name, text in changed():
        compile(text, name, "exec")


@pytest.mark.thorough
def test_a_new_kind_of_part_comes_from_a_model_to_a_branch_and_a_plot(tmp_path):
    """u' = g s - u, where s turns at each rise of sin t through 1/2: every 2 pi. So u is
    +-g tanh pi where it turns, with the period 4 pi and the multiplier exp(-4 pi).
    """
    shutil.copytree(
        Path(saltus.__file__).parent,
        tmp_path / "saltus",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    for name, text in changed():
        (tmp_path / "saltus" / name).write_text(text)
    command = [sys.executable, "-c", MOTION, str(tmp_path)]
    done = subprocess.run(
        command,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "7 turns\n", done.stderr
