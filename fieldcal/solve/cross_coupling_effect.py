"""Effect of cross-coupling that was not estimated, in unfavourable positions.

A set without cross-coupling assumes orthogonal axes. If the device has a coefficient k,
it moves the parameters by D k, and the rows would determine k to a variance of C:

    D = P_tA Phi_A^T R^-1 Phi_k,    C = (1 / T^2 + M_kk)^-1                        (1)

with A the columns of the set, P their covariance, T the typical size of k, and M_kk the
information of the rows on k with the set eliminated. The unknown k adds D C D^T to the
covariance of the parameters. If each axis is held up and down, a bias moves by k g. Few
or similar positions may magnify this many times; the stated uncertainties, which do not
include it, are then far too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration.gauge import GROUPS
from fieldcal.calibration.names import ParameterName
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.model.causes.cause import Group
from fieldcal.solve.averaging import parameter_matrix
from fieldcal.solve.estimation import ParameterEstimate


@dataclass(frozen=True, slots=True)
class CrossCouplingEffect:
    """Effect of omitted cross-coupling on the parameter that it moves most.

    Attributes
    ----------
    name, unit : name and unit of the parameter
    shift_per_unit : 1 sigma of the parameter for a coefficient of one
    magnification : `shift_per_unit` over gravity for a bias, over 1 for a scale factor
    assumed_sigma : cross-coupling that the set assumes, 1 sigma

    """

    name: str
    unit: str
    shift_per_unit: float
    magnification: float
    assumed_sigma: float

    @property
    def sentence(self) -> str:
        """The size of the effect, and the remedy."""
        moved = f"{self.shift_per_unit / 1000:.2g} {self.unit}".removesuffix(" 1")
        return (
            f"cross-coupling {self._beyond}is taken as zero, and these positions"
            f" magnify its effect {self.magnification:.1f} times: each 0.1 % moves"
            f" {self.name} by {moved}, which"
            " the uncertainties do not include; hold each axis up and down, or estimate"
            " cross-coupling (--cross) from nine positions or more"
        )

    @property
    def _beyond(self) -> str:
        return (
            f"beyond ± {100 * self.assumed_sigma:.2g} % " if self.assumed_sigma else ""
        )


def largest_cross_coupling_effect(
    estimate: ParameterEstimate,
) -> CrossCouplingEffect | None:
    """The largest effect of cross-coupling on the parameters of a set, by (1).

    None if the set estimates it, if no parameter of the accelerometers is determined,
    or if the positions do not magnify it.
    """
    parameter_set = estimate.parameter_set
    if parameter_set.omitted_cross_coupling is None:
        return None
    added = _added_sigma(estimate, parameter_set.omitted_cross_coupling)
    every = []
    for name in estimate.names:
        parameter = ParameterName.of(name)
        if parameter.sensor == "acc":
            moved = float(added[parameter_set.names.index(name)])
            times = moved / (1.0 if parameter.is_scale else G0)
            unit = GROUPS[parameter.group][2]
            square = parameter_set.options.factory.cross_coupling
            every.append(CrossCouplingEffect(name, unit, moved, times, square))
    worst = max(every, key=lambda m: m.magnification, default=None)
    return worst if worst and worst.magnification > 1 else None


def _added_sigma(estimate: ParameterEstimate, group: Group) -> Array:
    """Uncertainty of each parameter from an unknown group, over its usual size.

    Returns (k,), 1 sigma, in units of the parameter.
    """
    state = estimate.sets.evaluate(estimate.parameter_set.members).state
    inner, _ = state.schur_complement(group.columns, group.typical)
    unknown = np.linalg.inv(np.eye(len(inner)) + inner)  # C / T^2
    rows = state.rows.matrix(state.columns, group.columns)
    moved = (
        parameter_matrix(estimate.parameter_set, state.columns) @ state.inverse @ rows
    )  # D
    var = np.einsum("ki,ij,kj->k", moved, unknown, moved)
    out: Array = np.sqrt(np.maximum(var, 0.0))
    return out
