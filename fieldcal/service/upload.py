"""An archive that somebody sent becomes a session folder, or is refused.

Nothing in it is trusted: names go nowhere but into the folder, sizes are counted while
they come out, and whatever is no plain file is refused.
"""

from __future__ import annotations

import stat
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_line
from fieldcal.service.bounds import MIB, Bounds
from fieldcal.session import description
from fieldcal.session.folder import DESCRIPTION

PIECE = MIB


def members(path: Path, bounds: Bounds) -> list[zipfile.ZipInfo]:
    """Files of an archive; empty where it is none.

    Raises
    ------
    InputError
        If it has too many, they are too large, or one is no plain file.

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
    """Files of a session by their names; None where the archive is none.

    All of them lie in one folder, at the top or below.

    Raises
    ------
    InputError
        If a name leads anywhere else.

    """
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
        if path.name.startswith("."):
            continue  # of the system it was packed on
        if path.name in out:
            raise InputError(f"{escape_line(path.name)}: is in the archive twice")
        out[path.name] = one
    return out


def unpack(
    path: Path, files: Mapping[str, zipfile.ZipInfo], folder: Path, bounds: Bounds
) -> None:
    """Write the files of a session into a folder that is new.

    Raises
    ------
    InputError
        If they are larger than they say, damaged, or want other files of this computer.

    """
    folder.mkdir()
    left = bounds.unpacked
    try:
        with zipfile.ZipFile(path) as archive:
            for name, one in files.items():
                with archive.open(one) as source, (folder / name).open("xb") as out:
                    while piece := source.read(PIECE):
                        left -= len(piece)
                        if left < 0:
                            raise InputError(
                                f"{escape_line(name)}: is larger than the archive says"
                            )
                        out.write(piece)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
        raise InputError(f"the archive is damaged: {error}; send it again") from error
    about = description.read_description(folder / DESCRIPTION)
    run = about.raw.get("run")
    if isinstance(run, Mapping) and "limits" in run:
        raise InputError(
            f"{DESCRIPTION}: limits under [run] name a file of this computer: leave"
            " them out, the grade has its own"
        )
