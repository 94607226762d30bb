"""The page's server over its own socket: who is let in, what comes, what is refused."""

from __future__ import annotations

import json
import re
import subprocess
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.client import HTTPResponse
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import HANGS, TWO_POSITION, steady

from fieldcal.commands.run_page import code_to_scan, parse_address, wait_for_page
from fieldcal.core.errors import InputError, Stopped
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.planning.steps import Hold
from fieldcal.run.page.access import cookie_name
from fieldcal.run.page.board import Board
from fieldcal.run.page.server import PageServer

LOCAL = "127.0.0.1"


class Stay(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *args: Any, **more: Any) -> None:
        return None


OPENER = urllib.request.build_opener(Stay, urllib.request.ProxyHandler({}))


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with PageServer(LOCAL) as made:
        made.board = Board("fieldcal · five_position", FIVE_POSITIONS)
        made.board.position_asked(Hold(1, FIVE_POSITIONS[1], 30.0))
        yield made


def base(server: PageServer) -> str:
    return f"http://{server.access.hosts[0]}"


def sent(
    server: PageServer, path: str, body: bytes | None = None, **headers: str
) -> HTTPResponse:
    """The answer to a request of somebody who has the token, as changed by headers."""
    usual = {"Cookie": f"{cookie_name(server.access.hosts[0])}={server.access.token}"}
    if body is not None:
        usual |= {"Origin": base(server), "Content-Type": "application/json"}
    changed = {k.replace("_", "-"): v for k, v in headers.items()}
    kept = {k: v for k, v in (usual | changed).items() if v}
    request = urllib.request.Request(base(server) + path, body, kept)
    answer: HTTPResponse = OPENER.open(request, timeout=HANGS)
    return answer


def status(server: PageServer, path: str, body: Any = None, **headers: str) -> int:
    data = (
        body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
    )
    try:
        with sent(server, path, data, **headers) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        error.close()
        return error.code


def first_view(server: PageServer, client: str) -> dict[str, Any]:
    with sent(server, f"/events?client={client}") as stream:
        line = stream.readline().decode()
    assert line.startswith("data: ")
    view: dict[str, Any] = json.loads(line.removeprefix("data: "))
    return view


def test_the_address_holds_the_token_once(server: PageServer) -> None:
    request = urllib.request.Request(server.address)
    with pytest.raises(urllib.error.HTTPError) as answer:
        OPENER.open(request, timeout=HANGS)
    answer.value.close()
    assert answer.value.code == 303 and answer.value.headers["Location"] == "/"
    cookie = answer.value.headers["Set-Cookie"]
    assert server.access.token in cookie
    assert "HttpOnly" in cookie and "samesite=lax" in cookie.lower()
    assert status(server, "/") == 200


@pytest.mark.parametrize("path", ["/", "/page.js", "/events?client=a", "/nothing"])
@pytest.mark.parametrize("cookie", ["", "NAME=", "NAME=wrong", 'é="'])
def test_nobody_gets_in_without_the_token(
    server: PageServer, path: str, cookie: str
) -> None:
    cookie = cookie.replace("NAME", cookie_name(server.access.hosts[0]))
    assert status(server, path, Cookie=cookie) == 403
    assert status(server, f"{path}?token=wrong", Cookie=cookie) == 403


def test_names_that_were_made_to_point_here_are_refused(server: PageServer) -> None:
    assert status(server, "/", Host="elsewhere.example") == 421
    assert status(server, "/", Host=f"{LOCAL}:1") == 421


def test_every_answer_forbids_what_is_not_its_own(server: PageServer) -> None:
    every = []
    for path in ("/", "/page.css"):
        with sent(server, path) as answer:
            every.append(answer.headers)
    with pytest.raises(urllib.error.HTTPError) as refused:
        sent(server, "/", Cookie="")
    refused.value.close()
    for headers in (*every, refused.value.headers):
        assert "default-src 'self'" in headers["Content-Security-Policy"]
        assert headers["Cache-Control"] == "no-store"
        assert headers["X-Content-Type-Options"] == "nosniff"


def test_wishes_come_from_the_page_itself_as_json_and_short(server: PageServer) -> None:
    wish = {"client": "a", "wish": "repeat"}
    server.buttons.take("a", over=True)
    assert status(server, "/wish", wish) == 200
    assert server.buttons.pressed() == "repeat"
    assert status(server, "/wish", wish, Origin="http://elsewhere.example") == 403
    assert status(server, "/wish", wish, Origin="") == 403
    assert status(server, "/wish", wish, Content_Type="text/plain") == 415
    assert status(server, "/wish", {**wish, "more": "x" * 2000}) == 413
    assert status(server, "/wish", wish, Cookie="") == 403
    assert server.buttons.pressed() is None


BODIES = st.one_of(
    st.binary(max_size=300),
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=20),
        lambda x: (
            st.lists(x, max_size=4)
            | st.dictionaries(
                st.sampled_from(["client", "wish", "over"]), x, max_size=3
            )
        ),
        max_leaves=6,
    ).map(lambda value: json.dumps(value).encode()),
)


@settings(max_examples=60, deadline=None)
@given(body=BODIES, path=st.sampled_from(["/wish", "/buttons"]))
def test_malformed_wishes_are_refused(
    server: PageServer, body: bytes, path: str
) -> None:
    server.buttons.take("holder", over=True)
    assert status(server, path, body) in (400, 409)
    assert server.buttons.note_watcher("holder") and server.buttons.pressed() is None


