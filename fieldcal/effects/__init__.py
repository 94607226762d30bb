"""The catalogue of effects that a simulation can leave out, one a file.

To add one, write effects/<id>.py with a subclass of `Motion`, `Sensor`, `Scatter`,
`Line` or `Chain` (`fieldcal.physics.effect`); `catalogue` finds it by the file's name.
Nothing else lives here, and nothing that calculates knows an effect by its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from fieldcal.physics.effect import Effect


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its id, in alphabetical order."""
    found: dict[str, Effect] = {}
    for name in sorted(m.name for m in iter_modules(__path__)):
        module = f"{__name__}.{name}"
        for thing in vars(import_module(module)).values():
            if isinstance(thing, type) and thing.__module__ == module:
                if issubclass(thing, Effect):
                    found[name] = thing()
    return found
