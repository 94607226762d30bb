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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcal.calibration.names import ParameterName
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.search.selection import Search
from fieldcal.model.state import State
from fieldcal.solve.averaging import picked_by
from fieldcal.solve.given import Given

PER_MILLE = 1e-3
"""Size of the coefficient that sentences speak of: 0.1 %."""


@dataclass(frozen=True, slots=True)
class Magnified:
    """What cross-coupling that is left out does to the parameter it moves most.

    Attributes
    ----------
    name, unit : of the parameter
    moved : what a coefficient of one in a thousand moves it by, 1 sigma
    times : the same over what it is of gravity, or of a scale factor of one

    """

    name: str
    unit: str
    moved: float
    times: float

    @property
    def sentence(self) -> str:
        """What is left out, what that costs, and what to do."""
        if self.times <= 1:
            return ""
        moved = f"{self.moved:.2g} {self.unit}".rstrip()
        return (
            "cross-coupling is taken as none, and these positions magnify what there is"
            f" of it {self.times:.1f} times: each 0.1 % moves {self.name} by {moved},"
            " which is not in the uncertainties; hold each axis up and down, or"
            " estimate it (--cross) from nine positions or more"
        )


def magnified(
    given: Given, search: Search, names: Sequence[str], nominal: State
) -> Magnified | None:
    """The worst that cross-coupling does to the parameters of a set, by (1).

    None where the set estimates it or determines nothing of the accelerometers.
    """
    if given.left_out is None:
        return None
    there = search.evaluated(given.members).state
    added = _added(given, given.left_out, there, nominal)
    found = []
    for name in names:
        parameter = ParameterName.of(name)
        if parameter.sensor == "acc":
            whole = 1.0 if parameter.is_scale else G0
            one = added[given.names.index(name)] * PER_MILLE
            unit = "" if parameter.is_scale else "m/s²"
            found.append(Magnified(name, unit, one, one / PER_MILLE / whole))
    return max(found, key=lambda m: m.times, default=None)


def _added(given: Given, group: Group, there: Eliminated, nominal: State) -> Array:
    """What not knowing a group adds to each parameter, over its usual size.

    Back comes (k,), 1 sigma, in units of the parameter.
    """
    inner, _ = there.rest(group.columns, group.typical)
    unknown = np.linalg.inv(np.eye(len(inner)) + inner)  # C / T^2
    rows = there.rows.matrix(there.columns, group.columns)
    picked, _ = picked_by(given, there.columns, nominal)
    moved = picked @ there.inverse @ rows  # D
    var = np.einsum("ki,ij,kj->k", moved, unknown, moved)
    out: Array = np.sqrt(np.maximum(var, 0.0))
    return out
