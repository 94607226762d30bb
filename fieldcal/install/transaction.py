"""Writes parameters to an autopilot; the old ones are saved first.

The old set is saved before the first parameter is touched. After writing everything is
read back; if anything is not as wanted, the old set is written and read back as well.
What is saved says what was there, what was written, and whether that succeeded.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from fieldcal.core.documents import load_json
from fieldcal.core.errors import DeviceError, InputError, SessionError
from fieldcal.drivers.mavlink_dialog import parameter_list
from fieldcal.drivers.mavlink_installed import InstalledCalibration, identity_parameters
from fieldcal.drivers.mavlink_parameter_names import (
    ARDUPILOT,
    MOST_SENSORS,
    PX4,
    ardupilot_prefix,
    parameter_names,
)
from fieldcal.drivers.mavlink_parameters import ParameterLink, same_float32
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.folder import DESCRIPTION, Session

SAVED = "installed-before-"
"""What the name of a file with an old set begins with."""

NAME_WHAT_WAS_WRITTEN = (
    "name the session that was written, or its installed-before file"
)


GYR_OFFSETS = {
    name
    for autopilot in (ARDUPILOT, PX4)
    for instance in range(MOST_SENSORS)
    for name in parameter_names(autopilot, instance)["gyr_offset"]
} | {f"{ardupilot_prefix('GYR', n, '1')}_CALTEMP" for n in range(MOST_SENSORS)}
"""Parameters that an autopilot sets by itself."""


class WriteRolledBack(DeviceError):
    """Writing failed, and the old set is back."""


def check_unchanged(
    link: ParameterLink,
    known: Mapping[str, float],
    since: str,
    other: Mapping[str, float],
) -> dict[str, float]:
    """Return what the autopilot keeps; refuse if that is not as in the proposal.

    Offsets of gyroscopes are its own to change: it averages them at each start, and
    what is written replaces them whatever they are.

    Parameters
    ----------
    link : to the autopilot
    known : what it should keep
    since : when it kept that, for the error
    other : what it may keep instead, parameter by parameter

    Raises
    ------
    InputError
        Naming the first parameter that differs.

    """
    now = link.read(known)
    for name, value in known.items():
        if name in GYR_OFFSETS:
            continue
        if not (same_float32(now[name], value) or same_float32(now[name], other[name])):
            raise InputError(
                f"{name} = {now[name]:.9g} on the autopilot, and was {value:.9g}"
                f" {since}: somebody has changed it since; record again"
            )
    return now


def install(
    link: ParameterLink,
    old: Mapping[str, float],
    new: Mapping[str, float],
    back: str = "as before",
) -> None:
    """Write, read back, and undo it if anything is not as wanted.

    Parameters
    ----------
    link : to the autopilot
    old, new : what it has after it was undone, and after it was not
    back : what the old ones are, for the error

    Raises
    ------
    DeviceError
        If it failed; the text says whether the old set is back.

    """
    try:
        link.write(new)
    except (DeviceError, KeyboardInterrupt) as failed:
        said = str(failed) or "interrupted"
        try:
            link.write(old)
        except DeviceError as again:
            raise DeviceError(
                f"{said}; and it could not be undone ({again}): set by hand"
                f" {parameter_list(old)}"
            ) from failed
        raise WriteRolledBack(f"{said}; undone, all {len(old)} are {back}") from failed


def whole(now: Mapping[str, float], some: Mapping[str, float]) -> bool:
    """Whether what an autopilot keeps is one set, but for what it sets by itself."""
    return all(same_float32(now[n], v) for n, v in some.items() if n not in GYR_OFFSETS)


def broken_off(
    now: Mapping[str, float], old: Mapping[str, float], new: Mapping[str, float]
) -> str:
    """Sentence where it keeps part of each, as after a kill; empty if it does not."""
    if whole(now, old) or whole(now, new):
        return ""
    done = sum(same_float32(now[n], v) for n, v in new.items())
    return (
        f"writing was broken off before: {done} of {len(new)} parameters are the new"
        " ones"
    )


def unfinished(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """The last set saved in a session of which nobody noted what became of it."""
    for file in sorted(folder.glob(f"{SAVED}*.json"), reverse=True):
        try:
            document = load_json(file.read_text("utf-8"))
            if document.get("undone") or document.get("done"):
                return None
            return file, {"old": dict(document["old"]), "new": dict(document["new"])}
        except (OSError, ValueError, KeyError, AttributeError, TypeError):
            continue
    return None


@contextmanager
def adding_to_fault(outcome: str) -> Iterator[None]:
    """Add to an error about a file what the autopilot has.

    Raises
    ------
    SessionError
        The same one, with `outcome` behind it.

    """
    try:
        yield
    except SessionError as error:
        raise SessionError(f"{error}; {outcome}") from error


def save(
    folder: Path, device: str, old: Mapping[str, float], new: Mapping[str, float]
) -> Path:
    """Save the old set before anything is written; where.

    Raises
    ------
    SessionError
        If it cannot be saved.

    """
    stamp = datetime.now().strftime("%Y-%m-%dT%H-%M-%S-%f")
    path = folder / f"{SAVED}{stamp}.json"
    document = {"device": device, "old": dict(old), "new": dict(new)}
    return write_atomically(path, json.dumps(document, indent=2) + "\n")


def note_done(path: Path, **what: Any) -> None:
    """Note in a saved set what became of it: ``done``, ``undone``."""
    document = load_json(path.read_text("utf-8"))
    write_atomically(path, json.dumps({**document, **what}, indent=2) + "\n")


def save_removed(folder: Path) -> list[Path]:
    """Save parameters that a run had neutralised; no file if it had not.

    A run gives it back when it ends; one that was killed, or lost the link, did not.
    """
    session = Session.open(folder)
    device = session.about.raw.get("run", {}).get("device", "")
    for mark in reversed(list(session.marks())):
        told = mark.get("installed") if mark.get("event") == "device" else None
        if not (told and told.get("taken_out")):
            continue
        known = InstalledCalibration.from_table(told)
        new = identity_parameters(known)
        old = {name: known.values[name] for name in new}
        if old != new:  # else a run before it had taken out what there was
            first = device if isinstance(device, str) else device[0]
            path = save(folder, first, old, new)
            note_done(path, done=True)  # by that run
            return [path]
    return []


def last_saved(path: Path) -> tuple[Path, dict[str, Any]]:
    """The last set that was saved in a session and written, or the one of a file.

    Where nothing was written: what a run had taken out and could not give back.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.

    """
    files = sorted(path.glob(f"{SAVED}*.json")) if path.is_dir() else [path]
    if not files and (path / DESCRIPTION).is_file():
        files = save_removed(path)
    for file in reversed(files):
        try:
            document = load_json(file.read_text("utf-8"))
            old, new = ({str(k): float(v) for k, v in document[key].items()}
                        for key in ("old", "new"))  # fmt: skip
            known = {"device": str(document["device"]), "old": old, "new": new,
                     "done": bool(document.get("done"))}  # fmt: skip
        except FileNotFoundError as error:
            raise InputError(
                f"{file}: is not there; {NAME_WHAT_WAS_WRITTEN}"
            ) from error
        except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
            raise InputError(
                f"{file}: is no saved set of parameters: {error}"
            ) from error
        if not document.get("undone"):
            return file, known
    raise InputError(
        f"{path}: nothing was written from there that could be undone;"
        f" {NAME_WHAT_WAS_WRITTEN}"
    )
