"""Who turns the device: a person, a command, or the virtual device itself."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Formatter
from time import monotonic
from typing import IO, Any, Protocol, Self

from fieldcal.core.errors import DeviceError, MoverFailed, PlanError
from fieldcal.core.positions import Position
from fieldcal.sim_device.remote import Remote

PLACES = ("alpha", "beta", "position", "name")
"""What a command's template can name: angles in deg, number from 1, name."""


class Mover(Protocol):
    """Something that can turn the device."""

    def turn(self, position: Position, number: int = 0) -> None:
        """Begin to turn to a position, numbered from 0; return at once."""

    def busy(self) -> bool:
        """Whether it is still at work; MoverFailed if it went wrong."""


class ManualMover:
    """A person turns the device, as instructed."""

    def turn(self, position: Position, number: int = 0) -> None:
        """Leave it to the person."""

    def busy(self) -> bool:
        """A person gives no signal."""
        return False


class RunningDevice:
    """A virtual device that runs already, turned through its control socket.

    Raises
    ------
    DeviceError
        If nothing listens there.

    """

    def __init__(self, control: Path | str) -> None:
        self._remote = Remote(control)

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send a request to the control socket and return the reply."""
        return self._remote.ask(**request)

    def turn(self, position: Position, number: int = 0) -> None:
        """Begin to turn to a position."""
        if position.degrees is not None:
            alpha, beta = position.degrees
            self.ask(turn={"alpha_deg": alpha, "beta_deg": beta})

    def busy(self) -> bool:
        """False: its accelerometers show when it has arrived."""
        return False

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        self._remote.close()

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

    """

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
            raise DeviceError(f"the virtual device did not start: {last[0]}")
        return line

    @property
    def truth(self) -> Mapping[str, Any]:
        """What it conceals."""
        truth: Mapping[str, Any] = json.loads(self._truth.read_text(encoding="utf-8"))
        return truth

    def close(self) -> None:
        """End the process; safe to call twice."""
        if hasattr(self, "_remote"):
            super().close()
        self._process.terminate()
        try:
            self._process.communicate(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        self._folder.cleanup()


class CommandMover:
    """A command that is called for each position: that of a turntable.

    Parameters
    ----------
    template : program and arguments, which may name `PLACES` in braces
    timeout : how long it may take, s

    Raises
    ------
    PlanError
        If the template names something else.

    """

    def __init__(self, template: Sequence[str], timeout: float) -> None:
        self._template, self._timeout = tuple(template), timeout
        self._process: subprocess.Popen[str] | None = None
        self._said: IO[str] | None = None
        self._began = 0.0
        self._filled(Position.deg(0.0, 0.0), 0)

    def turn(self, position: Position, number: int = 0) -> None:
        """Call it.

        Raises
        ------
        MoverFailed
            If it cannot be called.

        """
        self.close()
        self._said = tempfile.TemporaryFile("w+")
        command = self._filled(position, number)
        self._began = monotonic()
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._said,
                stderr=subprocess.STDOUT,
                text=True,
            )
        except OSError as error:
            raise MoverFailed(
                f"the mover {command[0]} cannot be called: {error.strerror}; check"
                " [run.mover] command in the plan"
            ) from error

    def busy(self) -> bool:
        """Whether it still runs; MoverFailed if it failed or takes too long."""
        if self._process is None:
            return False
        code = self._process.poll()
        name = self._template[0]
        if code is None:
            if monotonic() - self._began > self._timeout:
                self.close()
                raise MoverFailed(
                    f"the mover {name} was not done after {self._timeout:g} s: look at"
                    " it, or raise timeout_s in [run.mover]"
                )
            return True
        self._process = None
        if code != 0:
            raise MoverFailed(
                f"the mover {name} ended with exit code {code}{self._last()}"
            )
        return False

    def close(self) -> None:
        """End it if it still runs; safe to call twice."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
        if self._said is not None:
            self._said.close()
            self._said = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _last(self) -> str:
        if self._said is None:
            return ""
        self._said.seek(0)
        lines = self._said.read().strip().splitlines()
        return f": {lines[-1]}" if lines else " and said nothing"

    def _filled(self, position: Position, number: int) -> list[str]:
        alpha, beta = position.degrees or (0.0, 0.0)
        values = (f"{alpha:g}", f"{beta:g}", str(number + 1), position.name)
        known = dict(zip(PLACES, values, strict=True))
        for part in self._template:
            try:
                odd = [n for _, n, _, _ in Formatter().parse(part) if n is not None]
            except ValueError:
                odd = [part]
            if unknown := [n for n in odd if n not in PLACES]:
                raise PlanError(
                    f"[run.mover] command: {{{unknown[0]}}} is none of"
                    f" {', '.join(PLACES)}; write a brace that is meant as {{{{"
                )
        return [part.format(**known) for part in self._template]
