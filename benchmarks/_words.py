"""What is told behind the name of a benchmark, and commands that it runs."""

import contextlib
import io
import sys
from typing import NamedTuple

from fieldcal.cli import main


def how_many(usual: int) -> int:
    """The first number that is told."""
    return next((int(word) for word in sys.argv[2:] if word.isdigit()), usual)


def option(name: str, usual: str = "") -> str:
    """What is told as ``--name=...``."""
    lead = f"--{name}="
    told = (word.removeprefix(lead) for word in sys.argv[2:] if word.startswith(lead))
    return next(told, usual)


class Ran(NamedTuple):
    """A command that was run: its exit code, and what it wrote."""

    code: int
    out: str
    err: str


def ran(words: list[str]) -> Ran:
    """Run a command of fieldcal within this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    return Ran(code, out.getvalue(), err.getvalue())
