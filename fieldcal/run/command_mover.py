"""A command that turns the device, such as that of a turntable."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from string import Formatter
from time import monotonic, sleep
from typing import IO, Self

from fieldcal.core.errors import MoverFailed, MoverGone, PlanError
from fieldcal.core.positions import Position

PLACEHOLDERS = ("alpha", "beta", "gamma", "position", "name")
"""Placeholders of a command: angles in deg, number from 1, name of the position."""

TERMINATION_S = 1.0
"""Time for a command to end by itself before it is killed, s."""


class CommandMover:
    """Mover that calls a command for each position, such as that of a turntable.

    Parameters
    ----------
    template : program and arguments, which may name `PLACEHOLDERS` in braces
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
        self._order: tuple[Position, int] | None = None
        self._filled_command(Position.deg(0.0, 0.0), 0)

    def turn(self, position: Position, number: int = 0) -> None:
        """Call the command, unless it is at work on the same turn already.

        A position is asked for once more after a gap of the link. A turntable must not
        lose its program half way for that.

        Raises
        ------
        MoverFailed
            If it cannot be called.

        """
        order = (position, number)
        if self._process and self._order == order and not self._done:
            if self._exit_code(self._process) is None:
                return
        self._order = order
        self.close()
        self._said = tempfile.TemporaryFile("w+", errors="replace")
        command = self._filled_command(position, number)
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
        """Whether the command still runs.

        Raises
        ------
        MoverGone
            If it failed.
        MoverFailed
            If it takes too long.

        """
        if self._process is None or self._done:
            return False
        name, code = self._template[0], self._exit_code(self._process)
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
            said = self._last_output_line()
            raise MoverGone(f"the mover {name} ended with exit code {code}{said}")
        return False

    @staticmethod
    def _exit_code(process: subprocess.Popen[str]) -> int | None:
        """Exit code of the process, None while it runs.

        The process is not reaped, so that its number stays that of its process group
        until `close`. macOS and Windows have no `waitid`: there the process is reaped,
        and its number is free although its child processes still have it as group.
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
            if self._exit_code(self._process) is None:
                _end_process_group(self._process, "SIGTERM")
            deadline = monotonic() + TERMINATION_S
            while self._exit_code(self._process) is None and monotonic() < deadline:
                sleep(TERMINATION_S / 20)
            _end_process_group(self._process, "SIGKILL")
            self._process.wait()
            self._process = None
        if self._said is not None:
            self._said.close()
            self._said = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _last_output_line(self) -> str:
        if self._said is None:
            return ""
        self._said.seek(0)
        lines = self._said.read().strip().splitlines()
        return f": {lines[-1]}" if lines else " and said nothing"

    def _filled_command(self, position: Position, number: int) -> list[str]:
        angles = position.all_degrees or (0.0, 0.0, 0.0)
        values = (*map(_Angle, angles), number + 1, position.name)
        known = dict(zip(PLACEHOLDERS, values, strict=True))
        for part in self._template:
            try:
                odd = _fields_named(part)
            except ValueError:
                odd = [part]
            if unknown := [n for n in odd if n not in PLACEHOLDERS]:
                raise PlanError(
                    f"[run.mover] command: {{{unknown[0]}}} is none of"
                    f" {', '.join(PLACEHOLDERS)}; write a brace that is meant as {{{{"
                )
        return [_filled(part, known) for part in self._template]

    def names(self, placeholder: str) -> bool:
        """Whether the command has this one of `PLACEHOLDERS`."""
        return any(placeholder in _fields_named(part) for part in self._template)


def _fields_named(part: str) -> list[str]:
    """Names in the braces of a part of a template; ValueError if they do not close."""
    return [name for _, name, _, _ in Formatter().parse(part) if name is not None]


def _filled(part: str, known: Mapping[str, object]) -> str:
    try:
        return part.format(**known)
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        raise PlanError(
            f"[run.mover] command: {part!r} cannot be filled in ({error}): write"
            " numbers as in {alpha:.3f} or {position:02d}"
        ) from error


class _Angle(float):
    """An angle in degrees that is written briefly unless a format is asked for."""

    def __format__(self, format_spec: str) -> str:
        return super().__format__(format_spec or "g")


def _end_process_group(process: subprocess.Popen[str], name: str) -> None:
    """End a command and its child processes, by a signal where the system has them."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, getattr(signal, name))
        return
    tree = ["taskkill", "/T", "/F", "/PID", str(process.pid)]
    with suppress(OSError):
        subprocess.run(tree, capture_output=True, check=False)
    process.kill()
