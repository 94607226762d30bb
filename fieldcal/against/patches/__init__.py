"""What was found, in the terms of the user's simulator, one format a file.

To add one, write patches/<name>.py with ``WHAT`` (a line for the help), ``ENDING``,
``HOLDS`` (ids of what it can say, among those of `SensorModel.changed`) and
``text(model)``, which returns the file and what the user must know, a sentence each.
Sign and order of its convention stand at the top of the file, with where that is from.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from fieldcal.against.sensor_model import SensorModel, told
from fieldcal.core.plugins import names
from fieldcal.session.folder import write_whole


class PatchFormat(Protocol):
    """What a module of `patches` offers."""

    WHAT: str
    ENDING: str
    HOLDS: tuple[str, ...]
    text: Callable[[SensorModel], tuple[str, list[str]]]


def formats() -> tuple[str, ...]:
    """Names of the formats there are."""
    return names(__path__)


def patch_format(name: str) -> PatchFormat:
    """The module of a format."""
    return cast(PatchFormat, import_module(f"{__name__}.{name}"))


def write(name: str, model: SensorModel, path: Path) -> list[str]:
    """Write a patch whole or not at all; what the user must know.

    What the format cannot hold is among that.

    Raises
    ------
    SessionError
        If the file cannot be written.

    """
    module = patch_format(name)
    content, says = module.text(model)
    lost = [one for one in model.changed if one not in module.HOLDS]
    for one in lost:
        what = told(one.replace("_", " "), model.effects.get(one, {}))
        says.append(f"{name} has nothing for {what}: it is not in {path.name}")
    write_whole(path, content)
    return says
