"""What a virtual device can be told to have beyond bias, scale and noise, one a file.

To add one, write sim_device/effects/<id>.py with one subclass of `SimulatedEffect`
(`fieldcal.sim_device.effect`); `kind` finds it by the file's name. Nothing else lives
here, and the device knows no effect by its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from fieldcal.core.plugins import module_names, plugin_class
from fieldcal.sim_device.effect import SimulatedEffect


@cache
def ids() -> tuple[str, ...]:
    """Every effect there is, in alphabetical order."""
    return module_names(__path__)


@cache
def kind(id_: str) -> type[SimulatedEffect]:
    """Class of an effect, whose id is one of `ids`."""
    return plugin_class(f"{__name__}.{id_}", SimulatedEffect)


@cache
def catalogue() -> Mapping[str, type[SimulatedEffect]]:
    """Class of every effect by its id, in alphabetical order."""
    return {id_: kind(id_) for id_ in ids()}
