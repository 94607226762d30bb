"""Recordings of others made into sessions, one format a file.

To add one, write importers/<name>.py with ``WHAT`` (a line for the help),
``recognises(head, path)``, which judges a file by its first bytes, and a subclass of
`recording.Recording` called ``File``. Nothing is guessed in silence: units and the
sensor of several are named by the file, or by the user.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from fieldcal.core.errors import InputError
from fieldcal.importing.gzip_stream import head
from fieldcal.importing.recording import ReadOptions, Recording

LAST = ("csv_like", "wire")
"""Formats without a mark of their own, tried last, in this order."""


@cache
def formats() -> tuple[str, ...]:
    """Names of the formats there are, those with a mark of their own first."""
    names = sorted(module.name for module in iter_modules(__path__))
    return (*(n for n in names if n not in LAST), *LAST)


def open_recording(
    path: Path, wanted: ReadOptions, name: str = "", repair: bool = False
) -> Recording:
    """Open a file by its content.

    Parameters
    ----------
    path : also .gz
    wanted : what the user says of it
    name : its format, if it is not to be found
    repair : whether damaged places are left out and said, or refused

    Raises
    ------
    InputError
        If it cannot be read, or nothing knows its format.

    """
    if name and name not in formats():
        raise InputError(f"no format {name!r}: there are {', '.join(formats())}")
    first = head(path)
    if not first:
        raise InputError(f"{path}: is empty; copy it again from where it came")
    for some in [name] if name else formats():
        module = import_module(f"{__name__}.{some}")
        if name or module.recognises(first, path):
            opened: Recording = module.File(path, wanted, repair)
            return opened
    raise InputError(
        f"{path}: is of no format that is known by its content: name one with --format"
        f" {'|'.join(formats())}"
    )