def test_one_presses_and_the_other_watches(server: PageServer) -> None:
    server.buttons.take("a", over=True)
    assert status(server, "/buttons", {"client": "b"}) == 409
    assert status(server, "/wish", {"client": "b", "wish": "stop"}) == 409
    assert not first_view(server, "b")["mine"] and first_view(server, "a")["mine"]
    assert status(server, "/buttons", {"client": "b", "over": True}) == 200
    assert first_view(server, "b")["mine"] and not first_view(server, "a")["mine"]
    assert status(server, "/wish", {"client": "b", "wish": "dance"}) == 400


def test_what_was_meant_for_another_position_is_refused(server: PageServer) -> None:
    """The link of a phone may be slower than the next position; a stop is for all."""
    server.buttons.take("a", over=True)
    skip = {"client": "a", "wish": "skip"}
    assert status(server, "/wish", {**skip, "position": 0}) == 409
    assert status(server, "/wish", {**skip, "position": "1"}) == 409
    assert server.buttons.pressed() is None
    assert status(server, "/wish", {**skip, "position": 1}) == 200
    assert server.buttons.pressed() == "skip"
    stop = {"client": "a", "wish": "stop", "position": 0}
    assert status(server, "/wish", stop) == 200 and server.buttons.pressed() == "stop"


def test_a_change_is_sent_without_being_asked_for(server: PageServer) -> None:
    with sent(server, "/events?client=c") as stream:
        assert json.loads(stream.readline()[6:])["detail"].startswith("position 2")
        stream.readline()
        server.board.position_asked(Hold(2, FIVE_POSITIONS[2], 30.0))
        assert json.loads(stream.readline()[6:])["detail"].startswith("position 3")
    server.board.position_asked(Hold(1, FIVE_POSITIONS[1], 30.0))


def test_whoever_opens_the_page_as_a_run_ends_does_not_break_it() -> None:
    class Opened(Board):
        """A board that somebody else looks at while it is asked for its version."""

        others = iter("bc")

        @property
        def version(self) -> int:
            if name := next(self.others, ""):
                there.content_for(name)
            return 0

    with PageServer(LOCAL) as there:
        there.content_for("a")
        there.board = Opened("fieldcal", [])
    assert there.watched


def test_whoever_is_shown_the_code_may_stop_or_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Keys:
        def __init__(self) -> None:
            self.has_keys = True

        def __enter__(self) -> Keys:
            return self

        def __exit__(self, *_: object) -> None: ...

        def pressed(self) -> str | None:
            return wishes.pop(0)

    monkeypatch.setattr("fieldcal.run.operator.keyboard.Keyboard", Keys)
    with PageServer("127.0.0.1") as server:
        wishes = [None, "skip", "stop"]
        with pytest.raises(Stopped):
            wait_for_page(server)
        wishes = ["repeat", "confirm"]
        wait_for_page(server)
    assert not wishes


def test_an_address_that_is_not_here_or_taken_is_said() -> None:
    with PageServer(LOCAL) as there:
        port = int(there.access.hosts[0].rpartition(":")[2])
        with pytest.raises(InputError, match=f"served at {LOCAL}:{port}"):
            PageServer(LOCAL, port)
    with pytest.raises(InputError, match="an address of this computer"):
        PageServer("192.0.2.1")
    for wrong in ("", "host:", "host:x", "host:70000", ":80"):
        with pytest.raises(InputError, match="--page"):
            parse_address(wrong)


def test_a_run_is_watched_to_its_end(tmp_path: Path) -> None:
    """A headless run on a virtual device: the page follows and is told GO."""
    virtual = [f"--virtual={' '.join(steady(tmp_path))}", "--speed=20", "--seconds=12"]
    command = [*TWO_POSITION, *virtual, "--page", LOCAL, "-o", str(tmp_path / "s")]
    command += ["--history", str(tmp_path / "h.db")]
    words: list[str] = []
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    ) as run:
        assert run.stderr
        first = json.loads(run.stderr.readline())
        assert first["event"] == "page"
        address, _, token = first["address"].partition("?token=")
        name = cookie_name(urlsplit(address).netloc)
        request = urllib.request.Request(
            f"{address}events?client=w", headers={"Cookie": f"{name}={token}"}
        )
        with OPENER.open(request, timeout=HANGS) as stream:
            for line in stream:
                if line.startswith(b"data: "):
                    now = json.loads(line[6:])
                    words.append(now["words"])
                    if now["ended"]:
                        break
        run.stderr.read()
    assert run.returncode == 0
    # what is shorter than the time between two views may not be among them
    assert "HOLD STILL" in words and words[-1] == "GO"


@pytest.mark.parametrize(
    ("columns", "lines", "fits"),
    [(80, 24, True), (60, 20, True), (40, 15, False), (30, 40, False)],
)
def test_a_code_is_shown_whole_or_not_at_all(
    columns: int, lines: int, fits: bool
) -> None:
    """Its top was scrolled off a small terminal, with the address above it."""
    code = code_to_scan(
        "http://192.168.100.100:54321/?token=R7kPVyqMSOFG6y27wY9lUg", columns, lines
    )
    rows = re.sub("\x1b[^m]*m", "", code).splitlines()
    assert bool(rows) == fits
    assert len(rows) + 2 <= lines or not fits
    assert all(len(row) <= columns for row in rows)
