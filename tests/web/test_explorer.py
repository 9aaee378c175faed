"""A page in a notebook: Python's half by its traits, the notebook's half in Chromium with a
stand-in for the widget's model.
"""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
import stand_in
from browser_page import BrowserPage
from test_page_in_a_browser import BROWSER
from typer.testing import CliRunner

import saltus
from saltus.cli.app import app
from saltus.flow import PortableMotion
from saltus.web import one_file
from saltus.web.description import description

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=0.9, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
)
DAMPED = SYSTEM.with_({"model.damping": 0.2})


@pytest.fixture(scope="module")
def made():
    return saltus.explore(SYSTEM, theta=0.3, velocity=0.1, periods=7)


@pytest.fixture
def explorer(made):
    """An explorer as it was made."""
    made.system, made.state = SYSTEM, {"theta": 0.3, "velocity": 0.1, "time": 0.0, "periods": 7}
    yield made
    made.widget.unobserve_all()


def test_the_explorer_shows_the_system_and_the_motion_that_it_was_given(explorer):
    assert explorer.system == SYSTEM
    assert explorer.state == {"theta": 0.3, "velocity": 0.1, "time": 0.0, "periods": 7.0}
    assert (
        saltus.simulate(explorer.system, **explorer.state).time
        == saltus.simulate(SYSTEM, theta=0.3, velocity=0.1, periods=7).time
    )
    assert '"embedded": true' in explorer.widget.page
    assert "application/vnd.jupyter.widget-view+json" in explorer._repr_mimebundle_()[0]
    assert explorer._display_() is explorer.widget


def test_python_changes_the_page(explorer):
    told = []
    explorer.widget.observe(lambda change: told.append(change.name), ["values", "start", "periods"])
    explorer.system = DAMPED
    assert explorer.widget.values["model.damping"] == 0.2
    explorer.state = {"theta": -0.1, "periods": 3}
    assert explorer.widget.start == {"time": 0.0, "theta": -0.1, "theta_velocity": 0.1}
    assert explorer.state == {"theta": -0.1, "velocity": 0.1, "time": 0.0, "periods": 3.0}
    assert told == ["values", "start", "periods"]


def test_the_page_changes_what_python_has(explorer):
    """`set_state` takes what a notebook sends."""
    explorer.widget.set_state(
        {"values": {**explorer.widget.values, "model.damping": 0.2, "load.horizontal.order": 1}}
    )
    explorer.widget.set_state(
        {"start": {"time": 0.5, "theta": 0.25, "theta_velocity": -1}, "periods": 20}
    )
    assert explorer.system == DAMPED
    assert explorer.state == {"theta": 0.25, "velocity": -1.0, "time": 0.5, "periods": 20.0}


def test_a_system_with_several_coordinates_has_as_many_velocities(monkeypatch):
    """What Python knows of the page; the kernel for several contacts, of a minute of compiling, is
    that of test_agreement.py.
    """
    monkeypatch.setattr(
        "saltus.web.study_page.page_parts",
        lambda system: (b"", description(PortableMotion(system))),
    )
    system = saltus.System(
        model=saltus.TwoLayer(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(vertical=-0.5),
        impact=saltus.NewtonImpact(e=0.4),
    )
    explorer = saltus.explore(system, theta_1=0.2, theta_2=0.0, velocity=(0.3, 0.1), duration=9)
    assert explorer.state == {
        "theta_1": 0.2,
        "theta_2": 0.0,
        "velocity": (0.3, 0.1),
        "time": 0.0,
        "duration": 9.0,
    }
    explorer.state = {"velocity": (0.0, 0.0)}
    assert explorer.widget.start == {
        "time": 0.0,
        "theta_1": 0.2,
        "theta_2": 0.0,
        "theta_1_velocity": 0.0,
        "theta_2_velocity": 0.0,
    }
    assert explorer.widget.periods == 9.0


def test_what_python_cannot_show_is_refused_and_changes_nothing(explorer):
    other = saltus.System(
        model=saltus.WallOscillator(damping=0.1),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.5)),
    )
    with pytest.raises(
        saltus.ParameterError, match="system must differ from the explorer's in its numbers alone"
    ):
        explorer.system = other
    with pytest.raises(saltus.ParameterError, match="no coordinate 'tetha'"):
        explorer.state = {"tetha": 1.0}
    with pytest.raises(saltus.ParameterError, match="periods must"):
        explorer.state = {"periods": -1}
    with pytest.raises(saltus.ParameterError, match="not a result of the kind 'motion'"):
        explorer.add(saltus.simulate(SYSTEM, theta=0.3, periods=1))
    assert explorer.system == SYSTEM
    assert explorer.widget.results == []
    assert explorer.state["theta"] == 0.3


