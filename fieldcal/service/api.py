"""Request handlers of the service: receive sessions, return documents."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from fieldcal.core.errors import FieldcalError
from fieldcal.core.escaping import escape_line
from fieldcal.run.page import server as page
from fieldcal.service import openapi
from fieldcal.service.jobs import (
    FILE_NAME,
    RESULTS_FOLDER,
    UPLOAD_FOLDER,
    Job,
    JobStore,
)
from fieldcal.service.queue import JobQueue
from fieldcal.service.work import IMPORT_OPTIONS, REPORT_FILE

FILES = Path(__file__).parent / "files"

LONGEST_KEY = 40
"""Largest length of an unknown option's name that is repeated, characters."""

LONGEST_OPTION = 200
"""Largest length of an option's value, characters."""

REPORT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline';"
    " style-src 'unsafe-inline'; img-src data:; font-src data:"
)
"""Content security policy of a report: it is isolated from the service's page."""


class SessionsApi:
    """Handlers of the requests for sessions.

    Parameters
    ----------
    jobs : the jobs to add to and to show
    queue : carries out the jobs

    """

    def __init__(self, jobs: JobStore, queue: JobQueue) -> None:
        self.jobs, self.queue = jobs, queue

    def job_document(self, job: Job) -> dict[str, Any]:
        """JSON object of a job."""
        return {**asdict(job), "documents": self.jobs.documents(job.id)}

    async def list_jobs(self, _: Request) -> Response:
        """All jobs."""
        some = await run_in_threadpool(self.jobs.all)
        return JSONResponse([self.job_document(job) for job in some])

    async def receive_upload(self, request: Request) -> Response:
        """Receive an upload, and add a job for it."""
        said = dict(request.query_params)
        name = said.pop("filename", "")
        if refusal := _request_fault(name, said):
            return _error_response(400, refusal)
        if not await run_in_threadpool(self.jobs.has_room):
            return _error_response(
                429, "too many recordings wait already: send it again later"
            )
        part = await run_in_threadpool(self.jobs.begin_upload)
        try:
            (part / UPLOAD_FOLDER).mkdir()
            with (part / UPLOAD_FOLDER / name).open("xb") as file:
                async for piece in request.stream():
                    await run_in_threadpool(file.write, piece)
            now = datetime.now(UTC).isoformat()
            job = await run_in_threadpool(self.jobs.add_job, part, name, now, said)
        except FieldcalError as error:
            shutil.rmtree(part, ignore_errors=True)
            return _error_response(429, str(error))
        except OSError as error:
            shutil.rmtree(part, ignore_errors=True)
            return _error_response(507, f"it cannot be kept: {error.strerror}")
        except ClientDisconnect:
            shutil.rmtree(part, ignore_errors=True)
            return Response(status_code=400)
        self.queue.notify()
        return JSONResponse(self.job_document(job), 202)

    async def get_job(self, request: Request) -> Response:
        """State of a job."""
        job = self.jobs.get(request.path_params["id"])
        return JSONResponse(self.job_document(job)) if job else _not_found()

    async def delete_job(self, request: Request) -> Response:
        """Delete a job, with its files and its result in the store."""
        number = request.path_params["id"]
        try:
            found = await run_in_threadpool(self.queue.delete, number)
        except FieldcalError:
            return _error_response(
                503, "its result cannot be taken out of the store now: try again later"
            )
        return Response(status_code=204) if found else _not_found()

    async def get_document(self, request: Request) -> Response:
        """A document of a job."""
        number, name = (request.path_params[k] for k in ("id", "document"))
        if self.jobs.get(number) is None or name not in self.jobs.documents(number):
            return _not_found()
        more = {"content-security-policy": REPORT_POLICY} if name == REPORT_FILE else {}
        path = self.jobs.folder(number) / RESULTS_FOLDER / name
        return FileResponse(path, media_type=openapi.DOCUMENT_TYPES[name], headers=more)


async def _describe(_: Request) -> Response:
    return JSONResponse(openapi.openapi_document())


async def _explain_unknown_request(_: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 500
    return _error_response(
        status,
        f"there is no such path or request; {openapi.DESCRIPTION_PATH} lists them",
    )


def _file_route(path: Path) -> Route:
    async def given(_: Request) -> Response:
        return FileResponse(path)

    return Route("/" if path.suffix == ".html" else f"/{path.name}", given)


def create_app(jobs: JobStore, queue: JobQueue) -> Starlette:
    """Return the application.

    Parameters
    ----------
    jobs : the jobs to add to and to show
    queue : carries out the jobs

    """
    api = SessionsApi(jobs, queue)
    return Starlette(
        routes=[
            Route(openapi.SESSIONS_PATH, api.list_jobs),
            Route(openapi.SESSIONS_PATH, api.receive_upload, methods=["POST"]),
            Route(openapi.SESSION_PATH, api.get_job),
            Route(openapi.SESSION_PATH, api.delete_job, methods=["DELETE"]),
            Route(openapi.DESCRIPTION_PATH, _describe),
            Route(openapi.DOCUMENT_PATH, api.get_document),
            *(_file_route(path) for path in sorted(FILES.iterdir())),
            _file_route(page.FILES / "page.css"),
        ],
        exception_handlers={HTTPException: _explain_unknown_request},
    )


def _shown(key: str) -> str:
    """The beginning of a text of a request, as it can be displayed."""
    return escape_line(key[:LONGEST_KEY])


def _request_fault(name: str, said: dict[str, str]) -> str:
    """Fault in the file name and options of an upload; empty if there is none."""
    if not FILE_NAME.fullmatch(name):
        return (
            "filename is wanted: letters, digits, dots and dashes, 100 at most, no"
            " folder"
        )
    for key, value in said.items():
        if key not in IMPORT_OPTIONS:
            known = ", ".join(IMPORT_OPTIONS)
            return f"{_shown(key)}: there is no option of this name; there are {known}"
        if not value or len(value) > LONGEST_OPTION or not value.isprintable():
            return f"{key}: is empty, too long or no text"
    return ""


def _error_response(status: int, says: str) -> Response:
    return JSONResponse({"error": says}, status)


def _not_found() -> Response:
    return _error_response(404, "there is none of this id")
