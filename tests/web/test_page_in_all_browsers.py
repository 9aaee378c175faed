"""The same page in node, Chromium and Firefox: every number of its motions is the same, to the last
bit.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from computing_page import BROWSER, READY, ComputingPage
from firefox_page import FIREFOX, FirefoxPage
from test_agreement import KINDS, NODE, as_start, block, cell, in_node, length_of, page_parts

import saltus

AT = [1.0, 5.0]
FOLLOWED = """(({ asked, at }) => { const { engine } = saltusPage.session;
  return asked.map(({ values, start, duration, periods }) => {
  const motion = engine.simulate(engine.system(values), start, duration ?? 0, periods === undefined ? {} : { periods });
  const events = motion.events.map(({ time, kind, contact, before, after }) => [time, kind, contact, before, after]);
  return { stop: motion.stop, end: [...motion.end], last: motion.time.last, events, states: at.map((t) => [...motion.state(t)]) };
}); })"""
COUNTED = """new Promise((done) => { const { basins } = saltusPage;
  const look = () => (basins.counted > 90 ? done(basins.refusal) : setTimeout(look, 20)); look(); })"""


def check_same_bits(kinds, each, folder, browsers):
    """Random systems of each kind, in node and in browsers."""
    rng = np.random.default_rng(11)
    counted = 0
    for kind in kinds:
        made = [kind(rng) for _ in range(each)]
        asked = [
            {"values": system.parameters, "start": as_start(system, start), **length_of(system)}
            for system, start in made
        ]
        wasm, description = page_parts(made[0][0])
        (known,) = in_node(
            [
                {
                    "wasm": wasm,
                    "description": description,
                    "motions": [one | {"at": AT} for one in asked],
                }
            ],
            folder,
        )
        file = saltus.page(made[0][0], path=folder / "page.html", **made[0][1])
        for browser in browsers:
            (
                browser.open(file, READY)
                if isinstance(browser, FirefoxPage)
                else browser.open(file, 1200)
            )
            found = browser.evaluate(f"{FOLLOWED}({json.dumps({'asked': asked, 'at': AT})})")
            for one, other in zip(known, found, strict=True):
                assert {name: one[name] for name in other} == other, kind
                counted += len(other["events"])
    return counted


@pytest.mark.skipif(
    NODE is None or BROWSER is None, reason="node or a Chromium is not installed here"
)
def test_motions_in_chromium_are_those_in_node_to_the_last_bit(tmp_path):
    page = ComputingPage(str(BROWSER), tmp_path / "profile")
    try:
        assert check_same_bits((cell, block), 2, tmp_path, [page]) > 40
    finally:
        page.close()


@pytest.mark.thorough
@pytest.mark.skipif(
    NODE is None or BROWSER is None or FIREFOX is None,
    reason="node, a Chromium or Firefox is not installed here",
)
def test_motions_of_all_models_are_the_same_in_node_chromium_and_firefox_to_the_last_bit(tmp_path):
    chromium, firefox = (
        ComputingPage(str(BROWSER), tmp_path / "profile"),
        FirefoxPage(str(FIREFOX), tmp_path / "other"),
    )
    try:
        assert check_same_bits(KINDS, 5, tmp_path, [chromium, firefox]) > 2000
    finally:
        chromium.close()
        firefox.close()


@pytest.mark.thorough
@pytest.mark.skipif(FIREFOX is None, reason="Firefox is not installed here")
def test_a_page_works_in_firefox_from_disk(tmp_path):
    system, start = cell(np.random.default_rng(5))
    motion = saltus.simulate(system, **start, periods=20)
    firefox = FirefoxPage(str(FIREFOX), tmp_path / "profile")
    try:
        firefox.open(saltus.page(system, path=tmp_path / "page.html", **start), READY)
        assert firefox.evaluate("document.querySelector('#notice').hidden")
        said = firefox.evaluate("document.querySelector('#summary').textContent")
        assert said.startswith(f"{len(motion.impacts)} impacts up to time {motion.time:.6g}.")
        typed = """(() => { const input = document.querySelector('[data-path="model.damping"] .value'); input.value = '0.25';
            input.dispatchEvent(new Event('change')); return saltusPage.store.state.values['model.damping']; })()"""
        assert firefox.evaluate(typed) == 0.25
        firefox.evaluate("saltusPage.toggleBasins()")
        assert firefox.evaluate(COUNTED) == ""  # workers run from a file as well
        firefox.evaluate("saltusPage.toggleBasins()")
    finally:
        firefox.close()
