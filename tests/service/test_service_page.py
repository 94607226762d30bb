"""The service's page in Chromium: what is sent there is done and shown."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from browser import Screen
from processes import HANGS
from test_service import BOUNDS, Held

from fieldcal.fleet.workers import WorkerPool
from fieldcal.history.database import Database
from fieldcal.report.browser import find_browser
from fieldcal.service.jobs import JobStore
from fieldcal.service.queue import JobQueue
from fieldcal.service.server import Service

pytestmark = pytest.mark.skipif(
    find_browser() is None, reason="there is no Chromium to show the page in"
)

SEND = """(async () => {
  const list = new DataTransfer();
  list.items.add(new File(["%s"], "../<b>unit</b>" + " 7".repeat(60) + " unit.csv"));
  document.getElementById("file").files = list.files;
  document.getElementById("send").requestSubmit();
})()"""


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    jobs, task = JobStore(tmp_path / "jobs", BOUNDS), Held()
    task.may.set()
    pool = WorkerPool(lambda: ThreadPoolExecutor(1), 1)
    with JobQueue(jobs, Database(tmp_path / "h"), pool, task) as queue:
        service = Service.listen("127.0.0.1", 0, jobs, queue)
        thread = threading.Thread(target=service.serve)
        thread.start()
        yield service.address
        service.server.should_exit = True
        thread.join(HANGS)


def test_what_is_sent_from_the_page_is_done_and_shown(address: str) -> None:
    with Screen() as screen:
        screen.go(address)
        screen.until("document.getElementById('go')?.disabled === false")
        for content, said in (("t,ax", "done"), ("bad", "failed: is bad")):
            screen.value(SEND % content)
            script = f"document.getElementById('rows').textContent.includes('{said}')"
            screen.until(script)
        shown = screen.text("rows")
        assert "GO" in shown and "report.html" in shown and "unit" in shown
        assert screen.value("document.querySelectorAll('#rows b').length") == 0


def test_that_the_service_was_not_reached_is_said_until_it_is_again(
    address: str,
) -> None:
    said = "document.getElementById('said').textContent"
    with Screen() as screen:
        screen.go(address)
        screen.until("document.getElementById('go')?.disabled === false")
        screen.value("window.kept = fetch; window.fetch = () => Promise.reject('x'); 1")
        screen.value("look(); 1")
        screen.until(f"{said}.includes('not reached')")
        screen.value("window.fetch = window.kept; look(); 1")
        screen.until(f"{said} === ''")
        assert not screen.text("said")


def test_why_something_is_refused_is_said_as_a_sentence(address: str) -> None:
    said = "document.getElementById('said').textContent"
    answers = "window.fetch = () => Promise.resolve(new Response(%s, {status: %d})); 1"
    with Screen() as screen:
        screen.go(address)
        screen.until("document.getElementById('go')?.disabled === false")
        screen.value("window.kept = fetch; 1")
        screen.value(answers % ("'refused: open the address'", 403))
        screen.value("look(); 1")
        screen.until(f"{said} === 'refused: open the address'")
        screen.value("window.fetch = window.kept; look(); 1")
        screen.until(f"{said} === ''")
        no = """Promise.resolve(new Response('{"error": "too many"}', {status: 429}))"""
        screen.value(
            f"window.fetch = (u) => u === 'api/sessions' ? window.kept(u) : {no}; 1"
        )
        screen.value(SEND % "t,ax")
        screen.until(f"{said} === 'too many'")
        assert screen.text("said") == "too many"
