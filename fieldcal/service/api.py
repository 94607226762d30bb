"""Answers of the service: sessions in, documents out."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from fieldcal.core.errors import FieldcalError
from fieldcal.run.page import server as page
from fieldcal.service import openapi
from fieldcal.service.jobs import NAME, RESULTS, UPLOAD, Job, Jobs
from fieldcal.service.queue import JobQueue
from fieldcal.service.work import OPTIONS, REPORT

FILES = Path(__file__).parent / "files"

OPTION = 200
"""Letters of an option's value."""

APART = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline';"
    " style-src 'unsafe-inline'; img-src data:; font-src data:"
)
"""A report has all in itself, and nothing of the page that it is opened from."""


class SessionsApi:
    """What is answered to each request for sessions.

    Parameters
    ----------
    jobs : that it takes in and shows
    queue : what does them

    """

    def __init__(self, jobs: Jobs, queue: JobQueue) -> None:
        self.jobs, self.queue = jobs, queue

    def shown(self, job: Job) -> dict[str, Any]:
        """A job as it is told."""
        return {**asdict(job), "documents": self.jobs.documents(job.id)}

    async def every(self, _: Request) -> Response:
        """All of them."""
        some = await run_in_threadpool(self.jobs.all)
        return JSONResponse([self.shown(job) for job in some])

    async def sent(self, request: Request) -> Response:
        """Take one in."""
        said = dict(request.query_params)
        name = said.pop("filename", "")
        if refusal := _refusal(name, said):
            return _error(400, refusal)
        if not await run_in_threadpool(self.jobs.room):
            return _error(429, "too many recordings wait already: send it again later")
        part = await run_in_threadpool(self.jobs.begun)
        try:
            (part / UPLOAD).mkdir()
            with (part / UPLOAD / name).open("xb") as file:
                async for piece in request.stream():
                    await run_in_threadpool(file.write, piece)
            now = datetime.now(UTC).isoformat()
            job = await run_in_threadpool(self.jobs.added, part, name, now, said)
        except FieldcalError as error:
            shutil.rmtree(part, ignore_errors=True)
            return _error(429, str(error))
        except OSError as error:
            shutil.rmtree(part, ignore_errors=True)
            return _error(507, f"it cannot be kept: {error.strerror}")
        except ClientDisconnect:
            shutil.rmtree(part, ignore_errors=True)
            return Response(status_code=400)
        self.queue.come()
        return JSONResponse(self.shown(job), 202)

    async def one(self, request: Request) -> Response:
        """How far one is."""
        job = self.jobs.get(request.path_params["id"])
        return JSONResponse(self.shown(job)) if job else _missing()

    async def removed(self, request: Request) -> Response:
        """Take one away."""
        number = request.path_params["id"]
        found = await run_in_threadpool(self.jobs.removed, number)
        return Response(status_code=204) if found else _missing()

    async def document(self, request: Request) -> Response:
        """What was made of one."""
        number, name = (request.path_params[k] for k in ("id", "document"))
        if self.jobs.get(number) is None or name not in self.jobs.documents(number):
            return _missing()
        more = {"content-security-policy": APART} if name == REPORT else {}
        path = self.jobs.folder(number) / RESULTS / name
        return FileResponse(path, media_type=openapi.DOCUMENTS[name], headers=more)


async def _described(_: Request) -> Response:
    return JSONResponse(openapi.document())


def _file(path: Path) -> Route:
    async def given(_: Request) -> Response:
        return FileResponse(path)

    return Route("/" if path.suffix == ".html" else f"/{path.name}", given)


def app(jobs: Jobs, queue: JobQueue) -> Starlette:
    """Return the application.

    Parameters
    ----------
    jobs : that it takes in and shows
    queue : what does them

    """
    api = SessionsApi(jobs, queue)
    return Starlette(
        routes=[
            Route(openapi.SESSIONS, api.every),
            Route(openapi.SESSIONS, api.sent, methods=["POST"]),
            Route(openapi.ONE, api.one),
            Route(openapi.ONE, api.removed, methods=["DELETE"]),
            Route(openapi.DESCRIPTION, _described),
            Route(openapi.DOCUMENT, api.document),
            *(_file(path) for path in sorted(FILES.iterdir())),
            _file(page.FILES / "page.css"),
        ]
    )


def _refusal(name: str, said: dict[str, str]) -> str:
    """Why what is said of a recording is nothing; empty where it is something."""
    if not NAME.fullmatch(name):
        return "filename is wanted: letters, digits, dots and dashes, no folder"
    for key, value in said.items():
        if key not in OPTIONS:
            return f"there is no option of this name; there are {', '.join(OPTIONS)}"
        if not value or len(value) > OPTION or not value.isprintable():
            return f"{key}: is empty, too long or no text"
    return ""


def _error(status: int, says: str) -> Response:
    return JSONResponse({"error": says}, status)


def _missing() -> Response:
    return _error(404, "there is none of this id")
