"""The command line: one command a module in `commands`, loaded when it is called.

Exit codes: 0 good, 1 the calibration or the verdict is bad, 2 wrong usage or input,
3 the device failed, 70 fieldcal itself broke, 130 interrupted. What a command has to
say goes to standard output, with --json exactly one JSON object, which has "error" and
"exit_code" where the command failed; messages go to standard error.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Protocol, TextIO, cast

from fieldcal.commands import found
from fieldcal.commands.help import BROKEN, EXIT_CODES, INTERRUPTED, CommandParser
from fieldcal.commands.spelling import spell_out

COMMANDS = found()
"""Name, what it does, module."""


class CommandModule(Protocol):
    """What a module of `commands` offers."""

    EXAMPLE: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


def _load(name: str) -> CommandModule:
    return cast(CommandModule, import_module(f"fieldcal.commands.{COMMANDS[name][1]}"))


def _top(version: str) -> argparse.ArgumentParser:
    width = max(map(len, COMMANDS))
    listed = "\n".join(f"  {n:{width}}  {what}" for n, (what, _) in COMMANDS.items())
    parser = argparse.ArgumentParser(
        prog="fieldcal",
        description="Recalibrate an inertial measurement unit in the field.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f"commands:\n{listed}\n\n{EXIT_CODES}\n"
        "example:\n  fieldcal run five_position --virtual",
    )
    parser.add_argument("--version", action="version", version=f"fieldcal {version}")
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    return parser


def _command_parser(name: str, command: CommandModule) -> argparse.ArgumentParser:
    parser = CommandParser(
        command.EXAMPLE,
        getattr(command, "RARE", ()),
        prog=f"fieldcal {name}",
        description=COMMANDS[name][0][0].upper() + COMMANDS[name][0][1:] + ".",
    )
    command.add_arguments(parser)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    # small matrices by the thousand: threads would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    spell_out()
    with _nothing_carried_out():
        return _named(argv)


@contextlib.contextmanager
def _nothing_carried_out() -> Iterator[None]:
    """Show what is in the text of others on both streams instead of doing it."""
    from fieldcal.core.escaping import EscapingStream

    before = sys.stdout, sys.stderr
    if all(before):  # a program without a console has none
        sys.stdout, sys.stderr = (cast(TextIO, EscapingStream(s)) for s in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _named(argv: Sequence[str] | None) -> int:
    """Run the command that the arguments name."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] not in COMMANDS:
        from fieldcal.core.version import __version__

        _top(__version__).parse_args(arguments or ["--help"])
    return _guarded(arguments[0], arguments[1:])


def _guarded(name: str, arguments: list[str]) -> int:
    """Turn errors into one sentence and an exit code."""
    from fieldcal.core.errors import FieldcalError
    from fieldcal.core.escaping import escape_line

    command, printed = _load(name), False
    try:
        code = command.run(_command_parser(name, command).parse_args(arguments))
        return _flushed(code)
    except FieldcalError as error:
        said, code, printed = (
            escape_line(str(error)),
            error.exit_code,
            error.printed,
        )
    except KeyboardInterrupt:
        said, code = "interrupted", INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except Exception as error:  # the operator gets a sentence whatever it is
        said, code = _broken(name, arguments, error), BROKEN
    sys.stderr.write(f"fieldcal {name}: {said}\n")
    if "--json" in arguments and not printed:
        failed = {"error": said, "exit_code": code}
        sys.stdout.write(json.dumps(failed, ensure_ascii=False) + "\n")
    return code


def _flushed(code: int) -> int:
    """An exit code, once all is printed or its reader has gone."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        from fieldcal.commands.console import unread

        unread()
    return code


def _broken(name: str, arguments: list[str], error: Exception) -> str:
    """Write down an error that nobody foresaw, and say where."""
    import platform
    import tempfile
    import traceback

    from fieldcal.core.version import __version__

    text = (
        f"fieldcal {__version__}, Python {platform.python_version()},"
        f" {platform.platform()}\nfieldcal {shlex.join([name, *arguments])}\n\n"
        + "".join(traceback.format_exception(error))
    )
    said = f"broke on {type(error).__name__}, a fault of its own and no verdict"
    try:
        handle, path = tempfile.mkstemp(prefix="fieldcal-broke-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError:
        return f"{said}: send in what follows\n{text.rstrip()}"
    return f"{said}: send in {path}, which says where, and the recording if you may"
