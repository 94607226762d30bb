"""Device and mover of a run, from its plan."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from fieldcal.core.errors import InputError

if TYPE_CHECKING:
    from fieldcal.drivers.driver import Driver
    from fieldcal.run.movers import Mover
    from fieldcal.run.plan_file import PlanTask

VIRTUAL_FORMAT = "witmotion"


@contextlib.contextmanager
def device_and_mover(task: PlanTask) -> Iterator[tuple[Callable[[], Driver], Mover]]:
    """Yield a function that opens the device, and the mover."""
    from fieldcal.commands.signals import interruptible
    from fieldcal.commands.virtual_address import driver_address
    from fieldcal.drivers.driver import open_driver
    from fieldcal.run import movers
    from fieldcal.run.command_mover import CommandMover
    from fieldcal.run.plan_file import TURN

    mover, url = task.mover, str(task.run.get("device", ""))
    with contextlib.ExitStack() as stack:
        stack.enter_context(interruptible())
        turns: Mover = movers.ManualMover()
        if mover["kind"] == "virtual" and "control" in mover:
            turns = stack.enter_context(movers.RunningDevice(mover["control"]))
        elif mover["kind"] == "virtual":
            options = _virtual_options(task)
            made = stack.enter_context(movers.VirtualMover(options))
            turns, url = made, driver_address(options, made.port)
        elif mover["kind"] == "command":
            timeout = float(mover.get("timeout_s", TURN))
            turns = stack.enter_context(CommandMover(mover["command"], timeout))
        if not url:
            raise InputError(
                'name the device: --device "serial:/dev/ttyUSB0?format=witmotion"'
                " (fieldcal ports lists them), or --virtual to try without one"
            )
        yield lambda: open_driver(url), turns


def _virtual_options(task: PlanTask) -> list[str]:
    site = task.about
    options = ["--serial", VIRTUAL_FORMAT]
    options += [f"--latitude={site.latitude_deg}", f"--height={site.height_m}"]
    options += [f"--mounting={','.join(site.axes)}", f"--grade={site.grade}"]
    if "gravity" in site.raw.get("site", {}):
        options.append(f"--gravity={site.gravity}")
    return options + shlex.split(task.mover.get("options", ""))
