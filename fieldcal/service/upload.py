"""Unpacks an uploaded archive into a session folder, or refuses it.

Nothing in it is trusted: files are written to the folder only, sizes are counted while
unpacking, and anything but a plain file is refused.
"""

from __future__ import annotations

import stat
import zipfile
import zlib
from collections.abc import Mapping
from lzma import LZMAError
from pathlib import Path, PurePosixPath

from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line
from fieldcal.service.bounds import MIB, ServiceBounds
from fieldcal.session import description_file
from fieldcal.session.folder import DESCRIPTION

BYTES_AT_ONCE = MIB

DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    LZMAError,
    EOFError,
    NotImplementedError,
)
"""Errors of an archive whose files cannot be unpacked."""

OF_MACOS = "__MACOSX/"
"""Folder at the top in which macOS packs properties of the files."""

LONGEST_NAME = 100
"""Largest length of the name of a file in an archive, characters."""


def archive_members(path: Path, bounds: ServiceBounds) -> list[zipfile.ZipInfo]:
    """Files in an archive; empty if the file is no archive.

    Raises
    ------
    InputError
        If it has too many files, they are too large, or one is no plain file.

    """
    if not zipfile.is_zipfile(path):
        return []
    try:
        with zipfile.ZipFile(path) as archive:
            found = [one for one in archive.infolist() if not one.is_dir()]
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise InputError(
            f"the archive cannot be read: {error}; make it again"
        ) from error
    if len(found) > bounds.members:
        raise InputError(
            f"the archive has {len(found)} files, {bounds.members} are taken: send one"
            " session"
        )
    total = sum(one.file_size for one in found)
    if total > bounds.unpacked:
        raise InputError(
            f"the archive would be {total // MIB} MiB unpacked,"
            f" {bounds.unpacked // MIB} are taken: send one session"
        )
    for one in found:
        kind = stat.S_IFMT(one.external_attr >> 16)
        if kind not in (0, stat.S_IFREG) or one.flag_bits & 1:
            raise InputError(
                f"{escape_line(one.filename)}: is a link, encrypted or no file: pack"
                " the plain files of a session"
            )
    return found


def session_members(
    found: list[zipfile.ZipInfo],
) -> Mapping[str, zipfile.ZipInfo] | None:
    """Files of a session by name; None if the archive has no session.

    All files must be in one folder, at the top or below, but for those that macOS adds.

    Raises
    ------
    InputError
        If a file is in another folder, or a name is too long.

    """
    found = [one for one in found if not one.filename.startswith(OF_MACOS)]
    named = [one for one in found if PurePosixPath(one.filename).name == DESCRIPTION]
    if not named:
        return None
    if len(named) > 1:
        raise InputError("the archive has several sessions: send one at a time")
    top = PurePosixPath(named[0].filename).parent
    out: dict[str, zipfile.ZipInfo] = {}
    for one in found:
        path = PurePosixPath(one.filename)
        plain = path.name and not {"\\", ":"} & {*one.filename}
        if path.parent != top or path.is_absolute() or ".." in path.parts or not plain:
            raise InputError(
                f"{escape_line(one.filename)}: does not lie beside {DESCRIPTION}: pack"
                " the files of the session's folder and nothing else"
            )
        if len(path.name) > LONGEST_NAME:
            raise InputError(
                f"{escape_line(path.name[:LONGEST_NAME])}…: the name is longer than"
                f" {LONGEST_NAME} characters: rename that file"
            )
        if path.name.startswith("."):
            continue  # files of the operating system
        if path.name in out:
            raise InputError(f"{escape_line(path.name)}: is in the archive twice")
        out[path.name] = one
    return out


def unpack(
    path: Path,
    files: Mapping[str, zipfile.ZipInfo],
    folder: Path,
    bounds: ServiceBounds,
) -> None:
    """Write the files of a session to a new folder.

    Raises
    ------
    InputError
        If they are larger than stated, damaged, or refer to other files of this
        computer.

    """
    folder.mkdir()
    left = bounds.unpacked
    try:
        with zipfile.ZipFile(path) as archive:
            for name, one in files.items():
                with archive.open(one) as source, (folder / name).open("xb") as out:
                    while piece := source.read(BYTES_AT_ONCE):
                        left -= len(piece)
                        if left < 0:
                            raise InputError(
                                f"{escape_line(name)}: is larger than the archive says"
                            )
                        out.write(piece)
    except DAMAGED as error:
        raise InputError(f"the archive is damaged: {error}; send it again") from error
    except OSError as error:
        if error.errno is None:  # of bz2, and no fault of this computer
            raise InputError(
                f"the archive is damaged: {error}; send it again"
            ) from error
        raise InputError(
            f"the archive cannot be unpacked: {error.strerror}; send it again later"
        ) from error
    about = description_file.read_description(folder / DESCRIPTION)
    run = about.raw.get("run")
    if isinstance(run, Mapping) and "limits" in run:
        raise InputError(
            f"{DESCRIPTION}: limits under [run] name a file of this computer: leave"
            " them out, the grade has its own"
        )
