"""A command that turns the device, such as that of a turntable."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from string import Formatter
from time import monotonic, sleep
from typing import IO, Self

from fieldcal.core.errors import MoverFailed, MoverGone, PlanError
from fieldcal.core.positions import Position

PLACES = ("alpha", "beta", "gamma", "position", "name")
"""Placeholders of a command: angles in deg, number from 1, name."""

LAST = 1.0
"""Time for a command to end by itself before it is killed, s."""


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
        self._began, self._done = 0.0, False
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
        self._began, self._done = monotonic(), False
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._said,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,
            )
        except OSError as error:
            raise MoverFailed(
                f"the mover {command[0]} cannot be called: {error.strerror}; check"
                " [run.mover] command in the plan"
            ) from error

    def busy(self) -> bool:
        """Whether it still runs.

        Raises
        ------
        MoverGone
            If it failed.
        MoverFailed
            If it takes too long.

        """
        if self._process is None or self._done:
            return False
        name, code = self._template[0], self._code(self._process)
        if code is None:
            if monotonic() - self._began > self._timeout:
                self.close()
                raise MoverFailed(
                    f"the mover {name} was not done after {self._timeout:g} s: look at"
                    " it, or raise timeout_s in [run.mover]"
                )
            return True
        self._done = True
        if code != 0:
            raise MoverGone(
                f"the mover {name} ended with exit code {code}{self._last()}"
            )
        return False

    @staticmethod
    def _code(process: subprocess.Popen[str]) -> int | None:
        """Exit code; its number stays that of its process group until `close`.

        Where a system cannot look without reaping, as macOS and Windows, the number is
        free from then on, and what is left of its group has it all the same.
        """
        if not hasattr(os, "waitid"):
            return process.poll()
        how = os.WEXITED | os.WNOHANG | os.WNOWAIT
        ended = os.waitid(os.P_PID, process.pid, how)
        if ended is None:
            return None
        return ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status

    def close(self) -> None:
        """End the command and its child processes; safe to call twice."""
        if self._process is not None:
            if self._code(self._process) is None:
                _signal(self._process, "SIGTERM")
            deadline = monotonic() + LAST
            while self._code(self._process) is None and monotonic() < deadline:
                sleep(LAST / 20)
            _signal(self._process, "SIGKILL")
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
        angles = position.all_degrees or (0.0, 0.0, 0.0)
        values = (*(f"{a:g}" for a in angles), str(number + 1), position.name)
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


def _signal(process: subprocess.Popen[str], name: str) -> None:
    """End a command and its child processes, by a signal where the system has them."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, getattr(signal, name))
        return
    tree = ["taskkill", "/T", "/F", "/PID", str(process.pid)]
    with suppress(OSError):
        subprocess.run(tree, capture_output=True, check=False)
    process.kill()
