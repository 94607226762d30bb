"""Who turns the device: nobody we can tell (a person), or the virtual device itself."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from typing import Any, Protocol, Self

from fieldcal.errors import DeviceError
from fieldcal.positions import Position


class Mover(Protocol):
    """Something that can turn the device."""

    def turn(self, position: Position) -> None:
        """Begin to turn; return at once."""


class Nobody:
    """A person turns the device, or whatever else reads the instructions."""

    def turn(self, position: Position) -> None:
        """Leave it to the person."""


class VirtualDevice:
    """A virtual device in a process of its own, turned through its control socket.

    Parameters
    ----------
    options : of ``fieldcal sim``

    Raises
    ------
    DeviceError
        If it does not start, or does not answer.

    """

    def __init__(self, options: Sequence[str]) -> None:
        command = [sys.executable, "-m", "fieldcal", "sim", *options]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
        self.port = self._line()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.settimeout(10.0)
            self._socket.connect(self._line())
        except OSError as error:
            self.close()
            raise DeviceError(
                f"the virtual device cannot be reached: {error}"
            ) from error
        self._replies = self._socket.makefile("r", encoding="utf-8")

    def _line(self) -> str:
        assert self._process.stdout is not None  # noqa: S101
        line = self._process.stdout.readline().strip()
        if not line:
            _, said = self._process.communicate()
            last = said.strip().splitlines()[-1:] or ["it said nothing"]
            raise DeviceError(f"the virtual device did not start: {last[0]}")
        return line

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request to the control socket and return the reply."""
        try:
            self._socket.sendall(json.dumps(request).encode() + b"\n")
            reply: dict[str, Any] = json.loads(self._replies.readline() or "{}")
        except (OSError, ValueError) as error:
            raise DeviceError(
                f"the virtual device does not answer: {error}; start it again"
            ) from error
        if "error" in reply or not reply:
            raise DeviceError(f"the virtual device refuses: {reply.get('error', '')}")
        return reply

    def turn(self, position: Position) -> None:
        """Begin to turn to a position."""
        if position.degrees is not None:
            alpha, beta = position.degrees
            self.ask(turn={"alpha_deg": alpha, "beta_deg": beta})

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._process.terminate()
        try:
            self._process.communicate(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        if hasattr(self, "_socket"):
            self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
