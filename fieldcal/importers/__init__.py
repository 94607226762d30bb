"""Recordings of others made into sessions, one format a file.

To add one, write importers/<name>.py with ``WHAT`` (a line for the help),
``recognises(head, path)``, which judges a file by its first bytes, and a subclass of
`fieldcal.importing.recording.Recording`. Nothing is guessed in silence: units and the
sensor of several are named by the file or the user, or it is said what was taken.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from shlex import quote

from fieldcal.core.errors import InputError
from fieldcal.core.file_names import refuse_undecodable_path
from fieldcal.core.plugins import module_names, plugin_class
from fieldcal.drivers import codec
from fieldcal.importing.files.packed_stream import first_bytes
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.session.folder import DESCRIPTION

TRIED_LAST = ("csv_like", "wire")
"""Formats without a mark of their own, tried last, in this order."""

UNPACKED = "phone_zip"
"""Format of which a folder may hold the files."""

SHOWN = 6
"""Files of another folder that are named."""

TIMES = "timestamps.txt"
"""File by which a folder of samples is read."""

PROBE_BYTES = 1 << 16
"""Bytes by which formats without a mark of their own are told."""


@cache
def formats() -> tuple[str, ...]:
    """Names of the formats there are, those with a mark of their own first."""
    return (*(n for n in module_names(__path__) if n not in TRIED_LAST), *TRIED_LAST)


def open_recording(
    path: Path, wanted: ReadOptions, name: str = "", repair: bool = False
) -> Recording:
    """Open a file by its content.

    Parameters
    ----------
    path : also .gz
    wanted : what the user says of it
    name : its format, if it is not to be found; or the wire format of its bytes
    repair : whether damaged places are left out and said, or refused

    Raises
    ------
    InputError
        If it cannot be read, its path is not UTF-8, or nothing knows its format.

    """
    if name in codec.wire_formats():
        more = f"&{wanted.options}" if wanted.options else ""
        wanted = replace(wanted, options=f"format={name}{more}")
        name = "wire"
    if name and name not in formats():
        known = (*formats(), *codec.wire_formats())
        raise InputError(f"no format {name!r}: there are {', '.join(known)}")
    if (path / TIMES).is_file():
        path = path / TIMES
    if path.is_dir():
        return _open_folder(path, wanted, repair)
    if path.is_char_device():
        raise InputError(f"{path}: is a device and has no end; name a file")
    if path.is_fifo():
        raise InputError(
            f"{path}: is a pipe, and a recording is read more than once; write what"
            " comes through it to a file"
        )
    refuse_undecodable_path(path)
    first = first_bytes(path)
    if not first:
        raise InputError(f"{path}: is empty; copy it again from where it came")
    for some in [name] if name else formats():
        module = import_module(f"{__name__}.{some}")
        if some == TRIED_LAST[0]:
            # what a device says while it starts may stand before the first frame
            first = first_bytes(path, PROBE_BYTES)
        if name or module.recognises(first, path):
            opened = plugin_class(module.__name__, Recording)  # type: ignore[type-abstract]
            return opened(path, wanted, repair)
    raise InputError(
        f"{path}: is of no format that is known by its content: name one with"
        f" fieldcal import --format {'|'.join(formats())}"
    )


def _open_folder(path: Path, wanted: ReadOptions, repair: bool) -> Recording:
    """Open a folder of a telephone's files, one for each sensor.

    Raises
    ------
    InputError
        Of another folder, with what is in it.

    """
    module = import_module(f"{__name__}.{UNPACKED}")
    if module.is_unpacked(path):
        opened = plugin_class(module.__name__, Recording)  # type: ignore[type-abstract]
        return opened(path, wanted, repair)
    if (path / DESCRIPTION).is_file():
        raise InputError(
            f"{path}: is a session already, nothing is left to import; go on with"
            f" fieldcal solve {quote(str(path))}"
        )
    names = [str(path / name) for name in module.member_names(path)[:SHOWN]]
    there = f", such as {' or '.join(names)}" if names else ""
    raise InputError(f"{path}: is a folder; name the recording in it{there}")
