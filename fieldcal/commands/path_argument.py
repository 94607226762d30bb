"""Files and folders on the command line."""

from __future__ import annotations

from argparse import ArgumentTypeError
from pathlib import Path


def path_argument(text: str) -> Path:
    """A file or folder; refuse an empty name, which would be the current folder.

    Raises
    ------
    ArgumentTypeError
        If there is nothing but blanks, as where a variable of the shell is not set.

    >>> path_argument("session").name
    'session'
    """
    if not text.strip():
        raise ArgumentTypeError(
            "the name is empty (a variable of the shell that is not set?);"
            " write . for the current folder"
        )
    return Path(text)
