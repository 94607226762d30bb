"""Help that fits a screen: what is seldom wanted is told by ``--help-all``.

A command names in ``RARE`` what its options are kept under that its help leaves out.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Collection, Sequence
from typing import Any, NoReturn

from fieldcal.core.errors import InputError

BROKEN, INTERRUPTED = 70, 130
"""What sysexits.h calls EX_SOFTWARE, which is no verdict and no wrong input; and what a
shell says of Ctrl-C."""

EXIT_CODES = """\
exit codes:
  0    good
  1    the calibration or the verdict is bad
  2    wrong usage or input
  3    the device failed
  70   fieldcal itself broke; a file to send in is named
  130  interrupted
"""

IN_SHORT = "exit codes: 0 good, 1 bad, 2 wrong usage or input, 3 the device failed"


class CommandParser(argparse.ArgumentParser):
    """Options of a command.

    Parameters
    ----------
    example : of its use
    rare : what options are kept under that only ``--help-all`` tells
    whatever : of `argparse.ArgumentParser`

    """

    def __init__(
        self, example: str, rare: Collection[str] = (), **whatever: Any
    ) -> None:
        super().__init__(
            formatter_class=argparse.RawDescriptionHelpFormatter, **whatever
        )
        self._example, self._rare = f"example:\n{example.rstrip()}", rare
        if rare:
            self.add_argument(
                "--help-all",
                action=_WholeHelp,
                nargs=0,
                help="also show the rarely used options",
            )

    def format_help(self) -> str:
        """Help without what is seldom wanted."""
        positional = [a.metavar or a.dest for a in self._actions if _is_named(a)]
        left = [a for a in self._actions if a.dest in self._rare]
        before = [a.help for a in left]
        self.usage = " ".join(["%(prog)s [options]", *map(str, positional)])
        self.epilog = f"{self._example}\n\n{IN_SHORT}"
        for action in left:
            action.help = argparse.SUPPRESS
        try:
            return super().format_help()
        finally:
            self.usage = None
            for action, text in zip(left, before, strict=True):
                action.help = text

    def error(self, message: str) -> NoReturn:
        """Refuse what was typed in one sentence, as every other error is said.

        Raises
        ------
        InputError
            Always.

        """
        told = re.search(r"invalid (?:float|int) value: '(-?\d+),(\d+)'$", message)
        point = f", write {told[1]}.{told[2]}" if told else ""
        raise InputError(f"{message}{point}; see {self.prog} --help")

    def whole_help(self) -> str:
        """Help with every option, and all exit codes."""
        self.epilog = f"{self._example}\n\n{EXIT_CODES}"
        return super().format_help()


class _WholeHelp(argparse.Action):
    """Prints all of the help, and ends."""

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


def _is_named(action: argparse.Action) -> bool:
    """Whether an argument is told by its place."""
    return not action.option_strings and action.help != argparse.SUPPRESS
