"""The operator of a run: a script, or a person at the console."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcal.commands.run_page import show_on_page

if TYPE_CHECKING:
    from fieldcal.run.movers import Mover
    from fieldcal.run.operator.protocol import Operator
    from fieldcal.run.page.server import PageServer
    from fieldcal.run.plan_file import PlanTask


@contextlib.contextmanager
def run_operator(
    args: argparse.Namespace,
    task: PlanTask,
    mover: Mover,
    folder: Path,
    page: PageServer | None,
) -> Iterator[Operator]:
    """Yield the operator of a run, who is shown on the page as well if there is one."""
    from fieldcal import procedures

    most = procedures.max_positions(task.about, task.procedure)
    title = f"fieldcal · {task.procedure} · {folder}"
    if args.headless:
        from fieldcal.run.operator.script import ScriptOperator

        yield show_on_page(ScriptOperator(mover), page, task, title, most)
        return
    from fieldcal.commands.console import EscapingConsole
    from fieldcal.run.operator.keyboard import Keyboard
    from fieldcal.run.operator.terminal import ConsoleOperator

    with ConsoleOperator(
        title,
        task.about.positions if most else task.positions,
        mover,
        EscapingConsole(stderr=args.json, spelled=False),  # the screen has its own
        args.plain,
        Keyboard(),
        len(task.about.positions) if task.verification and most is None else None,
        most,
    ) as operator:
        yield show_on_page(operator, page, task, title, most)
