"""The page in a real browser, with a plain integrator in the place of the engine: clicks, typing,
keys, links, exports.
"""

from __future__ import annotations

import math
from typing import Any

import pytest
import stand_in
from computing_page import BROWSER, SETTLED, ComputingPage, click_at, field, place, saved, state

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium, Chrome or Edge is installed here"
)


def spectrum() -> dict[str, Any]:
    """A diagram as `results.py` writes it: one branch that folds."""
    amplitude = [0.2 + 0.05 * i for i in range(21)]
    return {
        "kind": "diagram",
        "title": "Response spectrum",
        "digest": "stand-in-wall",
        "values": {"model.damping": 0.1, "load.frequency": 0.8},
        "path": "load.frequency",
        "quantity": "amplitude",
        "branches": [
            {
                "parameter": [0.7 + 0.02 * i for i in range(21)],
                "amplitude": amplitude,
                "stable": [int(i < 10) for i in range(21)],
                "period": [1] * 21,
                "start": [[0.1 * i / 20, 0.5] for i in range(21)],
                "time": [0.25] * 21,
                "multipliers": [[[0.5, 0.0], [1.5, 0.0]]] * 21,
                "evidence": ["residual 1e-15"] * 21,
            }
        ],
        "special": [{"kind": "LP", "parameter": 0.9, "amplitude": 0.7, "text": "fold"}],
        "dots": {"parameter": [0.8], "amplitude": [0.4]},
        "bands": [],
    }


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    page = ComputingPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(
        stand_in.page_of(
            stand_in.wall()
            | {"results": [spectrum(), spectrum() | {"digest": "foreign", "title": "Other"}]}
        )
    )
    return path


@pytest.fixture
def page(window, file):
    window.errors.clear()
    window(
        "Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "light"}]
    )
    window.go("about:blank")
    window.open(file, 1440, 1000)
    yield window
    assert window.errors == []  # of its scripts, or of what its policy refused


def test_the_page_opens_from_disk_and_asks_for_nothing_else(page):
    # its own text
    assert page.evaluate(
        "performance.getEntriesByType('resource').every(({name}) => name.startsWith('blob:'))"
    )
    assert page.evaluate("document.querySelector('#notice').hidden")
    assert page.evaluate("document.title") == "An oscillator at a wall"
    assert "default-src 'none'" in page.evaluate(
        "document.querySelector('meta[http-equiv]').content"
    )
    assert (
        page.evaluate("fetch('data:text/plain,x').then(() => 'reached', () => 'refused')")
        == "refused"
    )
    page.errors.clear()  # of the policy, which the line above went against


