"""A browser without a window, led by its own pipe (the DevTools protocol)."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from processes import HANGS

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")

OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"),
    *("--no-proxy-server", "--disable-background-networking", "--no-first-run"),
)


class Browser:
    """One page of a browser.

    Parameters
    ----------
    read, write : ends of its pipes

    """

    def __init__(self, read: int, write: int) -> None:
        self._read, self._write, self._left, self._count = read, write, b"", 0
        self._session = ""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        there = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = there["sessionId"]
        self.ask("Page.enable")
        self.ask("Network.enable")

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method}
        message["params"] = params
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._left:
            data = os.read(self._read, 65536)
            assert data, "the browser is gone"
            self._left += data
        line, _, self._left = self._left.partition(b"\0")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def open(self, address: str) -> None:
        """Go to a page."""
        self.ask("Page.navigate", url=address)

    def value(self, script: str) -> Any:
        """What a line of script comes to."""
        result = self.ask("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def until(self, script: str, wanted: Any = True) -> None:
        """Wait until a line of script comes to what is wanted."""
        end = monotonic() + HANGS
        while (found := self.value(script)) != wanted:
            assert monotonic() < end, f"{script} is {found!r}, not {wanted!r}"
            sleep(0.02)

    def text(self, name: str) -> str:
        """Text of an element, by its id."""
        return str(self.value(f"document.getElementById({name!r})?.textContent"))

    def size(self, width: int, height: int, dark: bool = False) -> None:
        """Be a screen of some size, px."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=True,
        )  # fmt: skip
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A browser with nothing in its memory, which it keeps in a folder."""
    theirs_in, ours_out = os.pipe()
    ours_in, theirs_out = os.pipe()

    def as_three_and_four() -> None:
        low = [os.dup(theirs_in), os.dup(theirs_out)]
        os.dup2(low[0], 3)
        os.dup2(low[1], 4)

    with subprocess.Popen(
        [str(CHROMIUM), *OPTIONS, f"--user-data-dir={folder}"],
        preexec_fn=as_three_and_four, close_fds=False,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        os.close(theirs_in)
        os.close(theirs_out)
        try:
            yield Browser(ours_in, ours_out)
        finally:
            process.terminate()
            os.close(ours_out)
            os.close(ours_in)
