"""What an accelerometer feels across its axis, if the calibration does not contain it.

The recording may show cross-coupling that was not requested. Bias and scale factor take
it into account, but whoever applies them alone leaves it in the forces: of axes that
are not square, or of a device that is fastened askew.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from fieldcal.solve.estimation import ParameterEstimate


@dataclass(frozen=True, slots=True)
class CouplingLeftOut:
    """The largest coefficient.

    Attributes
    ----------
    axis : of the accelerometer
    of : axis along which the force acts
    value, sigma : part of the force, and its uncertainty

    """

    axis: str
    of: str
    value: float
    sigma: float

    def to_json(self) -> dict[str, str | float]:
        """As in result.json."""
        return asdict(self)


def largest_coupling_left_out(estimate: ParameterEstimate) -> CouplingLeftOut | None:
    """The largest coefficient of the likeliest explanation; None if it has none."""
    end, mixture = estimate.parameter_set.end_values, estimate.mixture
    values = np.zeros(estimate.parameter_set.width)
    values[mixture.columns] = mixture.mean
    shown = end.coupling(values)[:3, :3]
    if not shown.any():
        return None
    c, j = divmod(int(np.abs(shown).argmax()), 3)
    row = end.slopes[c, j, mixture.columns]
    sigma = float(np.sqrt(row @ mixture.covariance @ row))
    return CouplingLeftOut("xyz"[c], "xyz"[j], float(shown[c, j]), sigma)
