r"""Names of files and folders that are not UTF-8, as old archives have them.

Python represents such a byte by a lone surrogate, which no file of results, no database
and no page can hold.

>>> storable_text("caf\udce9")
'caf\\udce9'
"""

from __future__ import annotations

from pathlib import Path

from fieldcal.core.errors import SessionError


def storable_text(text: str) -> str:
    r"""Text that every file and database holds; all but surrogates and NUL is kept."""
    kept = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return kept.replace("\0", r"\x00")


def refuse_undecodable_path(path: Path) -> None:
    """Refuse a path with a name that is not UTF-8.

    Raises
    ------
    SessionError
        If there is such a name.

    """
    for name in path.resolve().parts:
        if (shown := storable_text(name)) != name:
            raise SessionError(
                f"{storable_text(str(path))}: the name {shown} is not UTF-8; rename"
                " that file or folder"
            )
