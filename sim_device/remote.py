"""The other end of the control socket: tell a virtual device in another process."""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any, Self

from fieldcal.core.errors import DeviceError, InputError

PATIENCE_S = 10.0


class RemoteDevice:
    """A connection to the control socket of ``fieldcal sim``; see `control`.

    Raises
    ------
    DeviceError
        If nothing listens there.

    """

    def __init__(self, path: Path | str) -> None:
        self._path = str(path)
        if not hasattr(socket, "AF_UNIX"):
            raise DeviceError(
                "a virtual device needs a system with pseudo-terminals and unix"
                " sockets, which this one lacks: use a device, or replay: a recording"
            )
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(PATIENCE_S)
        try:
            self._socket.connect(self._path)
        except OSError as error:
            self._socket.close()
            raise DeviceError(
                f"no virtual device listens at {path}: {error.strerror}"
            ) from error
        self._replies = self._socket.makefile("rb")

    def ask(self, **request: Any) -> dict[str, Any]:
        """Send one request and return its reply.

        Raises
        ------
        InputError
            If the device refuses it.
        DeviceError
            If the device is gone.

        """
        try:
            self._socket.sendall(json.dumps(request).encode() + b"\n")
            line = self._replies.readline()
        except OSError as error:
            raise DeviceError(f"{self._path} failed: {error}") from error
        if not line:
            raise DeviceError(f"{self._path}: the virtual device is gone")
        reply: dict[str, Any] = json.loads(line)
        if "error" in reply:
            raise InputError(f"the virtual device refuses: {reply['error']}")
        return reply

    def turn(self, alpha_deg: float, beta_deg: float, gamma_deg: float = 0.0) -> float:
        """Turn the device; returns the device time at which it is there, s."""
        there = {"alpha_deg": alpha_deg, "beta_deg": beta_deg, "gamma_deg": gamma_deg}
        reply = self.ask(turn=there)
        return float(reply["until_s"])

    def close(self) -> None:
        """Hang up; safe to call twice."""
        self._replies.close()
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
