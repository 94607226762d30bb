"""The server of the page, in a thread beside the run."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Self

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from fieldcal.core.errors import InputError
from fieldcal.run.page.access import Access, Gate
from fieldcal.run.page.board import Board
from fieldcal.run.page.buttons import OFFERED, Buttons

FILES = Path(__file__).parent / "files"

VIEW_EVERY_S = 0.125
"""Shortest time between two views that are sent, s."""

MESSAGE_EVERY_S = 2.0
"""Longest time between two messages to a client, s."""

LINGER_S = 3.0
"""Time that the last state is offered to clients that have not seen it, s."""

ALL_ADDRESSES = ("", "0.0.0.0")  # noqa: S104
"""Hosts at which a server listens at every address of this computer."""

LONGEST_NAME = 64
"""Longest name of a client."""


class PageServer:
    """Serves a run's page; a context manager.

    Parameters
    ----------
    host, port : where to listen; port 0 is any that is free
    board : content of the page, replaced when the run begins
    buttons : of the page

    Raises
    ------
    InputError
        If it cannot listen there.

    """

    def __init__(self, host: str, port: int = 0) -> None:
        self.buttons, self.board = Buttons(), Board("fieldcal", [])
        self._seen: dict[str, int] = {}
        self._socket = listening_socket(host, port)
        port = self._socket.getsockname()[1]
        self.access = Access(tuple(f"{name}:{port}" for name in names_of(host)))
        config = uvicorn.Config(
            Gate(_make_app(self), self.access), log_config=None, access_log=False,
            lifespan="off", timeout_graceful_shutdown=1, server_header=False,
            limit_concurrency=64,
        )  # fmt: skip
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(
            target=self._server.run, args=([self._socket],), daemon=True
        )

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        return f"http://{self.access.hosts[0]}/?token={self.access.token}"

    @property
    def watched(self) -> bool:
        """Whether any client has seen the page."""
        return bool(self._seen)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        until = monotonic() + LINGER_S
        while monotonic() < until and any(
            seen < self.board.version for seen in tuple(self._seen.values())
        ):
            sleep(VIEW_EVERY_S)
        self._server.should_exit = True
        self._thread.join(timeout=5.0)
        self._socket.close()

    def content_for(self, client: str) -> str:
        """The present content for a client, as JSON."""
        version = self.board.version
        mine = self.buttons.note_watcher(client)
        content = {**self.board.content(), "mine": mine, "free": self.buttons.is_free()}
        self._seen[client] = version
        return json.dumps(content)

    async def views(self, client: str) -> AsyncIterator[str]:
        """Every change, as events of server-sent events."""
        before, sent = "", -MESSAGE_EVERY_S
        try:
            while not self._server.should_exit:
                now = self.content_for(client)
                if now != before or monotonic() - sent > MESSAGE_EVERY_S:
                    before, sent = now, monotonic()
                    yield f"data: {now}\n\n"
                await asyncio.sleep(VIEW_EVERY_S)
        finally:
            self._seen.pop(client, None)


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens there.

    Raises
    ------
    InputError
        If none can.

    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except (OSError, OverflowError) as error:
        raise InputError(
            f"the page cannot be served at {host}:{port}: {error}; give an address of"
            " this computer and a free port, as in 192.168.1.5:8080"
        ) from error


def names_of(host: str) -> tuple[str, ...]:
    """Names under which what listens at a host is reached; the first is to be shown.

    What listens at all addresses of this computer is reached at none of that name.

    >>> names_of("192.168.1.5"), names_of("::1"), names_of("localhost")
    (('192.168.1.5',), ('[::1]',), ('localhost', '127.0.0.1'))
    """
    local = ("127.0.0.1", "localhost")
    if host in ALL_ADDRESSES:
        return tuple(dict.fromkeys((local_address(), *local)))
    if host in local:
        return tuple(dict.fromkeys((host, *sorted(local, reverse=True))))
    return (f"[{host}]" if ":" in host else host,)


def local_address() -> str:
    """The address that others on the local network reach this computer by.

    That from which it would send to them; nothing is sent.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # for documentation only, RFC 5737
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"


def _make_app(server: PageServer) -> Starlette:
    async def page(_: Request) -> Response:
        return FileResponse(FILES / "page.html", media_type="text/html")

    def file(name: str) -> Callable[[Request], Awaitable[Response]]:
        async def sent(_: Request) -> Response:
            return FileResponse(FILES / name)

        return sent

    async def events(request: Request) -> Response:
        client = request.query_params.get("client", "")
        if not _is_name(client):
            return JSONResponse({"error": "a client has a name"}, 400)
        return StreamingResponse(server.views(client), media_type="text/event-stream")

    async def take(request: Request) -> Response:
        given = await _request_object(request)
        if given is None or type(given.get("over", False)) is not bool:
            return JSONResponse({"error": "client and over are wanted"}, 400)
        if not server.buttons.take(given["client"], given.get("over", False)):
            return JSONResponse({"error": "somebody else has the buttons"}, 409)
        return JSONResponse({})

    async def wish(request: Request) -> Response:
        given = await _request_object(request)
        wished = None if given is None else given.get("wish")
        if given is None or not isinstance(wished, str) or wished not in OFFERED:
            return JSONResponse({"error": "client and wish are wanted"}, 400)
        meant = given.get("position")
        if wished != "stop" and meant not in (None, server.board.position_now):
            return JSONResponse({"error": "another position is asked for now"}, 409)
        if not server.buttons.press(given["client"], given["wish"]):
            return JSONResponse({"error": "somebody else has the buttons"}, 409)
        return JSONResponse({})

    others = sorted(f.name for f in FILES.iterdir() if f.suffix != ".html")
    routes = [
        Route("/", page),
        Route("/events", events),
        Route("/buttons", take, methods=["POST"]),
        Route("/wish", wish, methods=["POST"]),
        *(Route(f"/{name}", file(name)) for name in others),
    ]
    return Starlette(routes=routes)


async def _request_object(request: Request) -> dict[str, Any] | None:
    """JSON object of a request, with the client's name; None if it is invalid."""
    try:
        given = json.loads(await request.body())
    except (ValueError, RecursionError):
        return None
    return given if isinstance(given, dict) and _is_name(given.get("client")) else None


def _is_name(client: Any) -> bool:
    return (
        isinstance(client, str) and 0 < len(client) <= LONGEST_NAME and client.isalnum()
    )