def test_without_anywidget_one_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(
        saltus.SaltusError, match=r'through the package anywidget: pip install "\.\[explore\]"'
    ):
        saltus.explore(SYSTEM, theta=0.3)


def test_a_branch_appears_while_it_grows(explorer, monkeypatch):
    # a second between any two orbits
    monkeypatch.setattr("saltus.web.study_page.monotonic", iter(range(1000)).__next__)
    seen = []
    explorer.widget.observe(
        lambda change: seen.append(change.new[0]["branches"][0]["parameter"]), "results"
    )
    orbit = saltus.find_orbit(SYSTEM, theta=0.3)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.88, 0.92), growing=explorer.add)
    assert seen[-1] == branch.parameters.tolist()
    assert [len(each) for each in seen] == sorted(len(each) for each in seen)
    assert len(seen) >= len(branch.points) - 2
    for each in seen:  # always the points around the first one, in order
        places = [seen[-1].index(value) for value in each]
        assert places == list(range(places[0], places[0] + len(each)))
    explorer.add(branch, "the same")
    assert [entry["title"] for entry in explorer.widget.results] == ["Branch", "the same"]
    assert explorer.widget.results[0]["special"] == explorer.widget.results[1]["special"]


def test_growing_changes_no_branch_and_is_told_the_whole_one():
    orbit, told = saltus.find_orbit(SYSTEM, theta=0.3), []
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.88, 0.92), growing=told.append)
    assert told[-1] is branch
    assert all(str(each.ends[0]) == "is still followed" for each in told[:-1])
    assert (
        saltus.continue_orbit(orbit, "load.frequency", (0.88, 0.92)).parameters.tolist()
        == branch.parameters.tolist()
    )


STUDY = """
[model]
type = "Metainterface"
beta0 = "80 deg"
damping = 0.1
[load]
frequency = 0.9
horizontal = { amplitude = 0.5 }
vertical = -0.5
[simulate]
theta = 0.3
periods = 5
"""


@pytest.mark.parametrize(
    ("opens", "said"), [(True, "your browser opens it"), (False, "open it in a browser")]
)
def test_the_command_makes_the_page_among_the_results_and_opens_it(
    tmp_path, monkeypatch, opens, said
):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or opens)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cell.toml").write_text(STUDY)
    found = CliRunner().invoke(app, ["explore", "cell.toml"])
    assert (found.exit_code, found.stdout) == (0, f"The page is results/cell/cell.html; {said}.\n")
    assert opened == [(tmp_path / "results" / "cell" / "cell.html").as_uri()]
    assert "<title>cell</title>" in (tmp_path / "results" / "cell" / "cell.html").read_text()


# --- the notebook's half -----------------------------------------------------

NOTEBOOK = """<!doctype html><meta charset="utf-8"><body style="margin: 0; color: white; background: black"><div id="cell"></div>
<script type="application/json" id="traits">%s</script><script type="text/plain" id="module">%s</script><script type="module">
const traits = JSON.parse(document.getElementById("traits").textContent), heard = new Map(), of = (name) => heard.get(name) ?? [];
globalThis.saved = [];
globalThis.model = {
  get: (name) => traits[name], set: (name, value) => (traits[name] = value), save_changes: () => saved.push({ ...traits }),
  on: (name, act) => heard.set(name, [...of(name), act]), off: (name, act) => heard.set(name, of(name).filter((f) => f !== act)),
  python: (name, value) => { traits[name] = value; of(`change:${name}`).forEach((act) => act()); },
  listeners: () => [...heard.values()].flat().length,
};
const text = document.getElementById("module").textContent;
const { default: view } = await import(URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
globalThis.end = view.render({ model, el: document.getElementById("cell") });
</script>"""


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    if BROWSER is None:
        pytest.skip("no Chromium, Chrome or Edge is installed here")
    page = BrowserPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture
