"""The control socket: JSON lines in, a JSON line back for each.

Requests, one key each:

    {"turn": {"alpha_deg": 45, "beta_deg": 5}}      also "gamma_deg", "seconds", "at_s"
    {"spin": {"rate_deg_s": [0, 30, 0]}}            a rate table; also the keys of turn
    {"bump": {}}                                    "push", "tilt_deg", "seconds",
                                                    "at_s"
    {"fault": {"silence_s": 2}}                     "hangup_s", "garbage_bytes",
                                                    "flip_bits", "lose_bytes",
                                                    "double_bytes", "reboot_s",
                                                    "jitter_s", "skew_ppm",
                                                    "duplicate_stamps",
                                                    "late_stamps"
    {"status": true}
    {"stop": true}

A reply has "time_s", the device time from which the request counts, and what belongs
to it ("until_s": when a turn, bump, silence or hang-up is over); one that was refused
has "error" and nothing has happened. "at_s" is a device time not yet reached, so that a
script gets the same samples at any speed.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fieldcal.core.errors import InputError

LONGEST = 65536
"""Bytes of a request, or of replies that nobody reads, before a client is dropped."""

Carry = Callable[[dict[str, Any]], dict[str, Any]]


class Control:
    """A listening unix socket and its clients; never blocks.

    Parameters
    ----------
    carry_out : carries out a request and returns the reply; may raise InputError
    path : of the socket; default: in a new directory

    Raises
    ------
    InputError
        If the socket cannot be created.

    """

    def __init__(self, carry_out: Carry, path: Path | None = None) -> None:
        self._carry_out = carry_out
        self._directory = None if path else tempfile.mkdtemp(prefix="fieldcal-sim-")
        self.path = path or Path(str(self._directory)) / "control"
        self._clients: dict[int, _Client] = {}
        self._listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._bound = False
        try:
            _make_room(self.path)
            self._listening.bind(str(self.path))
        except (OSError, InputError) as error:
            self.close()
            raise InputError(f"no control socket at {self.path}: {error}") from error
        self._bound = True
        self._listening.listen()
        self._listening.setblocking(False)

    def watched(self) -> tuple[list[int], list[int]]:
        """Files to watch for reading and for writing."""
        reading = [self._listening.fileno(), *self._clients]
        return reading, [fd for fd, client in self._clients.items() if client.replies]

    def serve(self) -> None:
        """Accept, read, answer: whatever can be done at once."""
        with contextlib.suppress(BlockingIOError):
            while True:
                connection, _ = self._listening.accept()
                connection.setblocking(False)
                self._clients[connection.fileno()] = _Client(connection)
        for fd, client in list(self._clients.items()):
            if not client.serve(self._answer):
                client.connection.close()
                del self._clients[fd]

    def _answer(self, line: bytes) -> bytes:
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                raise InputError('a request is like {"status": true}')
            reply = self._carry_out(request)
        except (ValueError, RecursionError):
            reply = {"error": f"not JSON: {line[:60].decode(errors='replace')!r}"}
        except InputError as error:
            reply = {"error": str(error)}
        return json.dumps(reply).encode() + b"\n"

    def close(self) -> None:
        """Close everything and take the socket away; safe to call twice."""
        for client in self._clients.values():
            with contextlib.suppress(OSError):
                client.connection.send(client.replies)
            client.connection.close()
        self._clients.clear()
        self._listening.close()
        if self._bound:
            self.path.unlink(missing_ok=True)
            self._bound = False
        if self._directory is not None:
            with contextlib.suppress(OSError):
                os.rmdir(self._directory)


class _Client:
    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.replies = bytearray()
        self._said = bytearray()

    def serve(self, answer: Callable[[bytes], bytes]) -> bool:
        """Read and answer what is there; false if the client is gone."""
        try:
            self._said += (data := self.connection.recv(LONGEST))
        except BlockingIOError:
            data = None
        except OSError:
            return False
        *lines, self._said = self._said.split(b"\n")
        for line in lines:
            if line.strip():
                self.replies += answer(bytes(line))
        try:
            if self.replies:
                del self.replies[: self.connection.send(self.replies)]
        except BlockingIOError:
            pass
        except OSError:
            return False
        longest = max(len(self._said), len(self.replies))
        return data != b"" and longest < LONGEST


def _make_room(path: Path) -> None:
    """Take away a socket that a killed process has left; refuse any other file."""
    if not path.exists():
        return
    if not path.is_socket():
        raise InputError("a file of that name is there already")
    with contextlib.closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as probe:
        try:
            probe.connect(str(path))
        except OSError:
            path.unlink()
            return
    raise InputError("another virtual device listens there")
