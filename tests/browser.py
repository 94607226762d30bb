"""A browser without a window that waits for what a page is to come to."""

from __future__ import annotations

from time import monotonic, sleep
from typing import Any

from processes import HANGS

from fieldcal.report.browser import Browser


class Screen(Browser):
    """One page of a browser, as a person with a phone or tablet has it."""

    def go(self, address: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=address)

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
        self.resize(width, height, mobile=True)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
