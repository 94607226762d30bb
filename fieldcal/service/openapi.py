"""OpenAPI 3.1 description of the service."""

from __future__ import annotations

from typing import Any

from fieldcal.core.version import __version__
from fieldcal.service.work import IMPORT_OPTIONS, JUNIT_FILE, RECORD_FILE, REPORT_FILE
from fieldcal.session.folder import RESULT
from fieldcal.session.integrity import DIAGNOSIS

SESSIONS_PATH, SESSION_PATH = "/api/sessions", "/api/sessions/{id}"
DOCUMENT_PATH, DESCRIPTION_PATH = "/api/sessions/{id}/{document}", "/api/openapi.json"

DOCUMENT_TYPES = {
    RESULT: "application/json",
    DIAGNOSIS: "application/json",
    REPORT_FILE: "text/html",
    JUNIT_FILE: "application/xml",
    RECORD_FILE: "application/json",
}
"""Documents of a session, with their media types."""

TEXT_SCHEMA = {"type": ["string", "null"]}
BOOLEAN_SCHEMA = {"type": ["boolean", "null"]}

JOB_SCHEMA = {
    "type": "object",
    "required": ["id", "name", "received_at", "state", "documents"],
    "properties": {
        "id": {"type": "string"},
        "name": {"type": "string"},
        "received_at": {"type": "string", "format": "date-time"},
        "state": {"enum": ["waiting", "working", "done", "failed"]},
        "options": {"type": "object", "additionalProperties": {"type": "string"}},
        "error": TEXT_SCHEMA,
        "go": BOOLEAN_SCHEMA,
        "good": BOOLEAN_SCHEMA,
        "verdict": TEXT_SCHEMA,
        "log": {"type": "string"},
        "documents": {"type": "array", "items": {"enum": list(DOCUMENT_TYPES)}},
    },
}


def _answer(what: str, schema: dict[str, Any] | None = None) -> dict[str, Any]:
    out: dict[str, Any] = {"description": what}
    if schema is not None:
        out["content"] = {"application/json": {"schema": schema}}
    return out


def _upload_operation(job: dict[str, Any]) -> dict[str, Any]:
    """OpenAPI operation for an upload."""
    said = [
        {
            "name": name, "in": "query", "schema": {"type": "string"},
            "description": f"{option} of fieldcal import; of recordings only",
        }
        for name, option in IMPORT_OPTIONS.items()
    ]  # fmt: skip
    named = {
        "name": "filename", "in": "query", "required": True,
        "schema": {"type": "string"},
        "description": "name of the file, by whose ending some formats are known",
    }  # fmt: skip
    body = {"application/octet-stream": {"schema": {"type": "string"}}}
    return {
        "summary": "Send a session (.zip of its folder) or a recording that fieldcal"
        " import reads.",
        "parameters": [named, *said],
        "requestBody": {"required": True, "content": body},
        "responses": {
            "202": _answer("Taken in; it waits.", job),
            "400": _answer("A name or an option is none."),
            "411": _answer("Its length is not said."),
            "413": _answer("It is too large."),
            "429": _answer("Too many wait already."),
            "507": _answer("It cannot be kept: the disk is full."),
        },
    }


def openapi_document() -> dict[str, Any]:
    """Return the OpenAPI document."""
    job = {"$ref": "#/components/schemas/Session"}
    missing = {"404": _answer("There is none of this id.")}
    one = {"name": "id", "in": "path", "required": True, "schema": {"type": "string"}}
    kinds: dict[str, Any] = {kind: {"schema": {}} for kind in DOCUMENT_TYPES.values()}
    wanted = {
        "name": "document", "in": "path", "required": True,
        "schema": {"enum": list(DOCUMENT_TYPES)},
    }  # fmt: skip
    found = {"200": {"description": "The document.", "content": kinds}, **missing}
    every = {"type": "array", "items": job}
    return {
        "openapi": "3.1.0",
        "info": {"title": "fieldcal", "version": __version__},
        "security": [{"token": []}],
        "paths": {
            SESSIONS_PATH: {
                "get": {"summary": "All sessions, the latest first.",
                        "responses": {"200": _answer("The sessions.", every)}},
                "post": _upload_operation(job),
            },
            SESSION_PATH: {
                "parameters": [one],
                "get": {"summary": "How far a session is.",
                        "responses": {"200": _answer("The session.", job), **missing}},
                "delete": {"summary": "Take a session away with all that is its.",
                           "responses": {"204": _answer("It is gone."), **missing,
                                         "503": _answer("The store is away.")}},
            },
            DOCUMENT_PATH: {
                "parameters": [one, wanted],
                "get": {"summary": "What was made of a session.", "responses": found},
            },
            DESCRIPTION_PATH: {
                "get": {"summary": "This document.",
                        "responses": {"200": _answer("OpenAPI 3.1.", {})}},
            },
        },
        "components": {
            "schemas": {"Session": JOB_SCHEMA},
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }  # fmt: skip
