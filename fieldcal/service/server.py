"""The service at a socket: who is let in, and how it ends."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import uvicorn

from fieldcal.core.errors import InputError
from fieldcal.run.page.access import Access, Gate
from fieldcal.run.page.server import listening_socket
from fieldcal.service import api, openapi
from fieldcal.service.jobs import Jobs
from fieldcal.service.queue import JobQueue

SHORTEST = 16
"""Letters that a token has at least."""


@dataclass
class Service:
    """A service that listens; `serve` answers until somebody ends it.

    Attributes
    ----------
    socket : where it listens
    access : who is let in
    server : what answers

    """

    socket: socket.socket
    access: Access
    server: uvicorn.Server

    @classmethod
    def of(
        cls, host: str, port: int, jobs: Jobs, queue: JobQueue,
        tokens: Sequence[str] = (), names: Sequence[str] = (),
    ) -> Service:  # fmt: skip
        """Listen.

        Parameters
        ----------
        host, port : where; port 0 is any that is free
        jobs, queue : what is served
        tokens : of programs
        names : host:port by which it is reached besides, behind a proxy

        Raises
        ------
        InputError
            If nothing can listen there.

        """
        there = listening_socket(host, port)
        port = there.getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        local = ("localhost", "127.0.0.1") if host in ("127.0.0.1", "localhost") else ()
        hosts = dict.fromkeys(f"{n}:{port}" for n in (name, *local))
        access = Access(
            (*hosts, *names),
            bearers=tuple(tokens),
            uploads={openapi.SESSIONS: jobs.bounds.upload},
        )
        config = uvicorn.Config(
            Gate(api.app(jobs, queue), access), log_config=None, access_log=False,
            lifespan="off", timeout_graceful_shutdown=2, server_header=False,
            limit_concurrency=64,
        )  # fmt: skip
        return cls(there, access, uvicorn.Server(config))

    @property
    def address(self) -> str:
        """What to open in a browser, with the token of the page."""
        return f"http://{self.access.hosts[0]}/?token={self.access.token}"

    def serve(self) -> None:
        """Answer until it is ended."""
        with self.socket:
            self.server.run([self.socket])


def tokens_in(path: Path) -> list[str]:
    """Tokens of a file, one a line; those behind # are remarks.

    Raises
    ------
    InputError
        If it cannot be read, others may read it, or a token is too short.

    """
    try:
        lines = path.read_text("utf-8").splitlines()
        mode = path.stat().st_mode
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    if os.name == "posix" and mode & 0o077:
        raise InputError(f"{path}: others may read the tokens: chmod 600 {path}")
    found = [one for line in lines if (one := line.split("#")[0].strip())]
    if not found or min(map(len, found)) < SHORTEST:
        raise InputError(
            f"{path}: a token a line is wanted, of {SHORTEST} letters or more, as"
            " from openssl rand -hex 24"
        )
    return found
