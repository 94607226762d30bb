"""Headless Chromium, controlled over two pipes: a page as PDF or picture.

The DevTools protocol over pipes needs no port and no library: JSON objects, each ended
by a zero byte, on the file descriptors 3 (to the browser) and 4 (from it). Source:
Chromium, headless mode and `--remote-debugging-pipe`.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import signal
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from typing import Any, Self

from fieldcal.core.errors import InputError

NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
    *("chrome", "microsoft-edge", "brave-browser"),
)
"""Programs that understand the protocol, in the order they are tried."""

OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking", "--disable-sync"),
    *("--disable-component-update", "--disable-extensions", "--hide-scrollbars"),
    *("--remote-debugging-pipe", "about:blank"),
)

TIMEOUT_S = 60.0
"""Longest wait for an answer, s of the host's clock."""

PAGE_WIDTH_PX = 1200
"""Width of a picture, CSS pixels."""

_FREE = 10
"""Lowest file descriptor that does not interfere with 3 and 4."""


def find_browser() -> str | None:
    """Path of a browser that can be used, None if there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """A browser with one page; a context manager.

    Attributes
    ----------
    events : what the page reported, (method, parameters) in order

    Raises
    ------
    InputError
        If there is none, or it does not answer.

    """

    def __init__(self) -> None:
        program = find_browser()
        if program is None:
            raise InputError(
                "no Chromium was found, which makes PDF and PNG: install chromium, or"
                " open the report in any browser and print it from there"
            )
        self.events: list[tuple[str, dict[str, Any]]] = []
        self._next = 0
        self._rest = b""
        self._session: str | None = None
        self._folder = tempfile.TemporaryDirectory(
            prefix="fieldcal-", ignore_cleanup_errors=True
        )
        self._pid, self._to, self._from = _start(
            [program, f"--user-data-dir={self._folder.name}", *OPTIONS]
        )
        try:
            target = self.call("Target.createTarget", url="about:blank")["targetId"]
            opened = self.call("Target.attachToTarget", targetId=target, flatten=True)
            self._session = opened["sessionId"]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self.call(f"{domain}.enable")
        except BaseException:
            self.close()
            raise

    def open(self, page: Path) -> None:
        """Open a file and wait until it is loaded."""
        self.events.clear()
        self.call("Page.navigate", url=page.resolve().as_uri())
        while not any(method == "Page.loadEventFired" for method, _ in self.events):
            self._read_messages()

    def pdf(self) -> bytes:
        """The page on A4 paper."""
        size = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": True}
        made = self.call("Page.printToPDF", printBackground=True, **size)
        return base64.b64decode(made["data"])

    def png(self, width: int = PAGE_WIDTH_PX) -> bytes:
        """The whole page as a picture."""
        self.resize(width, 900)
        height = self.value("document.documentElement.scrollHeight")
        self.resize(width, int(height))
        made = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        return base64.b64decode(made["data"])

    def resize(self, width: int, height: int, mobile: bool = False) -> None:
        """Give the page another window, CSS pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=2 if mobile else 1,
            mobile=mobile,
        )
        # two frames, so that what listens to the size has drawn
        self.value("new Promise(r => requestAnimationFrame(() => setTimeout(r, 50)))")

    def value(self, expression: str) -> Any:
        """Evaluate a JavaScript expression on the page; promises are awaited."""
        found = self.call(
            "Runtime.evaluate",
            expression=expression,
            returnByValue=True,
            awaitPromise=True,
        )
        if "exceptionDetails" in found:
            raise InputError(f"the page failed: {found['exceptionDetails']}")
        return found["result"].get("value")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and wait for its answer."""
        self._next += 1
        message: dict[str, Any] = {
            "id": self._next,
            "method": method,
            "params": parameters,
        }
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read_messages()
            if answer.get("id") == self._next:
                if "error" in answer:
                    raise InputError(f"Chromium: {method}: {answer['error']}")
                result: dict[str, Any] = answer["result"]
                return result

    def _read_messages(self) -> dict[str, Any]:
        """Read the next message; events are kept."""
        until = monotonic() + TIMEOUT_S
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._from], [], [], until - monotonic())
            data = os.read(self._from, 1 << 20) if ready else b""
            if not data:
                raise InputError(
                    "Chromium did not answer; open the report in any browser and print"
                    " it from there"
                )
            self._rest += data
        raw, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(raw)
        if "method" in message:
            self.events.append((message["method"], message.get("params", {})))
        return message

    def close(self) -> None:
        """End the browser."""
        for descriptor in (self._to, self._from):
            os.close(descriptor)
        os.killpg(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _start(command: Sequence[str]) -> tuple[int, int, int]:
    """Start a program with pipes on 3 and 4: process, our end to it, our end from it.

    It gets a group of its own, so that its helpers end with it.
    """
    theirs_in, ours_out = os.pipe()
    ours_in, theirs_out = os.pipe()
    high = [
        fcntl.fcntl(d, fcntl.F_DUPFD_CLOEXEC, _FREE) for d in (theirs_in, theirs_out)
    ]
    silent = os.open(os.devnull, os.O_RDWR)
    actions = [
        (os.POSIX_SPAWN_DUP2, high[0], 3),
        (os.POSIX_SPAWN_DUP2, high[1], 4),
        *((os.POSIX_SPAWN_DUP2, silent, d) for d in (0, 1, 2)),
    ]
    pid = os.posix_spawn(
        command[0], list(command), os.environ, file_actions=actions, setpgroup=0
    )
    for descriptor in (theirs_in, theirs_out, silent, *high):
        os.close(descriptor)
    return pid, ours_out, ours_in
