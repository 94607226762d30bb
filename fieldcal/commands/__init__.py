"""The commands of the command line, one in each file: options, output and exit codes.

To add one, write commands/<name>.py with ``EXAMPLE``, ``add_arguments`` and ``run``. It
is found by the first line of its docstring, "`fieldcal <name>`: what it does.", without
an import. ``RARE`` may list the ``dest`` of options that only ``--help-all`` shows.
Nothing is calculated in this package, and nothing is printed outside of it.
"""

from __future__ import annotations

import os
import re

OPENING_LINE = re.compile(r'"""`fieldcal (\w+)`: (.+?)\.(?:""")?\n')
"""First line of a command's module: name and description."""


def command_modules() -> dict[str, tuple[str, str]]:
    """Description and module of every command, by name in alphabetical order."""
    out = {}
    for folder in __path__:
        for file in os.scandir(folder):
            if file.name.endswith(".py"):
                with open(file.path, encoding="utf-8") as text:
                    if opening := OPENING_LINE.fullmatch(text.readline()):
                        out[opening[1]] = (opening[2], file.name.removesuffix(".py"))
    return dict(sorted(out.items()))
