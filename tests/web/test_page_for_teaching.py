"""What a teacher needs of a page, in Chromium: presets, undo, no empty panels, a phone, and walls
where the numbers put them.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from computing_page import BROWSER, SETTLED, ComputingPage, field, state

import saltus
from saltus.errors import ParameterError

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium, Chrome or Edge is installed here"
)
WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.5)),
    impact=saltus.VelocityReduction(0.8),
)


@dataclass(frozen=True, kw_only=True)
class Ledge(saltus.OneContactModel):
    """A mass on a spring that lands on a ledge, whose height is one of its numbers."""

    height: float = -0.5

    coordinates = ("x",)
    channels = ("force",)
    sides = (1,)

    @property
    def contact(self):
        return 2.0 * self.height

    def gap(self, x, side):
        return x - 2.0 * self.height

    def acceleration(self, t, x, velocity, side, load):
        return load.force(t) - x

    def reset(self, t, velocity, side, load, impact):
        return side, -impact.velocity_after(self, t, velocity, side, side, load)


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    page = ComputingPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture(scope="module")
def wall_page(tmp_path_factory):
    presets = {"two motions": {"load.frequency": 1.4, "x": -2.0}, "softer": {"impact.e": 0.25}}
    path = tmp_path_factory.mktemp("pages") / "wall.html"
    return saltus.page(WALL, path=path, title="A wall", presets=presets, x=0.0)


def test_a_structure_is_drawn_by_its_points_with_their_stops(window, tmp_path):
    """Three masses in a row: where the shapes are is where the displacements are, in one unit."""
    stiffness = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    contacts = [
        saltus.Contact(name="tip", coordinate=2, position=0.5, sign=-1),
        saltus.Contact(name="low", coordinate=0, position=-0.25),
    ]
    model = saltus.Structure(mass=np.eye(3), stiffness=stiffness, contacts=contacts)
    system = saltus.System(model=model, impact=saltus.NewtonImpact(e=0.5))
    u = np.array([-0.1, 0.2, 0.4])
    path = tmp_path / "row.html"
    window.open(saltus.page(system, path=path, **model.start(u), duration=5.0), 1300, 900)
    shapes = window.evaluate("saltusPage.stage.pictureAt(0).shapes")
    masses = [np.array(s["points"]) for s in shapes if s["role"] == "mass"]
    walls = [np.array(s["points"]) for s in shapes if s["role"] == "wall"]
    names = [s["text"] for s in shapes if s["kind"] == "text"]
    middles = np.array([corners.mean(axis=0) for corners in masses])
    scale = (middles[2, 1] - middles[0, 1]) / (u[2] - u[0])
    np.testing.assert_allclose(middles[:, 1], scale * u, atol=1e-12)
    assert names == ["x₀", "x₁", "x₂"]
    half = np.ptp(masses[0][:, 1]) / 2
    faces = sorted((wall[0, 0] + wall[1, 0], wall[0, 1]) for wall in walls)
    np.testing.assert_allclose(faces[0][1], -0.25 * scale - half, atol=1e-12)
    np.testing.assert_allclose(faces[1][1], 0.5 * scale + half, atol=1e-12)
    assert window.errors == []


def seen(window, identity):
    """Whether an element takes any room."""
    return window.evaluate(
        f"document.getElementById('{identity}').getBoundingClientRect().height > 0"
    )


def test_a_preset_is_chosen_and_undone(window, wall_page):
    window.errors.clear()
    window.open(wall_page, 1300, 900)
    choose = (
        "(() => { const s = document.getElementById('preset'); s.value = '0'; "
        "s.dispatchEvent(new Event('change')); })()"
    )
    window.evaluate(choose)
    window.evaluate(SETTLED)
    now = state(window)
    assert now["values"]["load.frequency"] == 1.4
    assert now["start"]["x"] == -2.0
    end = window.evaluate(
        "(() => { const m = saltusPage.session.motion; return m.state(m.time.last)[0]; })()"
    )
    shown = WALL.with_({"load.frequency": 1.4})
    motion = saltus.simulate(shown, x=-2.0, periods=20)
    np.testing.assert_allclose(end, motion.x, atol=1e-7)
    window.evaluate("document.getElementById('undo').click()")
    now = state(window)
    assert now["values"]["load.frequency"] == 1.2
    assert now["start"]["x"] == 0.0
    assert window.evaluate("document.getElementById('undo').disabled")
    assert window.errors == []


def test_a_drag_is_one_step_back(window, wall_page):
    window.open(wall_page, 1300, 900)
    for value in (0.2, 0.3, 0.4):
        window.evaluate(f"saltusPage.change('model.damping', {value})")
    window.evaluate("saltusPage.history.undo()")
    assert state(window)["values"]["model.damping"] == 0.1


def test_a_panel_is_open_when_it_is_asked_for(window, wall_page, tmp_path):
    window.open(wall_page, 1300, 900)
    assert not seen(window, "view-sweep")
    assert not seen(window, "view-basins")
    assert seen(window, "view-section")
    window.evaluate("saltusPage.sweepRun.click()")
    assert seen(window, "view-sweep")
    free = saltus.System(model=saltus.WallOscillator(damping=0.1))
    window.open(saltus.page(free, path=tmp_path / "free.html", x=-1.0), 1300, 900)
    assert not seen(window, "view-section")


def test_on_a_phone_the_mechanism_stays_while_numbers_are_dragged(window, wall_page):
    window.open(wall_page, 380, 760)
    where = (
        "['stage', 'numbers-panel', 'view-phase'].map("
        "(id) => document.getElementById(id).getBoundingClientRect().top)"
    )
    stage, numbers, phase = window.evaluate(where)
    assert stage < numbers < phase
    window.evaluate("scrollTo(0, 600)")
    assert 0.0 <= window.evaluate(where)[0] < 60.0
    assert window.evaluate("document.documentElement.scrollWidth") <= 380
    window.evaluate("scrollTo(0, 0)")


def test_extrema_are_those_of_the_motion(window, wall_page):
    window.open(wall_page, 1300, 900)
    said = window.evaluate("document.getElementById('extrema').textContent")
    motion = saltus.simulate(WALL, x=0.0, periods=20)
    low, high = motion.extrema[0]
    numbers = said.replace("−", "-").split(";")[0].split()
    assert float(numbers[2]) == pytest.approx(low, abs=2e-3)
    assert float(numbers[4]) == pytest.approx(high, abs=1e-4)


def test_a_wall_of_an_own_model_stands_where_its_numbers_say(window, tmp_path):
    ledge = saltus.System(
        model=Ledge(),
        load=saltus.Load(frequency=1.3, force=saltus.Harmonic(0.4)),
        impact=saltus.VelocityReduction(0.7),
    )
    window.open(saltus.page(ledge, path=tmp_path / "ledge.html", x=0.0), 1300, 900)
    (stop,) = window.evaluate("saltusPage.stage.stops()")
    assert (stop["position"], stop["side"]) == (-1.0, -1)
    window.type(field("model.height"), "-0.3")
    window.evaluate(SETTLED)
    (stop,) = window.evaluate("saltusPage.stage.stops()")
    assert stop["position"] == pytest.approx(-0.6)


@pytest.mark.parametrize(
    ("presets", "words"),
    [
        (3, "presets must be a dictionary"),
        ({"a": 3}, "must be a dictionary of numbers"),
        ({"a": {"model.dampin": 1.0}}, "dampin"),
        ({"a": {"x": "far"}}, "must be a finite number"),
    ],
)
def test_presets_without_a_meaning_are_refused(tmp_path, presets, words):
    with pytest.raises(ParameterError, match=words) as refusal:
        saltus.page(WALL, path=tmp_path / "page.html", presets=presets)
    assert "\n" not in str(refusal.value)
