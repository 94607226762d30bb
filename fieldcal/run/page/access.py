"""Who is let in to the page: whoever has the token, from this page and no other.

The token comes once in the address that the code on the console holds, and goes into a
cookie. Requests under another host's name (a name that was made to point here), and
those that want something and do not come from the page itself, are refused.
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

COOKIE = "fieldcal_page"

LARGEST = 1000
"""Bytes of a request's body."""

HEADERS = {
    "content-security-policy": "default-src 'self'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
}
"""Of every answer: nothing from elsewhere, in nobody's frame, kept nowhere."""


@dataclass(frozen=True)
class Access:
    """What a request has to show.

    Attributes
    ----------
    hosts : names with ports under which the page is served
    token : what the address on the console holds

    """

    hosts: tuple[str, ...]
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    def refusal(self, scope: Scope) -> Response | None:
        """The answer to a request that is not let in; None for one that is."""
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
        if not self._right(_cookie(headers.get("cookie", ""))):
            return _refused(403, "scan the code that the console shows, or open the"
                            " address beside it")  # fmt: skip
        if scope["method"] in ("GET", "HEAD"):
            return None
        if headers.get("origin", "") not in {f"http://{host}" for host in self.hosts}:
            return _refused(403, "what is wanted has to come from the page itself")
        if not headers.get("content-type", "").startswith("application/json"):
            return _refused(415, "what is wanted comes as JSON")
        length = headers.get("content-length", "")
        if not length.isdecimal() or int(length) > LARGEST:
            return _refused(
                413, f"at most {LARGEST} bytes, and how many has to be said"
            )
        return None

    def _right(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())


class Gate:
    """Lets requests in by `Access`, and gives every answer its headers."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def with_headers(message: dict[str, object]) -> None:
            if message["type"] == "http.response.start":
                more = [(k.encode(), v.encode()) for k, v in HEADERS.items()]
                message = {**message, "headers": [*message["headers"], *more]}  # type: ignore[misc]
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
