"""Cross-coupling that nobody asked for, and what unfavourable positions make of it.

A set without cross-coupling takes the axes as square. What each coefficient k that the
device has all the same moves the parameters by, and what of k the rows would show, are

    D = P_tA Phi_A^T R^-1 Phi_k,    C = (1 / T^2 + M_kk)^-1                        (1)

with A the columns of the set, P their covariance, T a usual size and M_kk what the rows
say of k beside the set. So not knowing k adds D C D^T to the covariance of the
parameters. Where each axis is held up and down, as much of gravity as k is large moves
a bias. Positions that are few or alike may magnify it many times, and then the stated
uncertainties say nothing of what the device may be off by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import ParameterName
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.solve.averaging import picked_by
from fieldcal.solve.estimation import Estimated


@dataclass(frozen=True, slots=True)
class Magnified:
    """What cross-coupling that is left out does to the parameter it moves most.

    Attributes
    ----------
    name, unit : of the parameter
    moved : 1 sigma for a coefficient of one
    times : the same over gravity for a bias, over one for a scale factor

    """

    name: str
    unit: str
    moved: float
    times: float

    @property
    def sentence(self) -> str:
        """What it costs and what to do."""
        moved = f"{self.moved / 1000:.2g} {self.unit}".removesuffix(" 1")
        return (
            "cross-coupling is taken as zero, and these positions magnify its effect"
            f" {self.times:.1f} times: each 0.1 % moves {self.name} by {moved}, which"
            " the uncertainties do not include; hold each axis up and down, or estimate"
            " cross-coupling (--cross) from nine positions or more"
        )

    def to_json(self) -> dict[str, str | float]:
        """Key `cross_coupling_left_out` of a result."""
        return {
            "parameter": self.name, "moved_by_one": self.moved, "unit": self.unit,
            "times": self.times,
        }  # fmt: skip


def magnified(found: Estimated) -> Magnified | None:
    """The largest effect of cross-coupling on the parameters of a set, by (1).

    None where the set estimates it, determines nothing of the accelerometers, or the
    positions magnify nothing.
    """
    given = found.given
    if given.left_out is None:
        return None
    added = _added(found, given.left_out)
    every = []
    for name in found.names:
        parameter = ParameterName.of(name)
        if parameter.sensor == "acc":
            moved = float(added[given.names.index(name)])
            times = moved / (1.0 if parameter.is_scale else G0)
            every.append(Magnified(name, GROUPS[parameter.group][2], moved, times))
    worst = max(every, key=lambda m: m.times, default=None)
    return worst if worst and worst.times > 1 else None


def _added(found: Estimated, group: Group) -> Array:
    """What an unknown group adds to each parameter, over its usual size.

    Back comes (k,), 1 sigma, in units of the parameter.
    """
    there = found.search.evaluated(found.given.members).state
    inner, _ = there.rest(group.columns, group.typical)
    unknown = np.linalg.inv(np.eye(len(inner)) + inner)  # C / T^2
    rows = there.rows.matrix(there.columns, group.columns)
    moved = picked_by(found.given, there.columns) @ there.inverse @ rows  # D
    var = np.einsum("ki,ij,kj->k", moved, unknown, moved)
    out: Array = np.sqrt(np.maximum(var, 0.0))
    return out
