"""One command of the command line a file: options in, words and exit codes out.

To add one, write commands/<name>.py with ``EXAMPLE``, ``add_arguments`` and ``run``. It
is found by the first line of its docstring, "`fieldcal <name>`: what it does.", without
being loaded. ``RARE`` may name what the options are kept under that only ``--help-all``
tells. Nothing is calculated here, and only here anything is printed.
"""

from __future__ import annotations

import os
import re

OPENING = re.compile(r'"""`fieldcal (\w+)`: (.+?)\.(?:""")?\n')
"""First line of the module of a command: its name, and what it does."""


def found() -> dict[str, tuple[str, str]]:
    """What every command does, and its module, by its name in alphabetical order."""
    out = {}
    for folder in __path__:
        for file in os.scandir(folder):
            if file.name.endswith(".py"):
                with open(file.path, encoding="utf-8") as text:
                    if opening := OPENING.fullmatch(text.readline()):
                        out[opening[1]] = (opening[2], file.name.removesuffix(".py"))
    return dict(sorted(out.items()))
