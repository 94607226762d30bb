"""Help that fits on a screen; ``--help-all`` shows the rarely used options as well.

A command lists in ``RARE`` the ``dest`` of the options that its help leaves out.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NoReturn

from fieldcal.commands.path_argument import path_argument
from fieldcal.core.errors import InputError

EXIT_INTERNAL_ERROR, EXIT_INTERRUPTED = 70, 130
"""Exit codes of an internal error (EX_SOFTWARE of sysexits.h) and of Ctrl-C, as shells
have it."""

EXIT_CODES = """\
exit codes:
  0    good
  1    the calibration or the verdict is bad
  2    wrong usage or input
  3    the device failed
  70   fieldcal itself broke; a file to send in is named
  130  interrupted
"""

EXIT_CODES_IN_SHORT = (
    "exit codes: 0 good, 1 bad, 2 wrong usage or input, 3 the device failed"
)


class CommandParser(argparse.ArgumentParser):
    """Parser of a command's options.

    Parameters
    ----------
    example : of the command's use
    rare : ``dest`` of the options that only ``--help-all`` shows
    options : of `argparse.ArgumentParser`

    """

    def __init__(
        self, example: str, rare: Collection[str] = (), **options: Any
    ) -> None:
        super().__init__(
            formatter_class=argparse.RawDescriptionHelpFormatter, **options
        )
        self.register("type", Path, path_argument)  # of all that say type=Path
        self._example, self._rare = f"example:\n{example.rstrip()}", rare
        if rare:
            self.add_argument(
                "--help-all",
                action=_WholeHelp,
                nargs=0,
                help="also show the rarely used options",
            )

    def with_lists(self, arguments: Sequence[str]) -> list[str]:
        """Arguments whose lists may begin with a minus, as ``--columns -t,ax,ay,az``.

        argparse takes such a list for an option, and the one before for one without
        its value.

        >>> parser = CommandParser("")
        >>> _ = parser.add_argument("--zero")
        >>> parser.with_lists(["--zero", "-1,2,3", "--zero", "-1"])
        ['--zero=-1,2,3', '--zero', '-1']
        """
        found: list[str] = []
        for argument in arguments:
            option = self._option_string_actions.get(found[-1]) if found else None
            listed = argument.startswith("-") and "," in argument
            if listed and option is not None and option.nargs is None:
                found[-1] += f"={argument}"
            else:
                found.append(argument)
        return found

    def format_help(self) -> str:
        """Help without the rarely used options."""
        positional = [a.metavar or a.dest for a in self._actions if _is_positional(a)]
        left = [a for a in self._actions if a.dest in self._rare]
        before = [a.help for a in left]
        self.usage = " ".join(["%(prog)s [options]", *map(str, positional)])
        self.epilog = f"{self._example}\n\n{EXIT_CODES_IN_SHORT}"
        for action in left:
            action.help = argparse.SUPPRESS
        try:
            return super().format_help()
        finally:
            self.usage = None
            for action, text in zip(left, before, strict=True):
                action.help = text

    def error(self, message: str) -> NoReturn:
        """Report wrong usage in one sentence, like every other error.

        Raises
        ------
        InputError
            Always.

        """
        message = re.sub(r"invalid float value: (.*)$", r"\1 is no number", message)
        message = re.sub(r"invalid int value: (.*)$", r"\1 is no whole number", message)
        told = re.search(r"'(-?\d+),(\d+)' is no ", message)
        point = f", write {told[1]}.{told[2]}" if told else ""
        raise InputError(f"{message}{point}; see {self.prog} --help")

    def whole_help(self) -> str:
        """Help with every option, and all exit codes."""
        self.epilog = f"{self._example}\n\n{EXIT_CODES}"
        return super().format_help()


class _WholeHelp(argparse.Action):
    """Prints the help with every option, and exits."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        if isinstance(parser, CommandParser):
            sys.stdout.write(parser.whole_help())
        parser.exit()


def _is_positional(action: argparse.Action) -> bool:
    """Whether an argument is positional and shown."""
    return not action.option_strings and action.help != argparse.SUPPRESS
