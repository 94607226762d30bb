"""Integrity of a session folder: each file against its checksums and its schema.

The JSON Schemas are in ``schemas/``, one for each kind of file, for other programs too;
session.toml is checked after parsing, marks.jsonl line by line.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from fieldcal.calibration import Calibration
from fieldcal.core.documents import load_json
from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.file_names import refuse_undecodable_path
from fieldcal.session import description_file, sample_files
from fieldcal.session.folder import DESCRIPTION, RESULT
from fieldcal.session.marks import MARKS, read_marks
from fieldcal.session.schemas import validator

DIAGNOSIS = "diagnosis.json"

SCHEMAS = {MARKS: "mark", RESULT: "result", DIAGNOSIS: "diagnosis"}
"""Schema of each file; that of session.toml is checked by `description`."""


class FileFault(NamedTuple):
    """A fault of a file.

    Attributes
    ----------
    file : its name in the folder
    text : what, where, and what is done about it

    """

    file: str
    text: str


def file_faults(folder: Path) -> Iterator[FileFault]:
    """Faults of a session, file by file; none if it is intact.

    Raises
    ------
    SessionError
        If there is no session.toml, or the path is not UTF-8.

    """
    refuse_undecodable_path(folder)
    yield from _description(folder)
    yield from _samples(folder)
    yield from _marks(folder / MARKS)
    for name in (RESULT, DIAGNOSIS):
        if (folder / name).exists():
            yield from _derived_file(folder / name)
    for path in sorted(folder.glob(".*.*")):
        if path.is_file():
            text = "was left by a program that was killed while it wrote; delete it"
            yield FileFault(path.name, text)


def _description(folder: Path) -> Iterator[FileFault]:
    path = folder / DESCRIPTION
    try:
        description_file.read_description(path)
    except SessionError as error:
        if not path.exists():
            raise
        yield FileFault(DESCRIPTION, _without(path, str(error)))


def _samples(folder: Path) -> Iterator[FileFault]:
    try:
        path = sample_files.find_samples(folder)
    except SessionError as error:
        yield FileFault("samples", _without(folder, str(error)))
        return
    try:
        says = sample_files.read_samples(path).warnings
    except SessionError as error:
        yield FileFault(path.name, _without(path, str(error)))
        return
    yield from (FileFault(path.name, _without(Path(path.name), text)) for text in says)


def _marks(path: Path) -> Iterator[FileFault]:
    says: list[str] = []
    marks = list(read_marks(path, says))
    yield from (FileFault(MARKS, _without(Path(MARKS), text)) for text in says)
    for number, mark in enumerate(marks, start=1):
        yield from _schema_faults(MARKS, mark, f"mark {number}, ")


def _derived_file(path: Path) -> Iterator[FileFault]:
    try:
        document = load_json(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        yield FileFault(path.name, f"is not JSON: {error}; make it again")
        return
    wrong = list(_schema_faults(path.name, document, ""))
    yield from wrong
    if path.name == RESULT and not wrong:
        try:
            Calibration.from_json(document)
        except InputError as error:
            yield FileFault(path.name, f"{error}; make it again")


def _schema_faults(name: str, document: Any, place: str) -> Iterator[FileFault]:
    for error in validator(SCHEMAS[name]).iter_errors(document):
        text = f"{place}{_path(error.absolute_path)}: {_short(error.message)}"
        yield FileFault(name, text)


def _path(parts: Any) -> str:
    return ".".join(str(part) for part in parts) or "the whole"


def _short(text: str) -> str:
    return text if len(text) < 120 else f"{text[:60]} … {text[-50:]}"


def _without(path: Path, text: str) -> str:
    """Remove the name of the file from the beginning of a sentence."""
    return text.removeprefix(f"{path}: ").removeprefix(f"{path} ")
