"""A page that computes, open in a Chromium without a window: what its tests do to it, and what they
read of it.
"""

from __future__ import annotations

import json
import shutil
from typing import Any

from browser_page import BrowserPage

NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
)
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
SETTLED = (
    "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => "
    "setTimeout(done, 0))))"
)
READY = (
    "new Promise((done) => { const look = () => (globalThis.saltusPage ? done() : "
    "requestAnimationFrame(look)); look(); })"
)


class ComputingPage(BrowserPage):
    """A page that has unpacked itself once it is open; `requests` are the addresses that it has
    asked for.
    """

    def __init__(self, *arguments: Any) -> None:
        self.requests: list[str] = []
        super().__init__(*arguments)
        self("Network.enable")

    def _receive(self) -> dict[str, Any]:
        message = super()._receive()
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(message["params"]["request"]["url"])
        return message

    def go(self, address: str) -> None:
        super().go(address)
        if address != "about:blank":
            self.evaluate(READY)


def state(page: BrowserPage) -> dict[str, Any]:
    """What the page remembers, once it has drawn what it was last told."""
    page.evaluate(SETTLED)
    return page.evaluate("saltusPage.store.state")


def text(page: BrowserPage, selector: str) -> str:
    """The text of an element."""
    return page.evaluate(f"document.querySelector({json.dumps(selector)}).textContent")


def field(path: str, part: str = ".value") -> str:
    """The selector of a part of the field of a number."""
    return f'[data-path="{path}"] {part}'


def place(page: BrowserPage, view: str, x: float, y: float) -> tuple[float, float]:
    """Where a point of a view's plane stands in the window."""
    script = """(() => { const plot = saltusPage.plotOf(%s); plot.top.scrollIntoView({block: "center"}); plot.drawNow();
    const painter = plot.painter(plot.top.getContext("2d"), {}); const box = plot.top.getBoundingClientRect();
    return [box.x + painter.x(%r), box.y + painter.y(%r)]; })()"""
    return tuple(page.evaluate(script % (json.dumps(view), x, y)))


def click_at(page: BrowserPage, view: str, x: float, y: float) -> None:
    """Click at a point of a view's plane."""
    left, top = place(page, view, x, y)
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        page.point(kind, left, top)


def saved(page: BrowserPage, button: str) -> str:
    """The text of the file that a button saves."""
    script = """(() => { let kept = null; const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => { kept = blob; return make(blob); };
    document.querySelector(%s).click();
    URL.createObjectURL = make; return kept.text(); })()"""
    return page.evaluate(script % json.dumps(button))
