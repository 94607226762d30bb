"""The service at a network socket, with access control."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import uvicorn

from fieldcal.core.errors import InputError
from fieldcal.run.page.access import Access, Gate
from fieldcal.run.page.server import ALL_ADDRESSES, listening_socket, names_of
from fieldcal.service import api, openapi
from fieldcal.service.jobs import JobStore
from fieldcal.service.queue import JobQueue

REMEDY = (
    "open the address that the console of fieldcal serve shows; a program sends a token"
    " of the --tokens file, as Authorization: Bearer TOKEN"
)
"""What one is told to do who has no token."""

SHORTEST_TOKEN = 16
"""Least length of a token, characters."""


@dataclass
class Service:
    """A service that listens; `serve` answers requests until it is stopped.

    Attributes
    ----------
    socket : the listening socket
    access : access control
    server : the HTTP server

    """

    socket: socket.socket
    access: Access
    server: uvicorn.Server

    @classmethod
    def listen(
        cls, host: str, port: int, jobs: JobStore, queue: JobQueue,
        tokens: Sequence[str] = (), names: Sequence[str] = (),
    ) -> Service:  # fmt: skip
        """Open the socket and create the service.

        Parameters
        ----------
        host, port : address to listen at; port 0 is any free one
        jobs, queue : the jobs to serve
        tokens : access tokens of programs
        names : further host:port under which it is reached, behind a proxy

        Raises
        ------
        InputError
            If the address cannot be used.

        """
        there = listening_socket(host, port)
        port = there.getsockname()[1]
        own = [f"{name}:{port}" for name in names_of(host)]
        # behind a proxy or in a container, its own address may not be reached
        shown = [*names, *own] if host in ALL_ADDRESSES else [*own, *names]
        access = Access(
            tuple(dict.fromkeys(shown)),
            bearers=tuple(tokens),
            uploads={openapi.SESSIONS_PATH: jobs.bounds.upload},
            remedy=REMEDY,
        )
        config = uvicorn.Config(
            Gate(api.create_app(jobs, queue), access), log_config=None,
            access_log=False, lifespan="off", timeout_graceful_shutdown=2,
            server_header=False, limit_concurrency=64,
        )  # fmt: skip
        return cls(there, access, uvicorn.Server(config))

    @property
    def address(self) -> str:
        """Address for a browser, with the token of the page."""
        return f"http://{self.access.hosts[0]}/?token={self.access.token}"

    def serve(self) -> None:
        """Answer requests until stopped."""
        with self.socket:
            self.server.run([self.socket])


def read_tokens(path: Path) -> list[str]:
    """Tokens from a file, one in each line; text after # is ignored.

    Raises
    ------
    InputError
        If it cannot be read, others may read it, or a token is short or has a space.

    """
    try:
        lines = path.read_text("utf-8").splitlines()
        mode = path.stat().st_mode
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text, and no file of tokens") from error
    if os.name == "posix" and mode & 0o077:
        raise InputError(f"{path}: others may read the tokens: chmod 600 {path}")
    found = [one for line in lines if (one := line.split("#")[0].strip())]
    spaced = any(len(one.split()) > 1 for one in found)
    if not found or spaced or min(map(len, found)) < SHORTEST_TOKEN:
        raise InputError(
            f"{path}: each line must be one token of {SHORTEST_TOKEN} letters or more,"
            " as openssl rand -hex 24 makes them, and nothing but # and a name after it"
        )
    return found
