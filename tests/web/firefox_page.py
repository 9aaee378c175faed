"""A page in a Firefox without a window, by its Marionette protocol: the second engine in which
pages are tested.
"""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
from pathlib import Path
from typing import Any

FIREFOX = next(filter(None, map(shutil.which, ("firefox-esr", "firefox"))), None)


class FirefoxPage:
    """One page, open from `__init__` to `close`."""

    def __init__(self, browser: str, profile: Path) -> None:
        profile.mkdir(parents=True, exist_ok=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        names = {"marionette.port": port, "browser.shell.checkDefaultBrowser": False}
        settings = names | {"datareporting.policy.dataSubmissionEnabled": False}
        lines = [
            f"user_pref({json.dumps(name)}, {json.dumps(value)});"
            for name, value in settings.items()
        ]
        (profile / "user.js").write_text("\n".join(lines) + "\n")
        command = [browser, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert self._process.stdout
        assert any(b"Listening on port" in line for line in self._process.stdout), (
            "the browser has ended"
        )
        self._socket = socket.create_connection(("127.0.0.1", port))
        self._buffer, self._number = b"", 0
        self._message()  # its greeting
        self("WebDriver:NewSession")
        self("WebDriver:SetTimeouts", script=120_000, pageLoad=60_000)

    def _message(self) -> Any:
        """The next message: its length in bytes, a colon, and JSON."""
        while b":" not in self._buffer:
            self._receive()
        size, _, self._buffer = self._buffer.partition(b":")
        while len(self._buffer) < int(size):
            self._receive()
        content, self._buffer = self._buffer[: int(size)], self._buffer[int(size) :]
        return json.loads(content)

    def _receive(self) -> None:
        part = self._socket.recv(1 << 20)
        assert part, "the browser has ended"
        self._buffer += part

    def __call__(self, command: str, **parameters: Any) -> Any:
        """Send a command and return its result."""
        self._number += 1
        content = json.dumps([0, self._number, command, parameters]).encode()
        self._socket.sendall(b"%d:%b" % (len(content), content))
        _, _, error, result = self._message()
        assert error is None, error
        return result

    def open(self, path: Path, ready: str) -> None:
        """Load a file, and wait until a promise of JavaScript is kept."""
        self("WebDriver:Navigate", url=path.as_uri())
        self.evaluate(ready)

    def evaluate(self, script: str) -> Any:
        """The value of an expression of JavaScript, or what its promise brings."""
        told = "(value) => done({ value }), (error) => done({ error: String(error) })"
        body = f"const done = arguments[0]; Promise.resolve({script}).then({told});"
        result = self("WebDriver:ExecuteAsyncScript", script=body, args=[], sandbox=None)["value"]
        assert "error" not in result, result["error"]
        return result.get("value")

    def close(self) -> None:
        """End the browser."""
        self("Marionette:Quit", flags=["eForceQuit"])
        self._process.wait(timeout=60)
        self._socket.close()
