"""Single keys of a terminal, without waiting for one.

    Enter, space   confirm      r   repeat      s   skip      q   stop

While the keyboard is open, the terminal passes keys on at once and does not show them.
Ctrl-C interrupts as usual. Ctrl-Z, Ctrl-S and Ctrl-backslash have no effect: they would
suspend or kill the run without notice, and samples would be lost. Pasted text is no
key, as far as the terminal marks it. Input that is no terminal has no keys.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import select
import sys
from contextlib import suppress
from typing import Any, Protocol, Self

from fieldcal.run.operator.protocol import Phase, Wish

KEYS: dict[str, Wish] = {
    "\r": "confirm",
    "\n": "confirm",
    " ": "confirm",
    "r": "repeat",
    "s": "skip",
    "q": "stop",
}

HELP: dict[Phase, str] = {
    "turning": "keys: Enter confirm · r repeat the last one · s skip · q stop",
    "averaging": "keys: r begin again · s skip · q stop",
    "taken": "keys: Ctrl-C stop",
    "silent": "keys: q stop",
}
"""What keys do in each phase; a key that would do nothing is not named."""

OTHER_KEYS = re.compile("\x1b(?:\\[[0-?]*[ -/]*[@-~]|O.|.)?", re.DOTALL)
"""Sequences of arrows, function keys and letters with Alt, which contain letters: F2
ends in a Q, F4 in an S."""

UNFINISHED = re.compile("\x1b(?:\\[[0-?]*[ -/]*|O)?$")
"""Beginning of such a sequence whose end has not arrived: a slow link may divide it."""

MARK_PASTES, LEAVE_PASTES = "\x1b[?2004h", "\x1b[?2004l"
"""Orders to a terminal to mark text that is pasted, and no longer to do so."""

PASTE_BEGINS, PASTE_ENDS = "\x1b[200~", "\x1b[201~"
"""Marks around pasted text. Source: xterm control sequences, bracketed paste mode."""

SHORT_HELP: dict[Phase, str] = {
    "turning": "Enter ok · r last · s skip · q stop",
    "averaging": "r again · s skip · q stop",
    "taken": "Ctrl-C stop",
    "silent": "q stop",
}
"""The same for a screen of 40 characters."""


FUNCTION = ("\x00", "\xe0")
"""Prefixes of keys without a letter on Windows; the code that follows may be a letter,
such as Q for Page Down."""


class Keyboard:
    """Keys of the terminal that standard input is; a context manager."""

    def __init__(self) -> None:
        terminal = sys.stdin  # None where there is no console at all
        usable = terminal is not None and not terminal.closed and terminal.isatty()
        self._keys: Keys | None = None
        self._stop, self._skip, self._unfinished = False, False, ""
        self._pasting = False
        if usable:
            windows = importlib.util.find_spec("termios") is None
            self._keys = WindowsKeys() if windows else PosixKeys(terminal.fileno())

    @property
    def has_keys(self) -> bool:
        """Whether anybody can press a key."""
        return self._keys is not None

    def __enter__(self) -> Self:
        if self._keys:
            self._keys.open()
        return self

    def __exit__(self, *exc: object) -> None:
        if self._keys:
            self._keys.close()

    def pressed(self) -> Wish | None:
        """Wish of the keys since the last call: "stop" if any, else the last.

        Of two presses of s the second is the wish of the next call: it answers the
        question that the first one asks, however soon it follows.
        """
        stop, skip = self._stop, self._skip
        self._stop = self._skip = False
        text = self._keys.read() if self._keys else ""
        if text is None:
            self._keys = None  # the terminal is gone
        typed = self._without_pasted(self._with_unfinished(text or ""))
        letters = OTHER_KEYS.sub("", typed).lower()
        wishes = [KEYS[key] for key in letters if key in KEYS]
        if stop or "stop" in wishes:
            return "stop"
        self._skip = wishes[-2:] == ["skip", "skip"]
        kept: Wish | None = "skip" if skip else None
        return wishes[-1] if wishes else kept

    def _with_unfinished(self, text: str) -> str:
        """Keys behind the beginning of a sequence, without one at their own end.

        Escape alone is a key, and a letter pressed later is one for itself.
        """
        if self._unfinished == "\x1b" and text[:1] not in ("", "[", "O"):
            self._unfinished = ""
        text, self._unfinished = self._unfinished + text, ""
        if begun := UNFINISHED.search(text):
            text, self._unfinished = text[: begun.start()], begun.group()
        return text

    def _without_pasted(self, text: str) -> str:
        """Keys without pasted text, whose letters nobody pressed."""
        typed = ""
        while text:
            mark = PASTE_ENDS if self._pasting else PASTE_BEGINS
            before, found, text = text.partition(mark)
            typed += "" if self._pasting else before
            self._pasting ^= bool(found)
        return typed

    def forget(self) -> None:
        """Discard keys pressed so far, meant for an earlier step; a stop is for all."""
        self._stop, self._skip = self.pressed() == "stop", False


def forget_typed_lines() -> None:
    """Discard what was typed on the terminal before a question that a line answers."""
    if importlib.util.find_spec("termios") is not None and sys.stdin.isatty():
        import termios

        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)


class Keys(Protocol):
    """A terminal's keys, one by one."""

    def open(self) -> None:
        """Switch the terminal to pass keys on at once."""

    def close(self) -> None:
        """Restore the terminal."""

    def read(self) -> str | None:
        """Keys pressed since the last call; None if the terminal is gone."""


class PosixKeys:
    """Keys of a file descriptor."""

    def __init__(self, file: int) -> None:
        self._file = file
        self._before: list[Any] = []

    def open(self) -> None:
        """Switch the terminal to pass keys on at once."""
        import termios
        import tty

        self._before = termios.tcgetattr(self._file)
        tty.setcbreak(self._file)
        mode = termios.tcgetattr(self._file)
        mode[tty.IFLAG] &= ~termios.IXON
        no_key = os.fpathconf(self._file, "PC_VDISABLE")
        mode[tty.CC][termios.VSUSP] = mode[tty.CC][termios.VQUIT] = bytes([no_key])
        termios.tcsetattr(self._file, termios.TCSADRAIN, mode)

    def close(self) -> None:
        """Restore the terminal."""
        import termios

        if self._before:
            with suppress(termios.error):  # the terminal is gone
                termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def read(self) -> str | None:
        """Keys pressed since the last call; None if the terminal is gone."""
        text = ""
        while select.select([self._file], [], [], 0)[0]:
            try:
                data = os.read(self._file, 64)
            except OSError:
                return None
            if not data:
                return None
            text += data.decode(errors="replace")
        return text


class WindowsKeys:
    """Letters of the console that the process has; its other keys are left out."""

    def __init__(self) -> None:
        self._console = importlib.import_module("msvcrt")

    def open(self) -> None:
        """Nothing to do: keys come at once anyway."""

    def close(self) -> None:
        """Nothing to restore."""

    def read(self) -> str | None:
        """Keys pressed since the last call."""
        text = ""
        while self._console.kbhit():
            key = self._console.getwch()
            if key in FUNCTION:
                self._console.getwch()
            else:
                text += key
        return text
