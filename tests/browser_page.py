"""A page in a Chromium without a window, by its DevTools protocol over a pipe: the tests need
nothing else for it.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any

OPTIONS = [
    "--headless",
    "--disable-gpu",
    "--no-first-run",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
    "--mute-audio",
]


class BrowserPage:
    """One page, open from `__init__` to `close`; `errors` are its scripts' exceptions and what it
    could not load.
    """

    def __init__(self, browser: str, profile: Path) -> None:
        (read, self._commands), (self._answers, write) = os.pipe(), os.pipe()
        # out of the way of 3 and 4
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (read, write)]
        actions = [
            (os.POSIX_SPAWN_DUP2, end, place) for end, place in zip(ends, (3, 4), strict=True)
        ]
        actions += [(os.POSIX_SPAWN_OPEN, place, os.devnull, os.O_WRONLY, 0) for place in (1, 2)]
        options = [
            *OPTIONS,
            f"--user-data-dir={profile}",
            *(["--no-sandbox"] if os.geteuid() == 0 else []),
        ]
        self._process = os.posix_spawn(
            browser, [browser, *options], os.environ, file_actions=actions
        )
        for end in (read, write, *ends):
            os.close(end)
        self._number, self._session, self._buffer = 0, None, b""
        self.errors: list[str] = []
        self._loaded = False
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self(f"{domain}.enable")

    def close(self) -> None:
        """End the browser."""
        self._session = None
        os.write(self._commands, json.dumps({"id": 0, "method": "Browser.close"}).encode() + b"\0")
        os.waitpid(self._process, 0)
        os.close(self._commands)
        os.close(self._answers)

    def __call__(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command of the protocol and return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._commands, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return answer["result"]

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            part = os.read(self._answers, 1 << 20)
            assert part, "the browser has ended"
            self._buffer += part
        line, _, self._buffer = self._buffer.partition(b"\0")
        message = json.loads(line)
        if message.get("method") == "Runtime.exceptionThrown":
            self.errors.append(str(message["params"]["exceptionDetails"]))
        elif message.get("method") == "Log.entryAdded":
            self.errors.append(str(message["params"]["entry"]))
        elif message.get("method") == "Page.loadEventFired":
            self._loaded = True
        return message

    def open(self, path: Path, width: int, height: int = 800) -> None:
        """Load a file into a window of this size, in pixels."""
        self(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.go(path.as_uri())

    def go(self, address: str) -> None:
        """Load an address into the window as it is."""
        self._loaded = False
        self("Page.navigate", url=address)
        while not self._loaded:
            self._receive()

    def evaluate(self, script: str) -> Any:
        """The value of an expression of JavaScript."""
        result = self("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def press(self, key: str, code: int) -> None:
        """Press and release a key by its name and its code."""
        text = {"text": "\r"} if key == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            self(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                code=key,
                windowsVirtualKeyCode=code,
                **(text if kind == "keyDown" else {}),
            )

    def click(self, selector: str) -> None:
        """Click in the middle of an element, as a pointer does."""
        place = (
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
            f"e.scrollIntoView({{block: 'center'}}); "
        )
        place += (
            "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height "
            "/ 2]; })()"
        )
        x, y = self.evaluate(place)
        for kind in ("mousePressed", "mouseReleased"):
            self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def point(self, kind: str, x: float, y: float, **more: Any) -> None:
        """An event of the mouse at a place of the window: `mouseMoved`, `mousePressed`,
        `mouseReleased` or `mouseWheel`.
        """
        pressed = (
            {"button": "left", "clickCount": 1} if kind in ("mousePressed", "mouseReleased") else {}
        )
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, **pressed, **more)

    def type(self, selector: str, text: str) -> None:
        """Put a text into a field and press Enter, as a reader does."""
        self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.focus(); "
            f"e.select(); }})()"
        )
        self("Input.insertText", text=text)
        self.press("Enter", 13)
