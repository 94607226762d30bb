"""Who is let in to the page: whoever has the token, from this page and no other.

The token comes once in the address that the code on the console holds, and goes into a
cookie; programs send theirs with each request. Requests under another host's name (a
name that was made to point here), and those that want something and do not come from
the page itself, are refused.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

COOKIE = "fieldcal_page"

LARGEST = 1000
"""Largest body of a request, bytes."""

HEADERS = {
    "content-security-policy": "default-src 'self'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}
"""Headers of every answer: no foreign content, no framing, no caching."""


@dataclass(frozen=True)
class Access:
    """What a request has to show.

    Attributes
    ----------
    hosts : names with ports under which the page is served
    token : what the address on the console holds
    bearers : tokens of programs
    uploads : largest body of a path that takes files, bytes

    """

    hosts: tuple[str, ...]
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    bearers: tuple[str, ...] = ()
    uploads: Mapping[str, int] = field(default_factory=dict)

    def refusal(self, scope: Scope) -> Response | None:
        """The answer to a request that is refused; None for one that is allowed."""
        headers = {
            k.decode("latin-1"): v.decode("latin-1") for k, v in scope["headers"]
        }
        if headers.get("host", "") not in self.hosts:
            return _refused(421, "this page is served under the address on the console")
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token")
        if given and scope["path"] == "/" and self._right(given[0]):
            answer = RedirectResponse("/", 303)
            answer.set_cookie(COOKIE, self.token, httponly=True, samesite="lax")
            return answer
        scheme, _, sent = headers.get("authorization", "").partition(" ")
        program = scheme.lower() == "bearer" and self._known(sent.strip())
        if scheme.lower() == "bearer" and not program:
            return _refused(403, "this token is none of a program: fieldcal serve takes"
                            " those of its --tokens file")  # fmt: skip
        if not program and not self._right(_cookie(headers.get("cookie", ""))):
            return _refused(403, "scan the code that the console shows, or open the"
                            " address beside it")  # fmt: skip
        if scope["method"] in ("GET", "HEAD"):
            return None
        here = {f"{s}://{host}" for host in self.hosts for s in ("http", "https")}
        if not program and headers.get("origin", "") not in here:
            return _refused(403, "what is wanted has to come from the page itself")
        if scope["method"] == "DELETE":
            return None
        most = self.uploads.get(scope["path"])
        kind = headers.get("content-type", "")
        if most is None and not kind.startswith("application/json"):
            return _refused(415, "what is wanted comes as JSON")
        length, most = headers.get("content-length", ""), most or LARGEST
        if not length.isdecimal() or len(length) > 15 or int(length) > most:
            return _refused(413, f"at most {most} bytes, and how many has to be said")
        return None

    def _right(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    def _known(self, given: str) -> bool:
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


def _refused(status: int, why: str) -> Response:
    return PlainTextResponse(f"refused: {why}\n", status)


def _cookie(header: str) -> str:
    try:
        found = SimpleCookie(header).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""
