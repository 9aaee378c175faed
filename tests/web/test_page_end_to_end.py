"""Pages as saltus writes them, opened from disk in a real browser: what a reader does on them,
against Python.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from computing_page import (
    BROWSER,
    SETTLED,
    ComputingPage,
    click_at,
    field,
    place,
    saved,
    state,
    text,
)

import saltus

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium, Chrome or Edge is installed here"
)

CELL = saltus.System(
    model=saltus.Metainterface(beta0=math.radians(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.1), vertical=-1.5),
    impact=saltus.VelocityReduction(0.8),
)  # tristable: motions about both buckled states, with impacts between them, and rest
ROUNDING = 1e-11  # of a motion of twenty periods that is not sensitive


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return saltus.page(CELL, path=tmp_path_factory.mktemp("page") / "cell.html", theta=0.4)


@pytest.fixture(scope="module")
def window(tmp_path_factory, file):
    page = ComputingPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    page.open(file, 1440, 1000)
    yield page
    page.close()


@pytest.fixture
def page(window):
    """The page in the state in which it opens."""
    window.errors.clear()
    window.evaluate(
        "saltusPage.replaceState(saltusPage.first), saltusPage.choice && "
        "document.activeElement.blur()"
    )
    window.evaluate(SETTLED)
    yield window
    assert window.errors == []  # of its scripts, or of what its policy refused


def simulated(page, system=CELL, **more):
    """Python's motion from the state at the start of the page's, over the same number of
    periods.
    """
    now = state(page)
    start = now["start"]
    return saltus.simulate(
        system,
        theta=start["theta"],
        velocity=start["theta_velocity"],
        periods=now["periods"],
        time=start["time"],
        tol=1e-12,
        **more,
    )


def check_same_motion(page, motion, allowed=ROUNDING):
    """The page's motion is Python's, in its states, its events and its end."""
    times = np.linspace(motion.start, motion.time, 23)
    found = np.array(
        page.evaluate(f"{times.tolist()}.map((t) => [...saltusPage.session.motion.state(t)])")
    )
    angle, velocity = motion.at(times)[:2]
    before = np.abs(times[:, None] - np.append(motion.impacts.time, -1.0)).min(axis=1) > 1e-9
    np.testing.assert_allclose(found[:, 0], angle, atol=allowed, rtol=0)
    np.testing.assert_allclose(found[before, 1], velocity[before], atol=allowed, rtol=0)
    events = page.evaluate("saltusPage.session.motion.events.map(({kind, time}) => [kind, time])")
    assert [kind for kind, _ in events] == [str(event.kind) for event in motion.events]
    np.testing.assert_allclose(
        [time for _, time in events], [event.time for event in motion.events], atol=allowed, rtol=0
    )
    assert page.evaluate("saltusPage.session.motion.time.last") == motion.time


def numbers_in(said):
    """The numbers of a text, by the names before their signs of equality."""
    return {
        name: float(value)
        for name, value in re.findall(r"(\S+) = ([-+.\de]+)", said.replace("−", "-"))
    }


def test_the_page_works_from_disk_and_asks_for_nothing(page, file):
    assert page.evaluate("location.protocol") == "file:"
    assert all(re.match(r"blob:|data:|file:", address) for address in page.requests)
    assert [address for address in page.requests if address.startswith("file:")] == [file.as_uri()]
    check_same_motion(page, simulated(page))
    motion = simulated(page)
    assert text(page, "#summary").startswith(
        f"{len(motion.impacts)} impacts up to time {motion.time:.6g}."
    )
    assert "The model holds at this moment." in text(page, "#validity")


def test_every_number_is_typed_and_the_motion_is_that_of_python(page):
    changes = {"model.damping": 0.2, "impact.e": 0.7, "load.frequency": 1.05, "load.horizontal.amplitude": 0.12,
               "load.vertical": -1.45, "load.horizontal.mean": 0.02}  # fmt: skip
    for path, value in changes.items():
        page.type(field(path), repr(value))
    for path, degrees in (("model.beta0", 79.0), ("load.horizontal.phase", 30.0)):
        page.type(field(path), repr(degrees))
        changes[path] = np.deg2rad(degrees)
    for path, value in (
        ("start.theta", 0.25),
        ("start.theta_velocity", 0.1),
        ("start.time", 0.3),
        ("start.periods", 15),
    ):
        page.type(field(path), repr(value))
    assert {path: state(page)["values"][path] for path in changes} == changes
    assert set(state(page)["values"]) == set(CELL.parameters)
    check_same_motion(page, simulated(page, CELL.with_(changes)))


@pytest.mark.parametrize(
    ("path", "value"),
    [("model.damping", -0.5), ("model.beta0", 4), ("impact.e", -1), ("load.frequency", 0)],
)
def test_what_python_refuses_is_refused_beside_its_field_in_the_same_sentence(page, path, value):
    before = page.evaluate("saltusPage.session.motion.end")
    with pytest.raises(saltus.SaltusError) as refused:
        CELL.with_({path: value})
    page.type(field(path), f"{value!r} rad" if path == "model.beta0" else repr(value))
    page.evaluate(SETTLED)
    assert text(page, field(path, ".refusal")).startswith(f"{refused.value}. The page still shows ")
    assert page.evaluate("saltusPage.session.motion.end") == before


@pytest.mark.parametrize(
    ("path", "typed", "said"),
    [
        ("load.frequency", "1e300", "load.frequency must be at most 1e+100 in size, got 1e+300"),
        (
            "load.horizontal.amplitude",
            "-1e120",
            "load.horizontal.amplitude must be at most 1e+100 in size, got -1e+120",
        ),
        (
            "start.time",
            "1e99",
            "the motion must start and end within 2^53 forcing periods, got 1.59155e+98 of them",
        ),
        ("start.periods", "1e9", "periods must lie in (0, 2000] on this page, got 1000000000"),
        ("model.damping", "NaN", "damping must be a finite number, got 'NaN'"),
        ("impact.e", "<b>", "e must be a finite number, got '<b>'"),
    ],
)
def test_what_is_refused_is_said_beside_the_field_and_nothing_breaks(page, path, typed, said):
    page.type(field(path), typed)
    page.evaluate(SETTLED)
    assert text(page, field(path, ".refusal")).startswith(f"{said}. The page still shows ")
    page.type(field(path), "0.5")  # and it goes on
    page.evaluate(SETTLED)
    assert text(page, field(path, ".refusal")) == ""
    assert page.evaluate("saltusPage.session.motion.time.last") > 0


def test_a_motion_that_leaves_the_range_of_numbers_is_said_to_end(page):
    page.type(field("start.theta_velocity"), "1e90")
    page.evaluate(SETTLED)
    assert page.evaluate("saltusPage.session.motion.stop") == "not_finite"
    assert "It ends: the motion leaves the range of numbers" in text(page, "#summary")


def test_a_slider_is_dragged_and_moved_by_keys(page):
    slider = f"document.querySelector('{field('model.damping', '.slider')}')"
    page.evaluate(f"{slider}.scrollIntoView({{block: 'center'}})")
    box = page.evaluate(
        f"(({{x, y, width, height}}) => [x, y, width, height])({slider}.getBoundingClientRect())"
    )
    thumb = page.evaluate(f"{slider}.value / 1000")
    left, top = box[0] + 8 + thumb * (box[2] - 16), box[1] + box[3] / 2
    page.point("mousePressed", left, top)
    for moved in (10, 25, 40):
        page.point("mouseMoved", left + moved, top, button="left", buttons=1)
    page.point("mouseReleased", left + 40, top)
    dragged = state(page)["values"]["model.damping"]
    assert dragged > 0.1
    check_same_motion(page, simulated(page, CELL.with_({"model.damping": dragged})))
    page.press("ArrowRight", 39)
    assert state(page)["values"]["model.damping"] > dragged


def test_what_is_selected_in_one_view_is_marked_in_all(page):
    pictures = """['phase', 'history', 'section', 'energy'].map((id) => saltusPage.plotOf(id)).map((plot) => {
        plot.drawNow(true); return plot.top.toDataURL(); })"""
    before = page.evaluate(pictures)
    left, top = place(page, "history", 30.0, 0.0)
    page.point("mouseMoved", left, top)
    hovered = state(page)["hover"]
    motion = simulated(page)
    said = numbers_in(text(page, "#view-history + .readout"))
    angle, velocity = (float(each[0]) for each in motion.at([hovered])[:2])
    assert said["τ"] == hovered
    assert [said["θ"], said["θ̇"]] == pytest.approx([angle, velocity], abs=ROUNDING)
    kinetic = CELL.model.kinetic_energy(
        hovered, angle, velocity, math.copysign(1.0, angle), CELL.load
    )
    assert page.evaluate(f"saltusPage.session.motion.energy({hovered!r})") == pytest.approx(
        kinetic, rel=1e-10
    )
    changed = [a != b for a, b in zip(before, page.evaluate(pictures), strict=True)]
    assert changed[:2] == [True, True]
    page.press("Escape", 27)
    click_at(page, "history", 30.0, 0.0)
    assert all(a != b for a, b in zip(before, page.evaluate(pictures), strict=True))
    assert state(page)["cursor"] == hovered


def test_the_mechanism_moves_flashes_and_goes_from_impact_to_impact(page):
    drawn = "document.querySelector('#stage canvas').toDataURL()"
    still = page.evaluate(drawn)
    page.press("n", 78)
    impact = simulated(page).impacts.time[0]
    assert state(page)["cursor"] == pytest.approx(impact, abs=ROUNDING)
    assert text(page, "#impact") == "impact"
    flashing = page.evaluate(drawn)
    assert flashing != still
    page.press(" ", 32)
    frames = """new Promise((done) => { const seen = new Set(); const look = () => { seen.add(saltusPage.store.state.cursor);
    seen.size > 5 ? done(document.querySelector('#stage canvas').toDataURL()) : requestAnimationFrame(look); }; look(); })"""
    assert page.evaluate(frames) != flashing
    page.press(" ", 32)
    assert not state(page)["playing"]


def test_what_is_not_to_be_believed_is_said_there_and_then(page):
    page.type(field("start.theta"), "0.8")
    motion = simulated(page)
    found = page.evaluate("saltusPage.session.motion.validity")
    assert found["first"] == pytest.approx(motion.validity.first, abs=ROUNDING)
    assert found["share"] == pytest.approx(motion.validity.share, abs=ROUNDING)
    first = min(time for time in motion.validity.first.values() if time is not None)
    for time, known in ((motion.start, motion.start >= first), (max(first, 0.0) + 1e-6, True)):
        page.evaluate(f"saltusPage.transport.to({time!r})")
        page.evaluate(SETTLED)
        assert text(page, "#validity").startswith("Past ") == known
    said = "document.querySelector('#summary').textContent.includes('passed first')"
    page.evaluate(
        f"new Promise((done) => {{ const look = () => ({said} ? done() : setTimeout(look, 20)); "
        "look(); })"
    )
    assert f"line limit: passed first at {first:.6g}" in text(page, "#summary")


def test_a_click_starts_a_motion_and_keys_do_the_same(page):
    click_at(page, "phase", 0.1, 0.2)
    start = state(page)["start"]
    assert [start["theta"], start["theta_velocity"]] == pytest.approx([0.1, 0.2], abs=0.01)
    check_same_motion(page, simulated(page))
    page.evaluate("saltusPage.plotOf('phase').top.focus()")
    for key, code in (("ArrowLeft", 37), ("ArrowUp", 38)):
        page.press(key, code)
    aimed = page.evaluate("saltusPage.plotOf('phase').cursor")
    page.press("Enter", 13)
    assert state(page)["start"] == {"time": 0.0, "theta": aimed["x"], "theta_velocity": aimed["y"]}
    check_same_motion(page, simulated(page))


def test_two_fingers_zoom(page):
    left, top = place(page, "phase", 0.0, 0.0)

    def points(apart):
        return [
            {"x": left - apart, "y": top, "id": 0},
            {"x": left + apart, "y": top, "id": 1},
        ]

    whole = page.evaluate("saltusPage.plotOf('phase').seen()")
    page("Input.dispatchTouchEvent", type="touchStart", touchPoints=points(20))
    page("Input.dispatchTouchEvent", type="touchMove", touchPoints=points(40))
    page("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    seen = state(page)["windows"]["phase"]
    assert seen[1] - seen[0] == pytest.approx((whole[1] - whole[0]) / 2, rel=0.1)
    assert state(page)["start"]["theta"] == 0.4  # two fingers do not click


def test_the_link_opens_the_same_motion_and_exports_make_it_in_python(page, file, tmp_path):
    page.type(field("model.damping"), "0.17")
    page.type(field("start.periods"), "7.5")
    click_at(page, "phase", 0.2, 0.1)
    before = state(page)
    end = page.evaluate("[...saltusPage.session.motion.end]")
    (tmp_path / "study.toml").write_text(saved(page, "#save-toml"))
    study = saltus.load_study(tmp_path / "study.toml")
    assert study.system == CELL.with_({"model.damping": 0.17})
    made: dict = {}
    exec(saved(page, "#save-python"), made)
    for motion in (study.run(), made["motion"]):
        assert [motion.theta, motion.velocity] == pytest.approx(end, abs=ROUNDING)
        check_same_motion(page, motion)
    columns = saved(page, '[aria-label="Time history as CSV"]').splitlines()
    assert columns[0] == "time,theta"
    rows = np.array([line.split(",") for line in columns[1:]], dtype=float)
    np.testing.assert_allclose(rows[:, 1], made["motion"].at(rows[:, 0])[0], atol=ROUNDING)
    page.evaluate("saltusPage.address.write()")
    link = page.evaluate("location.hash")
    page.go("about:blank")
    page.go(file.as_uri() + link)
    after = state(page)
    assert {name: after[name] for name in ("values", "start", "periods", "cursor")} == {
        name: before[name] for name in ("values", "start", "periods", "cursor")
    }
    assert page.evaluate("[...saltusPage.session.motion.end]") == end
    page.go("about:blank")
    page.go(file.as_uri())


def test_basins_are_those_of_motions_in_python(page):
    page.evaluate("saltusPage.store.set({windows: {phase: [-1.8, 1.8, -1, 1]}})")
    page.click("#basins-run")
    looking = (
        "const look = () => saltusPage.basins.counted > 600 ? done() : setTimeout(look, "
        "20); look();"
    )
    page.evaluate(f"new Promise((done) => {{ {looking} }})")
    page.evaluate("saltusPage.toggleBasins()")
    found = page.evaluate(
        "saltusPage.basins.attractors.map(({name, period, section}) => [name, period, section])"
    )
    assert len(found) == 4
    assert sorted(period for _, period, _ in found) == [0, 1, 1, 1]
    assert all(re.fullmatch(r"rest|period 1, amplitude [\d.]+", name) for name, _, _ in found)
    assert text(page, "#basins-legend").count("period 1") == 3
    known = (
        "[...saltusPage.basins.labels.entries()].filter(([, label]) => label >= "
        "0).filter((_, i) => i % 29 === 0)"
    )
    cells = page.evaluate(
        f"{known}.map(([cell, label]) => (({{x, y}}) => [x, y, "
        "label])(saltusPage.basins.centre(cell)))"
    )
    assert len(cells) > 15
    assert len({label for _, _, label in cells}) > 2
    for angle, velocity, label in cells:
        motion = saltus.simulate(CELL, theta=angle, velocity=velocity, periods=100)
        ends = [
            max(abs(motion.theta - section[0]), abs(motion.velocity - section[1]))
            for _, _, section in found
        ]
        assert int(np.argmin(ends)) == label
        assert min(ends) < 1e-3


def test_a_sweep_up_and_down_is_that_of_frequency_sweep(page):
    values = np.linspace(0.9, 1.1, 5)
    settings = {"from": "0.9", "to": "1.1", "values": "5", "periods at each": "60"}
    for name, value in settings.items():
        page.evaluate(f"""(() => {{ const i = [...document.querySelectorAll('.setting')]
            .find((l) => l.textContent.startsWith({name!r})).querySelector('input');
            i.value = '{value}'; i.dispatchEvent(new Event('change')); }})()""")
    page.click("#sweep-controls .run")
    result = page.evaluate(
        """new Promise((done) => { const look = () => saltusPage.sweep.result.done
    ? done(saltusPage.sweep.result) : setTimeout(look, 20); look(); })"""
    )
    swept = saltus.frequency_sweep(CELL, values, periods=60, stop_early=False, theta=0.4, tol=1e-12)
    for way in ("up", "down"):
        ours = sorted(result[way], key=lambda point: point["value"])
        assert [point["value"] for point in ours] == pytest.approx(values, abs=1e-15)
        theirs = swept["amplitude"].sel(direction=way).values
        assert [point["amplitude"] for point in ours] == pytest.approx(theirs, rel=1e-6)
