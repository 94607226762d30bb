"""One writer per session: the recorder holds a lock of the folder until the end.

The lock is one of the operating system, so that it ends with the process in any case. A
file beside it states which process holds the lock, and since when.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from datetime import datetime
from getpass import getuser
from pathlib import Path
from platform import node
from time import time

from filelock import FileLock, Timeout

from fieldcal.core.errors import SessionInUse

LOCK, OWNER = ".lock", ".owner"


class SessionLock:
    """The lock of a session folder, held from the beginning until `release`.

    Parameters
    ----------
    folder : an existing folder

    Raises
    ------
    SessionInUse
        If another process holds it; the text states which, and since when.
    OSError
        If the folder cannot be written.

    """

    def __init__(self, folder: Path) -> None:
        self._owner = folder / OWNER
        self._path = folder / LOCK
        self._lock = FileLock(self._path)
        try:
            self._lock.acquire(blocking=False)
        except Timeout as error:
            raise SessionInUse(
                f"{folder}: {_holder(self._owner)} records into it: end that run first,"
                " or name another folder"
            ) from error
        except NotImplementedError:
            # a file system without locks: O_EXCL of the files remains
            return
        who = {"pid": os.getpid(), "host": node(), "user": _user(), "host_s": time()}
        try:
            self._owner.write_text(json.dumps(who) + "\n", "utf-8")
        except OSError:
            self.release()
            raise

    def release(self) -> None:
        """Release the lock; safe to call twice."""
        if self._lock.is_locked:
            with suppress(OSError):
                self._owner.unlink(missing_ok=True)
                self._path.unlink(missing_ok=True)
            with suppress(OSError):
                self._lock.release()


def refuse_in_use(folder: Path) -> None:
    """Refuse a session that another process records into; nothing is left behind.

    Whether it can be written at all is for whoever writes it to find out.

    Raises
    ------
    SessionInUse
        If another process holds its lock.

    """
    if (folder / LOCK).exists():
        with suppress(OSError):
            SessionLock(folder).release()


def _user() -> str:
    try:
        return getuser()
    except (KeyError, OSError, ImportError):
        return "?"


def _holder(owner: Path) -> str:
    """Holder of a lock, as far as it is known."""
    try:
        held = json.loads(owner.read_text("utf-8"))
        since = datetime.fromtimestamp(float(held["host_s"])).astimezone()
        who = f"process {held['pid']} of {held['user']} on {held['host']}"
    except (OSError, ValueError, KeyError, TypeError, OverflowError, ImportError):
        return "another process"
    return f"{who}, since {since:%Y-%m-%d %H:%M},"
