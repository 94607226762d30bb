"""A person moves the virtual device by keys, and sees where it is."""

from __future__ import annotations

import os
import sys
import termios
import tty
from contextlib import suppress
from typing import IO, Any, Self

import numpy as np

from fieldcal.sim_device.stream import DeviceStream

HELP = "←→ turn alpha   ↑↓ turn beta   h home   b bump   q quit"

STEPS = {
    b"\x1b[D": (-1.0, 0.0),
    b"\x1b[C": (1.0, 0.0),
    b"\x1b[A": (0.0, 1.0),
    b"\x1b[B": (0.0, -1.0),
}
"""What the arrow keys send: left, right, up, down."""

EVERY_S = 0.2


class SteeringKeys:
    """Turns keys of a terminal into orders; a context that restores the terminal.

    Parameters
    ----------
    stream : of the device that is moved
    steps : of alpha and beta, deg
    keyboard, screen : a terminal, and where the line about the device goes, standard
        error if it is not said

    """

    def __init__(
        self,
        stream: DeviceStream,
        steps: tuple[float, float],
        keyboard: int = 0,
        screen: IO[str] | None = None,
    ) -> None:
        self._stream, self._steps = stream, steps
        self._keyboard = keyboard
        # where what is written is only shown, the line would not be written over
        self._screen: IO[str] = getattr(
            screen or sys.stderr, "rich_proxied_file", screen or sys.stderr
        )
        self._shown_at = -np.inf
        self._before: list[Any] | None = None

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(self._keyboard)
        tty.setcbreak(self._keyboard)
        self._screen.write(HELP + "\n")
        return self

    def __exit__(self, *exc: object) -> None:
        with suppress(termios.error, OSError):  # the terminal is gone
            if self._before is not None:
                termios.tcsetattr(self._keyboard, termios.TCSADRAIN, self._before)
            self._screen.write("\n")

    def watched(self) -> tuple[list[int], list[int]]:
        """Files to watch for reading and for writing."""
        return [self._keyboard], []

    def serve(self) -> None:
        """Carry out the keys that were hit, and show where the device is."""
        import select

        if select.select([self._keyboard], [], [], 0)[0]:
            self._hit(os.read(self._keyboard, 64))
        device = self._stream.device
        if abs(device.time - self._shown_at) >= EVERY_S:
            self._shown_at = device.time
            self._screen.write("\r" + self._line() + "\x1b[K")
            self._screen.flush()

    def _hit(self, keys: bytes) -> None:
        device = self._stream.device
        while keys:
            arrow = keys[:3]
            if arrow in STEPS:
                along = np.deg2rad(np.multiply(STEPS[arrow], self._steps))
                alpha, beta = device.angles[:2] + along
                device.turn(float(alpha), float(beta), gamma=device.angles[2])
                keys = keys[3:]
                continue
            if keys[:1] == b"h":
                device.turn(0.0, 0.0)
            elif keys[:1] == b"b":
                device.bump()
            elif keys[:1] == b"q":
                self._stream.stop()
            keys = keys[1:]

    def _line(self) -> str:
        device = self._stream.device
        alpha, beta, gamma = np.rad2deg(device.angles)
        moving = "turning to" if device.time < device.busy_until else "at"
        host = "" if self._stream.link.attached() else "   nobody listens"
        third = f", γ = {gamma:g}°" if gamma else ""
        where = f"α = {alpha:g}°, β = {beta:g}°{third}"
        return f"{device.time:8.1f} s   {moving} {where}{host}"
