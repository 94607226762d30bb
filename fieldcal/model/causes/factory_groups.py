"""Groups of the errors that the factory left, which are included and not reported.

Most are effects of the catalogue of a known size. Hysteresis of the accelerometers is a
part of their bias that depends on the last turn,

    U_i += h_i clip((f_i - f_i,before) / g, -1, 1)

f_i,before is the force along axis i in the previous position, m/s^2, and h_i the
hysteresis, m/s^2. In the first position f_i,before is not known, and the term is part
of the bias. A suspension returns to a position that depends on the side from which the
force came; the difference is smaller after a smaller change. Source: IEEE Std 1293,
whose hysteresis error is that of a cycle over the whole range.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.factory import WARM_UP_TIME_CONSTANT, WARMING_EFFECTS, FactoryErrors
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.effects import catalogue
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.causes.effect_causes import effect_group, units_of
from fieldcal.physics.experience import Experience


def factory_groups(
    table: ColumnTable, left: FactoryErrors, turned: bool
) -> list[Group]:
    """Groups of the factory errors `left`, which are included and not reported.

    Biases follow the temperature if a thermometer shows a change, and the warm-up of
    the package otherwise.
    """
    if not table.x.f.any():
        return []
    shapes, out = {WARMING_EFFECTS[1]: {"tau_s": WARM_UP_TIME_CONSTANT}}, []
    for name, size in factory_sizes(table.x, left).items():
        if name == "hysteresis" and size.any():
            out.append(hysteresis(table, float(size[0])))
        elif size.any():
            group = effect_group(table, name, turned, (shapes.get(name, {}), 0))
            wide = (size * units_of(table, catalogue()[name]))[list(group.params)]
            out.append(replace(group, cause="factory", part=name, typical=wide,
                               fixed_size=1.0))  # fmt: skip
    return out


def factory_sizes(x: Experience, left: FactoryErrors) -> dict[str, Array]:
    """Standard deviation, SI, of each factory error by name: (1,), or (6,)."""
    sizes = {name: np.array([size]) for name, size in left.by_effect.items()}
    sizes["hysteresis"] = np.array([left.hysteresis])
    name, per_k = left.warming_effect(x.warms)
    return sizes | {name: np.array(per_k)}


def hysteresis(table: ColumnTable, size: float) -> Group:
    """Group of the three accelerometers; `size` is the sigma of h, m/s^2."""
    held = np.unique(table.x.position[table.x.position >= 0])
    force = np.array([table.x.f[table.x.position == p].mean(axis=0) for p in held])

    def columns(view: RowView) -> Array:
        x, out = view.x, np.zeros((len(view.x), 6, 3))
        planned = (x.position < 0) & x.oriented  # a further position at the end
        reached = np.flatnonzero((x.position > held[0]) | planned)
        last = np.where(planned, len(held), np.searchsorted(held, x.position))[reached]
        change = x.f[reached] - force[last - 1]
        for c in range(3):
            out[reached, c, c] = np.nan_to_num(np.clip(change[:, c] / G0, -1.0, 1.0))
        return out

    at = table.add(General("hysteresis", columns), 3)
    wide = size * np.abs(table.unit[:3])
    return Group("factory", "hysteresis", at, wide, fixed_size=1.0)
