"""The autopilot that a command writes to: it is opened, checked and written."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.core.errors import FieldcalError, InputError

if TYPE_CHECKING:
    from fieldcal.drivers.mavlink_parameters import ParameterLink


class InstallRefused(FieldcalError):
    """The calibration must not be installed."""

    exit_code = 1


def write_parameters(
    link: ParameterLink,
    device: str,
    folder: Path,
    known: Mapping[str, float],
    new: Mapping[str, float],
    yes: bool,
) -> None:
    """Write parameters, after saving the old ones in a session's folder.

    Parameters
    ----------
    link, device : the autopilot, and its address
    folder : of the session
    known : values that the autopilot is expected to have
    new : values to write
    yes : whether to write without asking

    """
    from fieldcal.drivers.mavlink_parameters import same_float32
    from fieldcal.install.transaction import (
        WriteRolledBack,
        adding_to_fault,
        broken_off,
        check_unchanged,
        install,
        note_done,
        save,
        unfinished,
    )

    earlier = unfinished(folder)
    if earlier:  # its values come from an interrupted write
        now = link.read(known)
        old = {name: earlier[1]["old"].get(name, now[name]) for name in now}
        if said := broken_off(now, old, earlier[1]["new"]):
            sys.stderr.write(f"{said}\n")
    else:
        now = old = check_unchanged(link, known, "while it was recorded", new)
    if all(same_float32(now[name], value) for name, value in new.items()):
        if earlier:
            note_done(earlier[0], done=True)
        sys.stderr.write(f"all {len(new)} parameters are installed already\n")
        return
    confirm(f"write these {len(new)} parameters to {device}", yes)
    with adding_to_fault("nothing was written to the autopilot"):
        path = save(folder, device, old, new)
        if earlier:
            note_done(earlier[0], undone=True)
    try:
        install(link, old, new)
    except WriteRolledBack:
        note_done(path, undone=True)
        raise
    undo = f"fieldcal undo {shlex.quote(str(folder))} --device {shlex.quote(device)}"
    with adding_to_fault(
        f"all {len(new)} parameters are written and read back, which could not be noted"
    ):
        note_done(path, done=True)
    sys.stderr.write(
        f"written and read back: {len(new)} parameters; the old ones are in {path}\n"
        f"to take it back: {undo}\n"
    )


def open_parameters(url: str) -> Any:
    """Open the parameters of an autopilot.

    Raises
    ------
    InputError
        If the address is not of MAVLink, or pymavlink is not installed.

    """
    from importlib.util import find_spec

    scheme, _, address = url.partition(":")
    if scheme != "mavlink":
        raise InputError(
            f"{url}: parameters are written over mavlink:, such as"
            " mavlink:udp:0.0.0.0:14550; for other devices fieldcal export"
        )
    if not find_spec("pymavlink"):
        raise InputError("MAVLink needs pymavlink: pip install 'fieldcal[mavlink]'")
    from fieldcal.drivers.mavlink_parameters import ParameterLink

    return ParameterLink(address)


def check_ready(link: Any, autopilot: int) -> None:
    """Refuse an autopilot that is armed or runs another program.

    Raises
    ------
    InputError
        If the autopilot is refused.

    """
    if link.armed:
        raise InputError(f"{link.name}: the vehicle is armed: disarm it, then write")
    if link.autopilot != autopilot:
        raise InputError(
            f"{link.name}: this autopilot runs another program than the one that was"
            " recorded: name the right one"
        )


def confirm(what: str, yes: bool) -> None:
    """Ask the user for confirmation, unless `yes`.

    Raises
    ------
    InputError
        If there is no terminal to ask at.
    InstallRefused
        If the answer is no.

    """
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(f"nobody is there to be asked: give --yes to {what}")
    sys.stderr.write(f"{what}? [y/N] ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InstallRefused("nothing was written, as you wished")
