"""Who turns the device: nobody we can tell (a person), or the virtual device itself."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, Self

from fieldcal.errors import DeviceError
from fieldcal.positions import Position
from fieldcal.sim_device.remote import Remote


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

    Attributes
    ----------
    port : path of its pseudo-terminal

    Raises
    ------
    DeviceError
        If it does not start, or does not answer.

    """

    def __init__(self, options: Sequence[str]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fieldcal-")
        self._truth = Path(self._folder.name) / "truth.json"
        command = [sys.executable, "-m", "fieldcal", "sim", *options]
        self._process = subprocess.Popen(
            [*command, "--once", "--truth", str(self._truth)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            self.port = self._line()
            self._remote = Remote(self._line())
        except BaseException:
            self.close()
            raise

    def _line(self) -> str:
        out = self._process.stdout
        line = out.readline().strip() if out else ""
        if not line:
            _, said = self._process.communicate()
            last = said.strip().splitlines()[-1:] or ["it said nothing"]
            raise DeviceError(f"the virtual device did not start: {last[0]}")
        return line

    @property
    def truth(self) -> Mapping[str, Any]:
        """What it conceals."""
        truth: Mapping[str, Any] = json.loads(self._truth.read_text(encoding="utf-8"))
        return truth

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request to the control socket and return the reply."""
        return self._remote.ask(**request)

    def turn(self, position: Position) -> None:
        """Begin to turn to a position."""
        if position.degrees is not None:
            alpha, beta = position.degrees
            self.ask(turn={"alpha_deg": alpha, "beta_deg": beta})

    def close(self) -> None:
        """End the process; safe to call twice."""
        if hasattr(self, "_remote"):
            self._remote.close()
        self._process.terminate()
        try:
            self._process.communicate(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
