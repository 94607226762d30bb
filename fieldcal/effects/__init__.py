"""The catalogue of effects that a simulation can leave out, one a file.

To add one, write effects/<id>.py with a subclass of `Motion`, `Sensor`, `Scatter`,
`Line` or `Chain` (`fieldcal.physics.effect`); `catalogue` finds it by the file's name.
Nothing else lives here, and nothing that calculates knows an effect by its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from fieldcal.core.plugins import module_names, plugin_class
from fieldcal.physics.effect import Effect


@cache
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its id, in alphabetical order."""
    return {
        n: plugin_class(f"{__name__}.{n}", Effect)() for n in module_names(__path__)
    }
