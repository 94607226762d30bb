"""Single keys of a terminal, without waiting for one.

    Enter, space   confirm      r   repeat      s   skip      q   stop

While it is open the terminal passes keys on at once and does not show them; Ctrl-C
stays what it is. What is no terminal has no keys.
"""

from __future__ import annotations

import os
import select
import sys
from typing import Any, Self

from fieldcal.run.operator.protocol import Wish

KEYS: dict[str, Wish] = {
    "\r": "confirm",
    "\n": "confirm",
    " ": "confirm",
    "r": "repeat",
    "s": "skip",
    "q": "stop",
}

HELP = "Enter confirm · r repeat · s skip · q stop"


class Keyboard:
    """Keys of the terminal that standard input is; a context manager."""

    def __init__(self) -> None:
        terminal = sys.stdin  # None where there is no console at all
        usable = terminal is not None and not terminal.closed and terminal.isatty()
        self._file = terminal.fileno() if usable else -1
        self._before: list[Any] = []

    @property
    def there(self) -> bool:
        """Whether anybody can press a key."""
        return self._file >= 0

    def __enter__(self) -> Self:
        if self.there:
            import termios
            import tty

            self._before = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)
        return self

    def __exit__(self, *exc: object) -> None:
        if self._before:
            import termios

            termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def pressed(self) -> Wish | None:
        """What was asked for by the keys pressed since the last call: the last one."""
        wish: Wish | None = None
        while self.there and select.select([self._file], [], [], 0)[0]:
            data = os.read(self._file, 64)
            if not data:
                self._file = -1  # the terminal is gone
            for character in data.decode(errors="replace").lower():
                wish = KEYS.get(character, wish)
        return wish

    def forget(self) -> None:
        """Forget keys pressed by now: they were meant for what is over."""
        self.pressed()
