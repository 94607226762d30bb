"""Access control of the page, by a token and by the origin of a request.

The address on the console contains the token, which is then kept in a cookie. A
browser sends the cookies of a computer to all its ports, so the cookie's name contains
the port. Programs send their own token with each request. Requests under another host
name (DNS rebinding) are refused, and so are requests that change something and do not
come from the page.
"""

from __future__ import annotations

import hmac
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import parse_qs

from starlette.requests import cookie_parser
from starlette.responses import (
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.types import ASGIApp, Receive, Scope, Send

SCAN = "scan the code that the console shows, or open the address beside it"
"""What to do without a token, where the console shows the code of the address."""

MAX_BODY_BYTES = 1000
"""Largest body of a request, bytes."""

MIB = 1 << 20
"""Bytes of a MiB."""

API_PATH = "/api/"
"""Beginning of the paths that programs ask for."""

HEADERS = {
    "content-security-policy": "default-src 'self'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}
"""Headers of every answer: no foreign content, no framing, no caching."""


@dataclass(frozen=True)
class Access:
    """Conditions for a request to be allowed.

    Attributes
    ----------
    hosts : names with ports under which the page is served
    token : contained in the address on the console
    bearers : tokens of programs
    uploads : largest body of a path that takes files, bytes
    remedy : what one is told to do who has no token

    """

    hosts: tuple[str, ...]
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    bearers: tuple[str, ...] = ()
    uploads: Mapping[str, int] = field(default_factory=dict)
    remedy: str = SCAN

    def refusal(self, scope: Scope) -> Response | None:
        """The answer to a request that is refused; None for one that is allowed."""
        headers = {
            k.decode("latin-1"): v.decode("latin-1") for k, v in scope["headers"]
        }
        host = headers.get("host", "")
        if host not in self.hosts:
            return _refusal_response(
                scope, 421, "this page is served under the address on the console"
            )
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token")
        if given and scope["path"] == "/" and self._is_page_token(given[0]):
            answer = RedirectResponse("/", 303)
            answer.set_cookie(
                cookie_name(host), self.token, httponly=True, samesite="lax"
            )
            return answer
        scheme, _, sent = headers.get("authorization", "").partition(" ")
        program = scheme.lower() == "bearer" and self._is_program_token(sent.strip())
        if scheme.lower() == "bearer" and not program:
            why = "this token is none of a program: fieldcal serve takes"
            return _refusal_response(scope, 403, f"{why} those of its --tokens file")
        kept = cookie_parser(headers.get("cookie", "")).get(cookie_name(host), "")
        if not program and not self._is_page_token(kept):
            return _refusal_response(scope, 403, self.remedy)
        if scope["method"] in ("GET", "HEAD"):
            return None
        here = {f"{s}://{name}" for name in self.hosts for s in ("http", "https")}
        if not program and headers.get("origin", "") not in here:
            return _refusal_response(
                scope, 403, "what is wanted has to come from the page itself"
            )
        if scope["method"] == "DELETE":
            return None
        most = self.uploads.get(scope["path"])
        kind = headers.get("content-type", "")
        if most is None and not kind.startswith("application/json"):
            return _refusal_response(scope, 415, "what is wanted comes as JSON")
        return _length_refusal(scope, headers, most or MAX_BODY_BYTES)

    def _is_page_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    def _is_program_token(self, given: str) -> bool:
        """Whether a program's token is valid; all are compared, in constant time."""
        found = [hmac.compare_digest(given.encode(), b.encode()) for b in self.bearers]
        return any(found)


class Gate:
    """Admits requests by `Access`, and adds the headers to every answer."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def with_headers(message: dict[str, object]) -> None:
            if message["type"] == "http.response.start":
                own = list(message["headers"])  # type: ignore[call-overload]
                has = {k.lower() for k, _ in own}
                more = [(k.encode(), v.encode()) for k, v in HEADERS.items()]
                own += [(k, v) for k, v in more if k not in has]
                message = {**message, "headers": own}
            await send(message)

        answer = self._access.refusal(scope) or self._app
        await answer(scope, receive, with_headers)  # type: ignore[arg-type]


def _length_refusal(
    scope: Scope, headers: Mapping[str, str], most: int
) -> Response | None:
    """The answer to a body that is too large or of unknown length; None for others."""
    length = headers.get("content-length", "")
    if not length.isdecimal():
        why = "say how long it is (Content-Length); it is not taken in pieces"
        return _refusal_response(scope, 411, why)
    if len(length) > 15 or int(length) > most:
        kept = f"{most // MIB} MiB" if most >= MIB else f"{most} bytes"
        return _refusal_response(scope, 413, f"it is too large: at most {kept}")
    return None


def _refusal_response(scope: Scope, status: int, why: str) -> Response:
    """A sentence; for programs, which ask under `API_PATH`, in an object."""
    if scope["path"].startswith(API_PATH):
        return JSONResponse({"error": f"refused: {why}"}, status)
    return PlainTextResponse(f"refused: {why}\n", status)


def cookie_name(host: str) -> str:
    """Name of the cookie of a host with its port.

    >>> cookie_name("127.0.0.1:8750")
    'fieldcal_127_0_0_1_8750'
    """
    return "fieldcal_" + re.sub(r"[^0-9A-Za-z]", "_", host)