@pytest.mark.parametrize("width", [380, 760, 1440])
def test_nothing_is_wider_than_the_screen(page, file, width):
    page.open(file, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for canvas in ("#stage canvas", "#view-phase .base, #view-phase canvas"):
        assert page.evaluate(f"document.querySelector({canvas!r}).width") > 200


TICKS = """(() => { const plot = saltusPage.plotOf(%r); plot.top.scrollIntoView({block: "center"}); plot.drawNow();
    const shown = []; const ctx = plot.base.getContext("2d"); const own = ctx.fillText;
    ctx.fillText = (text, ...at) => shown.push([text, ...at]); plot.drawNow(); ctx.fillText = own;
    const {left, top, width, height} = plot.painter(ctx, {}).box;
    const numbers = shown.filter(([text]) => Number.isFinite(Number(text.replace("\\u2212", "-"))));
    return [numbers.filter((t) => t[2] > top + height), numbers.filter((t) => t[1] < left)]; })()"""


@pytest.mark.parametrize(("width", "height"), [(320, 640), (380, 800), (928, 800)])
@pytest.mark.parametrize("view", ["phase", "history", "energy"])
def test_an_axis_has_two_numbers_in_a_narrow_frame(page, file, width, height, view):
    """That of a phone, and of the start page of the documentation, 928 pixels wide."""
    page.open(file, width, height)
    # multiples of 2 are the next round numbers where three have room, and 0 is the only one of them
    page.evaluate(f"saltusPage.store.set({{windows: {{{view}: [-1.9, 1.9, -1.9, 1.9]}}}})")
    page.evaluate(SETTLED)
    for axis in page.evaluate(TICKS % view):
        assert len({text for text, *_ in axis}) >= 2


def test_a_typed_number_changes_the_motion_and_a_refused_one_says_why_beside_the_field(page):
    page.type(field("model.damping"), "0.25")
    assert state(page)["values"]["model.damping"] == 0.25
    before = page.evaluate("saltusPage.session.motion.state(50)")
    page.type(field("model.damping"), "-1")
    assert state(page)["values"]["model.damping"] == 0.25
    said = page.evaluate(
        f"document.querySelector('{field('model.damping', '.refusal')}').textContent"
    )
    assert said == "damping must lie in [0, inf), got -1. The page still shows 0.25."
    page.type(field("model.damping"), "abc")
    said = page.evaluate(
        f"document.querySelector('{field('model.damping', '.refusal')}').textContent"
    )
    assert said.startswith("damping must be a finite number, got 'abc'")
    assert page.evaluate("saltusPage.session.motion.state(50)") == before
    page.click(field("model.damping", ".reset"))
    assert state(page)["values"]["model.damping"] == 0.1


def test_a_slider_moves_the_number_and_its_range_can_be_changed(page):
    page.type(field("impact.e", ".high"), "0.9")
    page.evaluate(f"document.querySelector('{field('impact.e', '.slider')}').focus()")
    page.press("End", 35)
    assert state(page)["values"]["impact.e"] == 0.9
    assert page.evaluate(f"document.querySelector('{field('impact.e')}').value") == "0.9"
    page.type(field("impact.e", ".low"), "2")
    assert "lower end" in page.evaluate(
        f"document.querySelector('{field('impact.e', '.refusal')}').textContent"
    )


def test_angles_are_degrees_or_radians(page):
    page.type(field("load.force.phase"), "90")
    assert state(page)["values"]["load.force.phase"] == math.pi / 2
    page.click("#degrees")
    assert (
        page.evaluate(f"document.querySelector('{field('load.force.phase')}').value")
        == "1.5707963267948966"
    )
    page.type(field("load.force.phase"), "45 deg")
    assert state(page)["values"]["load.force.phase"] == math.pi / 4


def test_a_click_in_the_phase_plane_starts_a_motion_there(page):
    click_at(page, "phase", -0.4, 0.8)
    start = state(page)["start"]
    assert start["x"] == pytest.approx(-0.4, abs=0.02)
    assert start["x_velocity"] == pytest.approx(0.8, abs=0.02)


def test_time_plays_steps_and_goes_from_impact_to_impact(page):
    page.evaluate("document.activeElement?.blur()")
    page.press("n", 78)
    shown = state(page)["cursor"]
    assert shown == page.evaluate("saltusPage.session.motion.events[0].time")
    assert page.evaluate("document.querySelector('#impact').textContent") == "impact"
    page.press(".", 190)
    assert state(page)["cursor"] > shown
    page.click("#transport .play")
    page.evaluate("new Promise((done) => setTimeout(done, 120))")
    assert state(page)["playing"]
    page.click("#transport .play")
    later = state(page)["cursor"]
    assert later > shown
    click_at(page, "history", 40.0, 0.0)
    assert state(page)["cursor"] == pytest.approx(40.0, abs=1.0)


def test_wheel_dragging_and_keys_zoom_and_pan(page):
    left, top = place(page, "history", 50.0, 0.0)
    page.point("mouseWheel", left, top, deltaX=0, deltaY=-400)
    zoomed = state(page)["windows"]["history"]
    whole = page.evaluate("saltusPage.plotOf('history').all")
    assert zoomed[1] - zoomed[0] < 0.8 * (whole[1] - whole[0])
    assert zoomed[0] < 50.0 < zoomed[1]
    page.point("mousePressed", left, top)
    page.point("mouseMoved", left - 40, top, button="left", buttons=1)
    page.point("mouseReleased", left - 40, top)
    assert state(page)["windows"]["history"][0] > zoomed[0]
    page.evaluate("saltusPage.plotOf('history').top.focus()")
    page.press("0", 48)
    assert state(page)["windows"]["history"] is None
    page.press("+", 187)
    page.press("ArrowRight", 39)
    assert page.evaluate(
        "document.querySelector('#view-history + .readout').textContent"
    ).startswith("τ = ")
    page.press("Enter", 13)
    assert state(page)["cursor"] == pytest.approx(
        page.evaluate("saltusPage.plotOf('history').cursor.x")
    )


def test_the_readout_has_all_digits_of_the_motion(page):
    left, top = place(page, "history", 33.0, 0.0)
    page.point("mouseMoved", left, top)
    said = page.evaluate("document.querySelector('#view-history + .readout').textContent")
    time = state(page)["hover"]
    x = page.evaluate(f"saltusPage.session.motion.state({time!r})[0]")
    assert said.startswith(f"τ = {time!r}, x = {x!r}".replace("-", "−"))


def test_the_link_opens_the_same_state_and_a_damaged_one_is_refused(page, file):
    page.type(field("model.damping"), "0.17")
    click_at(page, "phase", -0.2, 0.3)
    page.press("n", 78)
    page.evaluate("saltusPage.address.write()")
    before, link = state(page), page.evaluate("location.hash")
    assert "model.damping=0.17" in link
    for fragment, refused in ((link, False), (link.replace("0.17", "0.18"), True)):
        page.go("about:blank")
        page.go(file.as_uri() + fragment)
        after = state(page)
        told = page.evaluate("document.querySelector('#notice').textContent")
        assert ("damaged" in told) == refused
        kept = ("values", "start", "cursor", "periods")
        assert [after[name] == before[name] for name in kept] == (
            [False, False, False, True] if refused else [True] * 4
        )


def test_a_click_on_a_branch_shows_its_orbit_and_arrow_keys_step_along(page):
    branch = spectrum()["branches"][0]
    click_at(page, "result", branch["parameter"][5], branch["amplitude"][5])
    now = state(page)
    assert now["selected"] == {"result": 0, "branch": 0, "point": 5}
    assert now["values"]["load.frequency"] == branch["parameter"][5]
    assert now["start"] == {"time": 0.25, "x": branch["start"][5][0], "x_velocity": 0.5}
    assert now["periods"] == 1
    said = page.evaluate("document.querySelector('#orbit').textContent")
    assert "stable" in said
    assert "multipliers 0.5, 1.5" in said
    page.evaluate("saltusPage.plotOf('result').top.focus()")
    page.press("ArrowRight", 39)
    assert state(page)["values"]["load.frequency"] == branch["parameter"][6]
    page.type(field("model.damping"), "0.3")
    assert "damping = 0.1" in page.evaluate("document.querySelector('#differing').textContent")


def test_the_marks_of_special_points_are_explained(page):
    items = "[...document.querySelectorAll('#special-legend li')].map((item) => item.textContent)"
    assert page.evaluate(items) == ["fold (LP), 1"]
    assert page.evaluate("document.querySelector('#special-legend polygon').points.length") == 24


def test_kinds_without_an_abbreviation_have_a_shape_each(window, tmp_path):
    """A model's own margins are told apart, and their names are said once."""
    kinds = ("LP", "reaction", "line_limit")
    branch = spectrum() | {
        "special": [
            {"kind": kind, "parameter": 0.8 + 0.1 * i, "amplitude": 0.5, "text": kind}
            for i, kind in enumerate(kinds)
        ]
    }
    path = tmp_path / "margins.html"
    path.write_text(stand_in.page_of(stand_in.wall() | {"results": [branch]}))
    window.open(path, 1200)
    shapes = window.evaluate(
        "[...document.querySelectorAll('#special-legend polygon')].map((p) => "
        "p.getAttribute('points'))"
    )
    assert len(set(shapes)) == 3
    items = window.evaluate(
        "[...document.querySelectorAll('#special-legend li')].map((item) => item.textContent)"
    )
    assert items == ["LP (LP), 1", "reaction, 1", "line_limit, 1"]


def test_a_result_of_another_system_is_not_shown(page):
    assert page.evaluate("document.querySelector('#results-refused').textContent") == (
        "Other is a result of another system and is not shown."
    )
    assert page.evaluate("document.querySelector('#result-choice').options.length") == 1


def test_a_sweep_carries_the_motion_up_and_down(page):
    for name, value in (("values", 5), ("periods at each", 10)):
        script = (
            "[...document.querySelectorAll('.setting')].find((l) => "
            f"l.textContent.startsWith({name!r})).querySelector('input')"
        )
        page.evaluate(
            f"(() => {{ const i = {script}; i.value = '{value}'; i.dispatchEvent(new "
            f"Event('change')); }})()"
        )
    page.click("#sweep-controls .run")
    done = """new Promise((done) => { const look = () => saltusPage.sweep.result.done
    ? done(saltusPage.sweep.result) : setTimeout(look, 20); look(); })"""
    result = page.evaluate(done)
    assert [len(result["up"]), len(result["down"])] == [5, 5]
    assert [p["value"] for p in result["up"]] == [p["value"] for p in reversed(result["down"])]
    assert all(p["amplitude"] > 0 for p in result["up"])


def test_pictures_and_columns_are_exported(page):
    svg = saved(page, '[aria-label="Phase plane as SVG"]')
    assert svg.startswith("<svg")
    assert svg.count("<path") > 8
    columns = page.evaluate(
        "saltusPage.plots.map(({view}) => Object.entries(view.csv()).map(([n, c]) => [n, "
        "c.length]))"
    )
    phase = dict(columns[0])
    assert set(phase) == {"time", "x", "x_velocity"}
    assert len(set(phase.values())) == 1 < phase["time"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_colours_follow_the_reader_and_the_switch(page, file, scheme):
    page("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    page.evaluate(SETTLED)
    paper = {"light": "rgb(255, 255, 255)", "dark": "rgb(21, 23, 26)"}
    background = "getComputedStyle(document.documentElement).backgroundColor"
    assert page.evaluate(background) == paper[scheme]
    page.evaluate(
        "(() => { const s = document.querySelector('#theme'); s.value = 'dark'; "
        "s.dispatchEvent(new Event('change')); })()"
    )
    assert page.evaluate(background) == paper["dark"]


def test_everything_has_a_name_for_screen_readers(page):
    page("Accessibility.enable")
    nodes = page("Accessibility.getFullAXTree")["nodes"]
    named = ("button", "slider", "textbox", "combobox", "checkbox", "application", "img")
    nameless = [
        n
        for n in nodes
        if n.get("role", {}).get("value") in named and not n.get("name", {}).get("value")
    ]
    assert not nameless
    assert len([n for n in nodes if n.get("role", {}).get("value") == "slider"]) > 8
    page("Accessibility.disable")


def test_a_hostile_study_is_text(window, tmp_path):
    hostile = stand_in.wall() | {
        "title": "<img src=x onerror=alert(1)></title><script>alert(1)</script>"
    }
    hostile["results"] = [
        spectrum() | {"title": "<b>bold</b>"},
        spectrum() | {"title": "<i>second</i>"},
    ]
    (tmp_path / "page.html").write_text(stand_in.page_of(hostile))
    window.errors.clear()
    window.open(tmp_path / "page.html", 1200)
    assert window.evaluate("document.querySelector('h1').textContent") == hostile["title"]
    assert window.evaluate("document.querySelectorAll('img, b, h1 *').length") == 0
    assert window.errors == []
