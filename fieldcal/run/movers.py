"""Movers, which turn the device: a person, or the virtual device itself."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, Self

from fieldcal.core.errors import DeviceError, InputError, MoverGone
from fieldcal.core.positions import Position
from fieldcal.sim_device.remote import RemoteDevice


class Mover(Protocol):
    """Something that can turn the device."""

    def turn(self, position: Position, number: int = 0) -> None:
        """Begin to turn to a position, numbered from 0; return at once."""

    def busy(self) -> bool:
        """Whether it is still turning. Raises MoverFailed if the turn failed."""


class ManualMover:
    """A person turns the device, as instructed."""

    def turn(self, position: Position, number: int = 0) -> None:
        """Nothing to do: the operator turns the device."""

    def busy(self) -> bool:
        """False: a person does not signal the end of a turn."""
        return False


class RunningDevice:
    """A virtual device that runs already, turned through its control socket.

    Raises
    ------
    DeviceError
        If nothing listens there.

    """

    def __init__(self, control: Path | str) -> None:
        self._control = control
        self._remote: RemoteDevice | None = RemoteDevice(control)

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request to the control socket and return the reply.

        Raises
        ------
        DeviceError
            If the connection is lost; the next request connects again.

        """
        if self._remote is None:
            self._remote = RemoteDevice(self._control)
        try:
            return self._remote.ask(**request)
        except DeviceError:
            self.close()
            raise

    def turn(self, position: Position, number: int = 0) -> None:
        """Begin to turn to a position.

        Raises
        ------
        MoverGone
            If nothing listens any more.

        """
        if position.all_degrees is None:
            return
        names = ("alpha_deg", "beta_deg", "gamma_deg")
        try:
            self.ask(turn=dict(zip(names, position.all_degrees, strict=True)))
        except DeviceError as error:
            raise MoverGone(str(error)) from error

    def busy(self) -> bool:
        """False: its accelerometers show when it has arrived."""
        return False

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        if self._remote is not None:
            self._remote.close()
            self._remote = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


class VirtualMover(RunningDevice):
    """A virtual device in a process of its own.

    Parameters
    ----------
    options : of ``fieldcal sim``
    once : whether it ends when its reader goes, so that a run that is killed leaves
        nothing behind

    Attributes
    ----------
    port : what it prints first: path of its pseudo-terminal, or its endpoint
    control : path of its control socket

    Raises
    ------
    DeviceError
        If it does not start, or does not answer.
    InputError
        If it refuses the options.

    """

    _remote = None

    def __init__(self, options: Sequence[str], once: bool = True) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fieldcal-")
        self._truth = Path(self._folder.name) / "truth.json"
        command = [sys.executable, "-m", "fieldcal", "sim", *options]
        command += ["--once"] if once else []
        self._process = subprocess.Popen(
            [*command, "--truth", str(self._truth)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            self.port, self.control = self._line(), self._line()
            super().__init__(self.control)
        except BaseException:
            self.close()
            raise

    def _line(self) -> str:
        out = self._process.stdout
        line = out.readline().strip() if out else ""
        if not line:
            _, said = self._process.communicate()
            last = said.strip().splitlines()[-1:] or ["it said nothing"]
            # options that it refuses are the user's, and no fault of a device
            refused = self._process.returncode == InputError.exit_code
            fault = InputError if refused else DeviceError
            raise fault(f"the virtual device did not start: {last[0]}")
        return line

    @property
    def truth(self) -> Mapping[str, Any]:
        """True parameters of the virtual device."""
        truth: Mapping[str, Any] = json.loads(self._truth.read_text(encoding="utf-8"))
        return truth

    def close(self) -> None:
        """End the process; safe to call twice."""
        super().close()
        self._process.terminate()
        try:
            self._process.communicate(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        self._folder.cleanup()
