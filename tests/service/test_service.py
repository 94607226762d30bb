"""The service over its own socket: who is let in, what is taken, what comes out."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import threading
import time
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import pytest
from processes import FIELDCAL, HANGS
from session_folders import places, recorded, write_session

from fieldcal.core.errors import InputError
from fieldcal.fleet.workers import WorkerPool, process_pool, run_tasks
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.history.store import History
from fieldcal.run.page.access import cookie_name
from fieldcal.run.page.server import local_address
from fieldcal.service import openapi
from fieldcal.service.bounds import ServiceBounds
from fieldcal.service.jobs import RESULTS_FOLDER, JobStore
from fieldcal.service.queue import JobQueue
from fieldcal.service.server import Service, read_tokens
from fieldcal.service.work import IMPORT_OPTIONS, JobTask
from fieldcal.sim_device.profile import Profile

TOKEN = "0123456789abcdef-token"
OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))
FACES = [(0, 0), (90, 0), (-90, 0), (180, 0), (0, 90), (0, -90)]
BOUNDS = ServiceBounds(upload=20_000_000, jobs=3, kept=2)


@dataclass
class Answer:
    status: int
    body: bytes
    headers: Any

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass
class Client:
    """Asks a service; with the token of a program unless told otherwise."""

    base: str
    token: str = TOKEN

    def ask(
        self,
        path: str,
        body: bytes | None = None,
        method: str = "",
        headers: Mapping[str, str] = MappingProxyType({}),
    ) -> Answer:
        given = {"Authorization": f"Bearer {self.token}"} if self.token else {}
        given |= headers
        request = urllib.request.Request(
            self.base + path, body, given, method=method or None
        )
        try:
            with OPENER.open(request, timeout=HANGS) as answer:
                return Answer(answer.status, answer.read(), answer.headers)
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, error.read(), error.headers)

    def send(self, name: str, body: bytes, query: str = "") -> Answer:
        return self.ask(f"/api/sessions?filename={name}{query}", body)

    def over(self, number: str) -> Any:
        """A job when it is over."""
        until = time.monotonic() + HANGS
        while time.monotonic() < until:
            job = self.ask(f"/api/sessions/{number}").json
            if job["state"] in ("done", "failed"):
                return job
            time.sleep(0.02)
        raise AssertionError("the job never ended")


class Held:
    """A task that is over when it may be, and says what it was given."""

    def __init__(self) -> None:
        self.may = threading.Event()

    def __call__(self, folder: str) -> StoredSession:
        assert self.may.wait(HANGS)
        (upload,) = (Path(folder) / "upload").iterdir()
        if upload.read_bytes() == b"bad":
            return StoredSession(folder, error=f"{folder}: is bad; send another")
        (Path(folder) / RESULTS_FOLDER).mkdir()
        (Path(folder) / RESULTS_FOLDER / "report.html").write_text("<p>it</p>")
        found = {"verdict": "consistent"}
        return StoredSession(folder, "A1", go=True, good=True, result={},
                             diagnosis=found)  # fmt: skip


@dataclass
class Served:
    client: Client
    jobs: JobStore
    task: Held
    service: Service


@contextmanager
def serving(root: Path) -> Iterator[Served]:
    jobs, task = JobStore(root / "jobs", BOUNDS), Held()
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    queue = JobQueue(jobs, Database(root / "h"), pool, task)
    service = Service.listen("127.0.0.1", 0, jobs, queue, [TOKEN, "other" * 4])
    thread = threading.Thread(target=service.serve)
    with queue:
        thread.start()
        try:
            yield Served(
                Client(f"http://{service.access.hosts[0]}"), jobs, task, service
            )
        finally:
            task.may.set()
            service.server.should_exit = True
            thread.join(HANGS)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    with serving(tmp_path) as made:
        yield made


def test_what_is_sent_is_done_and_can_be_had_and_taken_away(served: Served) -> None:
    served.task.may.set()
    client = served.client
    made = client.send("log.csv", b"t,ax", "&serial=A1&latitude=50")
    assert made.status == 202
    job = client.over(made.json["id"])
    assert (job["state"], job["go"], job["good"]) == ("done", True, True)
    assert job["verdict"] == "consistent" and job["documents"] == ["report.html"]
    assert job["options"] == {"serial": "A1", "latitude": "50"}
    page = client.ask(f"/api/sessions/{job['id']}/report.html")
    assert page.body == b"<p>it</p>"
    assert page.headers.get_all("content-security-policy")[0].startswith("sandbox")
    assert len(page.headers.get_all("content-security-policy")) == 1
    (stored,) = Database(served.jobs.root.parent / "h").run(sessions.find_sessions)
    assert stored.serial == "A1" and stored.go is True
    here = f"/api/sessions/{job['id']}"
    assert client.ask(here, method="DELETE").status == 204
    assert client.ask(here).status == client.ask(f"{here}/report.html").status == 404
    assert client.ask(here, method="DELETE").status == 404
    assert list(served.jobs.root.iterdir()) == []
    assert Database(served.jobs.root.parent / "h").run(sessions.find_sessions) == []


def test_what_is_bad_says_why_and_not_where(served: Served) -> None:
    served.task.may.set()
    job = served.client.over(served.client.send("x", b"bad").json["id"])
    assert job["state"] == "failed" and job["error"] == "is bad; send another"


def test_an_unknown_option_is_named(served: Served) -> None:
    answer = served.client.send("x", b"1", "&serail=A1")
    assert answer.status == 400
    assert answer.json["error"].startswith("serail: there is no option of this name")


def test_nobody_is_let_in_without_a_token(served: Served) -> None:
    host = served.service.access.hosts[0]
    for token in ("", "wrong", TOKEN + "x"):
        stranger = Client(served.client.base, token)
        paths = ("/api/sessions", "/api/openapi.json", "/", "/service.js")
        assert {stranger.ask(path).status for path in paths} == {403}
        assert stranger.send("x", b"x").status == 403
        said = stranger.ask("/api/sessions").body
        assert b"--tokens" in said and b"scan" not in said
        assert token or b"Authorization: Bearer" in said
    assert (
        served.client.ask("/api/sessions", headers={"Host": "evil.example"}).status
        == 421
    )
    cookie = {"Cookie": f"{cookie_name(host)}={served.service.access.token}"}
    browser = Client(served.client.base, "")
    assert browser.ask("/", headers=cookie).status == 200
    post = ("/api/sessions?filename=x", b"x")
    assert browser.ask(*post, headers=cookie).status == 403
    assert (
        browser.ask(*post, headers=cookie | {"Origin": "http://evil.example"}).status
        == 403
    )
    assert (
        browser.ask(*post, headers=cookie | {"Origin": f"http://{host}"}).status == 202
    )
    assert Client(served.client.base, "other" * 4).ask("/").status == 200
    assert list(served.jobs.root.glob(".*")) == []


def test_two_pages_on_one_computer_do_not_log_each_other_out(tmp_path: Path) -> None:
    """A browser sends the cookies of one port to all ports of a host."""
    with serving(tmp_path / "a") as one, serving(tmp_path / "b") as two:
        kept: dict[str, str] = {"other": '{"of": "another program"}'}
        for each in (one, two):
            link = HTTPConnection(each.service.access.hosts[0])
            link.request("GET", f"/?token={each.service.access.token}")
            told = link.getresponse().headers["Set-Cookie"]
            name, _, value = told.split(";")[0].partition("=")
            kept[name] = value
            link.close()
        header = "; ".join(f"{name}={value}" for name, value in kept.items())
        for each in (one, two):
            browser = Client(each.client.base, "")
            assert browser.ask("/", headers={"Cookie": header}).status == 200


def test_the_address_that_is_shown_can_be_opened(tmp_path: Path) -> None:
    """No browser elsewhere reaches 0.0.0.0, which is every address of a computer."""
    jobs, pool = (
        JobStore(tmp_path, BOUNDS),
        WorkerPool(lambda: ThreadPoolExecutor(1), 1),
    )
    queue = JobQueue(jobs, Database(tmp_path / "h"), pool)
    for names in ((), ("lab.example:8750",)):
        service = Service.listen("0.0.0.0", 0, jobs, queue, names=names)  # noqa: S104
        with service.socket:
            port = service.socket.getsockname()[1]
            first = names[0] if names else f"{local_address()}:{port}"
            assert service.address.startswith(f"http://{first}/?token=")
            assert f"localhost:{port}" in service.access.hosts


@pytest.mark.parametrize(
    ("query", "status"),
    [("", 400), ("?filename=..", 400), ("?filename=a/b", 400), ("?filename=.x", 400),
     ("?filename=x&output=/etc", 400), ("?filename=x&serial=", 400),
     ("?filename=x&serial=%0a", 400), (f"?filename={'x' * 101}", 400)],
)  # fmt: skip
def test_what_is_said_of_a_recording_is_checked(
    served: Served, query: str, status: int
) -> None:
    assert served.client.ask(f"/api/sessions{query}", b"x").status == status
    assert list(served.jobs.root.iterdir()) == []


def test_too_much_is_refused(served: Served) -> None:
    client = served.client
    assert client.send("x", b"x", "").status == 202
    large = {"Content-Length": str(BOUNDS.upload + 1)}
    assert client.ask("/api/sessions?filename=x", b"", headers=large).status == 413
    others = [client.send("x", b"x").status for _ in range(4)]
    assert others == [202, 202, 429, 429]
    served.task.may.set()
    for job in client.ask("/api/sessions").json:
        client.over(job["id"]) if client.ask(f"/api/sessions/{job['id']}") else None


@pytest.mark.parametrize("method", ["POST", "PUT"])
def test_a_body_in_pieces_has_to_say_its_length(served: Served, method: str) -> None:
    link = HTTPConnection(served.service.access.hosts[0])
    link.request(
        method, "/api/sessions?filename=x", iter([b"in", b"pieces"]),
        {"Authorization": f"Bearer {TOKEN}"}, encode_chunked=True,
    )  # fmt: skip
    answer = link.getresponse()
    assert answer.status == 411
    assert "say how long it is" in json.loads(answer.read())["error"]
    link.close()
    assert list(served.jobs.root.iterdir()) == []


def test_whatever_a_program_does_wrong_it_is_answered_an_object(
    served: Served,
) -> None:
    client, stranger = served.client, Client(served.client.base, "x" * 20)
    large = {"Content-Length": str(BOUNDS.upload + 1)}
    for answer, status, says in (
        (client.ask("/api/nowhere"), 404, "openapi.json"),
        (client.ask("/api/sessions", b"x", "PUT"), 405, "openapi.json"),
        (client.ask("/api/sessions?filename=x", b"", headers=large), 413, "19 MiB"),
        (stranger.ask("/api/sessions"), 403, "--tokens"),
        (Client(client.base, "").ask("/api/sessions"), 403, "Bearer"),
    ):
        assert answer.status == status and says in answer.json["error"]


def test_one_who_hangs_up_leaves_nothing(served: Served) -> None:
    host = served.service.access.hosts[0]
    link = HTTPConnection(host)
    link.putrequest("POST", "/api/sessions?filename=x")
    link.putheader("Authorization", f"Bearer {TOKEN}")
    link.putheader("Content-Length", "1000")
    link.endheaders(b"only this")
    until = time.monotonic() + HANGS
    while not list(served.jobs.root.glob(".*.part")) and time.monotonic() < until:
        time.sleep(0.01)
    link.close()
    while list(served.jobs.root.glob(".*.part")) and time.monotonic() < until:
        time.sleep(0.01)
    assert list(served.jobs.root.iterdir()) == []


def test_what_was_under_way_is_done_at_the_next_start(tmp_path: Path) -> None:
    with serving(tmp_path) as first:
        first.task.may.set()
        done = first.client.send("x", b"x").json["id"]
        first.client.over(done)
        job = first.jobs.get(done)
        assert job is not None
        first.jobs.update(job, state="working")
        (first.jobs.folder(done) / RESULTS_FOLDER / "report.html").unlink()
        (first.jobs.folder(done) / RESULTS_FOLDER).rmdir()
        (first.jobs.root / ".ab.part").mkdir()
    with serving(tmp_path) as second:
        second.task.may.set()
        assert second.client.over(done)["documents"] == ["report.html"]
        assert not list(second.jobs.root.glob(".*"))


def test_the_oldest_that_are_over_go_first(served: Served) -> None:
    served.task.may.set()
    numbers = []
    for _ in range(4):
        numbers.append(served.client.send("x", b"x").json["id"])
        served.client.over(numbers[-1])
    left = [job["id"] for job in served.client.ask("/api/sessions").json]
    assert left == numbers[:0:-1]


def test_openapi_says_what_there_is(served: Served) -> None:
    told = served.client.ask("/api/openapi.json").json
    assert told["openapi"].startswith("3.1")
    routes: dict[str, set[str]] = {}
    for route in _routes(served.service):
        if route.path.startswith("/api"):
            methods = {m.lower() for m in route.methods} - {"head"}
            routes.setdefault(route.path, set()).update(methods)
    there = {path: set(item) - {"parameters"} for path, item in told["paths"].items()}
    assert there == routes
    post = told["paths"]["/api/sessions"]["post"]
    assert {p["name"] for p in post["parameters"]} == {"filename", *IMPORT_OPTIONS}
    for path, item in told["paths"].items():
        named = {p["name"] for p in item.get("parameters", []) if p["in"] == "path"}
        assert named == set(re.findall(r"{(\w+)}", path))
    schema = told["components"]["schemas"]["Session"]
    job = served.client.send("x", b"x").json
    assert set(schema["properties"]) == set(job) == {*schema["required"], *job}


def _routes(service: Service) -> list[Any]:
    gate = service.server.config.app
    return list(gate._app.routes)  # type: ignore[union-attr]


def test_tokens_are_secret_and_long(tmp_path: Path) -> None:
    path = tmp_path / "t"
    path.write_text(f"# of the line\n{TOKEN}  # station A\n\n")
    path.chmod(0o600)
    assert read_tokens(path) == [TOKEN]
    path.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        read_tokens(path)
    path.chmod(0o600)
    for wrong in ("short", f"station-A-of-the-line {TOKEN}"):
        path.write_text(wrong)
        with pytest.raises(InputError, match="one token of 16 letters"):
            read_tokens(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="t: is no text, and no file of tokens"):
        read_tokens(path)
    with pytest.raises(InputError, match="none: cannot be read: No such file or dir"):
        read_tokens(tmp_path / "none")


def zipped(folder: Path) -> bytes:
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, f"{folder.name}/{file.name}")
    return path.read_bytes()


def test_a_process_of_its_own_serves_sessions_and_recordings(tmp_path: Path) -> None:
    held = places([(0.0, 0.0), (45.0, 5.0)], seconds=6.0, gap=6.0)
    block = recorded(Profile(), held, seed=1)
    device = {"serial": "A7"}
    session = write_session(tmp_path / "unit-7", block, held, device=device)
    tokens = tmp_path / "tokens"
    tokens.write_text(TOKEN + "\n")
    tokens.chmod(0o600)
    call = [*FIELDCAL, "serve", "--listen", "127.0.0.1:0", "--tokens", str(tokens),
            "--folder", str(tmp_path / "served"), "--history", str(tmp_path / "h"),
            "--minutes", "5"]  # fmt: skip
    with subprocess.Popen(call, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            address = process.stderr.readline().split()[1]
            client = Client(address.split("/?")[0])
            numbers = [
                client.send("unit-7.zip", zipped(session)).json["id"],
                client.send("unit.csv", b"no,recording\n1,2\n", "&serial=A8").json[
                    "id"
                ],
            ]
            good, bad = map(client.over, numbers)
            client.over(client.send("again.zip", zipped(session)).json["id"])
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(HANGS)
    assert good["state"] == "done" and good["good"] is True, good
    assert good["documents"] == sorted(openapi.DOCUMENT_TYPES)
    assert bad["state"] == "failed" and bad["error"] and bad["log"]
    assert str(tmp_path) not in bad["error"]
    made = tmp_path / "served" / numbers[0] / "results"
    result = json.loads((made / "result.json").read_text())
    measured = json.loads((made / "record.json").read_text())
    assert measured["dut_id"] == "A7" and measured["outcome"] == "PASS"
    x = measured["phases"][0]["measurements"]["acc_bias.x"]
    assert x["measured_value"] == result["parameters"]["acc_bias"]["value"][0]
    assert x["uncertainty"] > 0 and x["units"] == "m/s^2"
    suite = ElementTree.parse(made / "junit.xml").getroot()
    assert suite.get("errors") == "0"
    assert "acc bias" in (made / "report.html").read_text()
    for stored in Database(tmp_path / "h").run(sessions.find_sessions):
        assert stored.serial == "A7" and stored.good
    (run,) = History(tmp_path / "h").runs("A7")
    assert numbers[0] not in run.session, "uploaded again, it counts once"


@pytest.mark.thorough
def test_a_recording_is_imported_with_what_is_said_of_it(tmp_path: Path) -> None:
    held = places(FACES, seconds=6.0, gap=6.0)
    block = recorded(Profile(), held, seed=2)
    rows = [",".join(["t", "ax", "ay", "az", "gx", "gy", "gz"])]
    rows += [
        ",".join(f"{v:.9g}" for v in (t, *a, *g))
        for t, a, g in zip(block.t, block.acc, block.gyr, strict=True)
    ]
    jobs = JobStore(tmp_path / "jobs", BOUNDS)
    part = jobs.begin_upload()
    (part / "upload").mkdir()
    (part / "upload" / "log.csv").write_text("\n".join(rows))
    said = {"serial": "A9", "latitude": "50.45", "lot": "7", "acc_unit": "m/s^2",
            "gyr_unit": "rad/s", "time_unit": "s"}  # fmt: skip
    job = jobs.add_job(part, "log.csv", "2026-01-01", said)
    used = JobTask(BOUNDS)
    folder = str(jobs.folder(job.id))
    for _ in range(2):  # and once more, as after a start in the middle
        (made,) = run_tasks([folder], used, process_pool(1))
        one = made.value
        assert one is not None and one.error is None, one
        assert one.serial == "A9" and one.levels["lot"] == "7"
        assert jobs.documents(job.id) == sorted(openapi.DOCUMENT_TYPES)
        assert "acc_bias.x" in one.parameters
