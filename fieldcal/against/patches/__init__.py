"""Writes the sensor model in the format of the user's simulator, one module a format.

To add a format, write patches/<name>.py with ``WHAT`` (a line for the help), ``ENDING``
(of the file name), ``HOLDS`` (ids that the format can hold, among those of
`SensorModel.changed`) and ``text(model)``, which returns the content of the file and a
list of notices for the user. The top of the module states the sign convention and its
source.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from fieldcal.against.sensor_model import SensorModel, effect_with_values
from fieldcal.core.plugins import module_names
from fieldcal.session.file_writing import write_atomically


class PatchFormat(Protocol):
    """Interface of a module of `patches`."""

    WHAT: str
    ENDING: str
    HOLDS: tuple[str, ...]
    text: Callable[[SensorModel], tuple[str, list[str]]]


def formats() -> tuple[str, ...]:
    """Names of all formats."""
    return module_names(__path__)


def patch_format(name: str) -> PatchFormat:
    """The module of a format."""
    return cast(PatchFormat, import_module(f"{__name__}.{name}"))


def assumed_sentence(names: Sequence[str], where: str) -> list[str]:
    """Notice about what an element of a file holds although nothing shows it."""
    if not names:
        return []
    what = ", ".join(one.replace("_", " ") for one in names)
    return [
        f"{what}: neither recording nor simulator shows it, so {where} has the value of"
        " a perfect sensor, which is no measured one; write the simulator's own"
    ]


def write(name: str, model: SensorModel, path: Path) -> list[str]:
    """Write a patch whole or not at all; returns notices for the user.

    They name everything that the format cannot hold.

    Raises
    ------
    SessionError
        If the file cannot be written.

    """
    module = patch_format(name)
    content, says = module.text(model)
    lost = [one for one in model.changed if one not in module.HOLDS]
    for one in lost:
        what = effect_with_values(one.replace("_", " "), model.effects.get(one, {}))
        says.append(f"{name} has nothing for {what}: it is not in {path.name}")
    write_atomically(path, content)
    return says
