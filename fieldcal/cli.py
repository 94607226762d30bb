"""The command line. Each command is a module of `commands`, imported when it is called.

Exit codes: 0 good, 1 the calibration or the verdict is bad, 2 wrong usage or input,
3 the device failed, 70 internal error of fieldcal, 130 interrupted. Results go to
standard output, with --json as exactly one JSON object, which has "error" and
"exit_code" if the command failed. Messages go to standard error.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import json
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Protocol, TextIO, cast

from fieldcal.commands import command_modules
from fieldcal.commands.help import (
    EXIT_CODES,
    EXIT_INTERNAL_ERROR,
    EXIT_INTERRUPTED,
    CommandParser,
)
from fieldcal.commands.spelling import use_spellings

COMMANDS = command_modules()
"""Description and module of each command, by name."""


OPTIONS = ("-h", "--help", "--version")
"""Options that need no command."""


class CommandModule(Protocol):
    """Interface of a command module in `commands`."""

    EXAMPLE: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


def _load(name: str) -> CommandModule:
    return cast(CommandModule, import_module(f"fieldcal.commands.{COMMANDS[name][1]}"))


def _top_parser(version: str) -> argparse.ArgumentParser:
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


def _command_parser(name: str, command: CommandModule) -> CommandParser:
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
    use_spellings()
    with _standard_streams():
        return _run_named_command(argv)


@contextlib.contextmanager
def _standard_streams() -> Iterator[None]:
    """Make both outputs show control characters in foreign text, not send them.

    A stream that was closed, or that a program without a console lacks, is nowhere.
    """
    from fieldcal.core.escaping import EscapingStream

    before = sys.stdin, sys.stdout, sys.stderr
    with contextlib.ExitStack() as opened:
        # in this order: what is opened first takes the number of a closed one
        given, *outputs = (
            stream or opened.enter_context(open(os.devnull, mode, encoding="utf-8"))
            for stream, mode in zip(before, "rww", strict=True)
        )
        sys.stdin = given
        sys.stdout, sys.stderr = (cast(TextIO, EscapingStream(s)) for s in outputs)
        try:
            yield
        finally:
            sys.stdin, sys.stdout, sys.stderr = before


def _run_named_command(argv: Sequence[str] | None) -> int:
    """Run the command whose name is the first argument."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] not in COMMANDS:
        if arguments and arguments[0] not in OPTIONS:
            return _refuse_command(arguments[0])
        from fieldcal.core.version import __version__

        _top_parser(__version__).parse_args(arguments or ["--help"])
    return _run_guarded(arguments[0], arguments[1:])


def _refuse_command(name: str) -> int:
    """Say that there is no such command or option, and which command may be meant."""
    from difflib import get_close_matches

    from fieldcal.core.errors import FieldcalError
    from fieldcal.core.escaping import escape_line

    near = get_close_matches(name, COMMANDS, 1)
    meant = f"did you mean {near[0]}? " if near else ""
    kind = "command"
    if name.startswith("-"):
        kind, meant = "option", "name the command first, and its options behind it; "
    sys.stderr.write(
        f"fieldcal: there is no {kind} {escape_line(repr(name))}: {meant}see fieldcal"
        " --help\n"
    )
    return FieldcalError.exit_code


def _run_guarded(name: str, arguments: list[str]) -> int:
    """Run a command; an error becomes one sentence and an exit code."""
    from fieldcal.core.errors import FieldcalError
    from fieldcal.core.escaping import escape_line

    command, printed = _load(name), False
    try:
        parser = _command_parser(name, command)
        code = command.run(parser.parse_args(parser.with_lists(arguments)))
        sys.stdout.flush()
        return code
    except FieldcalError as error:
        said, code, printed = (
            escape_line(str(error)),
            error.exit_code,
            error.printed,
        )
    except KeyboardInterrupt:
        said, code = "interrupted", EXIT_INTERRUPTED
    except Exception as error:  # the operator gets a sentence whatever it is
        if full := _output_is_full(error):
            said, code = full, FieldcalError.exit_code
        else:
            said, code = _write_crash_file(name, arguments, error), EXIT_INTERNAL_ERROR
    # a command may have a form of its own for errors, optional as RARE is
    tell_failure = getattr(command, "tell_failure", None)
    if tell_failure is None or not tell_failure(arguments, said, code):
        sys.stderr.write(f"fieldcal {name}: {said}\n")
    if "--json" in arguments and not printed:
        _write_failure(said, code)
    return code


def _write_failure(said: str, code: int) -> None:
    """Write the JSON object of a failed command, if anything can take it."""
    failed = {"error": said, "exit_code": code}
    try:
        sys.stdout.write(json.dumps(failed, ensure_ascii=False) + "\n")
        sys.stdout.flush()
    except OSError:
        from fieldcal.core.escaping import discard_output

        discard_output(sys.stdout)


def _output_is_full(error: Exception) -> str:
    """Sentence on an output that takes no more; empty for any other error.

    Nothing more is written to it, so that the interpreter does not fail at its end.
    """
    full = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    # an error of a named file is one of a file, and no stream's
    if not isinstance(error, OSError) or error.filename or error.errno not in full:
        return ""
    from fieldcal.core.errors import disk_says
    from fieldcal.core.escaping import discard_output

    discard_output(sys.stdout)
    return f"the output cannot be written: {disk_says(error)}"


def _write_crash_file(name: str, arguments: list[str], error: Exception) -> str:
    """Write the traceback of an unexpected error to a file; return a sentence on it."""
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
        # names of files in it may be no UTF-8
        with os.fdopen(
            handle, "w", encoding="utf-8", errors="backslashreplace"
        ) as file:
            file.write(text)
    except OSError:
        return f"{said}: send in what follows\n{text.rstrip()}"
    return f"{said}: send in {path}, which says where, and the recording if you may"