def notebook(window, tmp_path):
    """A page with the explorer's view in it, whose frame has the stand-in engine."""
    described = stand_in.wall() | {"embedded": True}
    numbers = [*described["model"]["parameters"], *described["impact"]["parameters"]]
    numbers += [each for part in described["load"] for each in part["parameters"]]
    traits = {
        "values": {each["path"]: each["value"] for each in numbers},
        "start": described["start"],
        "periods": 12,
        "results": [],
    }
    traits |= {"title": "A wall", "height": 900, "page": stand_in.page_of(described)}
    module = (one_file.PAGE / "notebook.js").read_text()
    (tmp_path / "notebook.html").write_text(
        NOTEBOOK % (json.dumps(traits).replace("<", "\\u003c"), module)
    )
    window.errors.clear()
    window.open(tmp_path / "notebook.html", 1300, 940)
    told(window, "values.load.frequency", 0.8, 'model.python("periods", 11)')  # the page is there
    yield window
    assert window.errors == []


def told(window, name, value, act="0"):
    """Do something, and wait until the page has told the notebook of a value."""
    trait, _, key = name.partition(".")
    there = f"traits[{trait!r}]" + (f"[{key!r}]" if key else "")
    script = f"""new Promise((done) => {{ saved.length = 0; {act};
    const look = () => (saved.some((traits) => Math.abs({there} - {value!r}) < 0.05) ? done(saved.at(-1)) : setTimeout(look, 10));
    look(); }})"""
    return window.evaluate(script)


def test_the_page_in_its_frame_and_the_notebook_tell_each_other(notebook):
    assert (
        notebook.evaluate("document.querySelector('iframe').getAttribute('sandbox')")
        == "allow-scripts allow-downloads"
    )
    # neither reaches into the other
    assert notebook.evaluate("document.querySelector('iframe').contentDocument") is None
    damped = 'model.python("values", {...model.get("values"), "model.damping": 0.4})'
    assert told(notebook, "values.model.damping", 0.4, damped)["periods"] == 11
    refused = 'model.python("values", {...model.get("values"), "model.damping": -1})'
    # what is still shown
    assert told(notebook, "values.model.damping", 0.4, refused)["values"]["model.damping"] == 0.4
    started = 'model.python("start", {time: 0, x: 0.25, x_velocity: 0.5})'
    assert told(notebook, "start.x", 0.25, started)["start"] == {
        "time": 0,
        "x": 0.25,
        "x_velocity": 0.5,
    }


def test_a_click_in_the_frame_reaches_python_and_the_view_can_be_closed(notebook):
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        notebook.point(kind, 1080.0, 250.0)  # somewhere in the phase plane
    heard = notebook.evaluate(
        """new Promise((done) => { const look = () => (saved.length && saved.at(-1).start.x !== 0
    ? done(saved.at(-1).start) : setTimeout(look, 10)); look(); })"""
    )
    assert heard["time"] == 0
    assert heard["x"] != 0
    assert heard["x_velocity"] != 0
    assert notebook.evaluate("model.listeners()") == 4
    assert notebook.evaluate(
        "(end(), [model.listeners(), document.querySelectorAll('iframe').length])"
    ) == [0, 0]


class Backlash(saltus.ContactModel):
    """A mass with another stiffness beyond a surface."""

    coordinates = ("x",)
    surfaces = (saltus.Surface(name="stop", coordinate="x", position=0.1),)

    def force(self, t, q, velocity, load, sides):
        return -q - (1.0 + sides.stop) * (q - 0.1)


@pytest.mark.parametrize("show", [saltus.page, saltus.explore])
def test_surfaces_which_a_page_does_not_follow_are_refused_by_both_doors(
    show, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        saltus.ParameterError, match="a page cannot show surfaces yet, and Backlash has some"
    ):
        show(saltus.System(model=Backlash()), x=0.0)
    assert list(tmp_path.iterdir()) == []
