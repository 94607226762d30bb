"""`fieldcal completion`: print the completion script of a shell."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from fieldcal.commands import command_modules

EXAMPLE = """\
  fieldcal completion bash > ~/.local/share/bash-completion/completions/fieldcal
  fieldcal completion zsh > ~/.zfunc/_fieldcal
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    import shtab

    whole = argparse.ArgumentParser(prog="fieldcal")
    commands = whole.add_subparsers(dest="command")
    for name, (what, module) in command_modules().items():
        command = commands.add_parser(name, help=what)
        import_module(f"fieldcal.commands.{module}").add_arguments(command)
    sys.stdout.write(shtab.complete(whole, args.shell) + "\n")
    return 0
