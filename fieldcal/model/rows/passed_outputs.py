"""Integral of the outputs since the start of a recording.

    X(t) = integral of y(s) / k ds from the first sample to t                       (1)

y output and k the nominal size of one of its sensor, outputs per SI unit: the same of
three axes, as y is what a filter has, whatever their scale factors are. Outputs that
are missing keep the last known value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from fieldcal.core.last_known import last_known
from fieldcal.core.running_integral import running_integral
from fieldcal.core.samples import Array, Block
from fieldcal.model import resolutions


@dataclass(frozen=True, eq=False)
class PassedOutputs:
    """The integral on a grid of instants.

    Attributes
    ----------
    t : (m,) s, device time
    values : (m, 6) m/s and rad

    """

    t: Array
    values: Array

    @classmethod
    def of(cls, block: Block, nominal: Mapping[str, Any]) -> Self:
        """Integrate the outputs of a recording with nominal scale factors, (3,)."""
        t = block.t
        rate = (len(t) - 1) / max(float(np.ptp(t)), 1e-9) if len(t) > 1 else 1.0
        step = max(int(rate * resolutions.INTEGRAL_STEP_S), 1)
        # one output at a time: an hour at 1 kHz is 30 MB of each
        kept = np.append(np.arange(0, len(t), step), len(t) - 1)
        values = np.zeros((len(kept), 6))
        for c, y in enumerate((*block.acc.T, *block.gyr.T)):
            values[:, c] = running_integral(t, last_known(y))[kept]  # (1)
        first = [nominal[name][0] for name in ("acc_scale", "gyr_scale")]
        return cls(t[kept], values / np.abs(np.repeat(first, 3)))

    def at(self, t: Array) -> Array:
        """The integral at instants (n,), (n, 6)."""
        return np.column_stack([np.interp(t, self.t, v) for v in self.values.T])

    def mean(self, t: Array, lasts: Array) -> Array:
        """Mean over rows about t that last (n,) s at rest, (n, 6)."""
        out: Array = (self.at(t - lasts / 2) + self.at(t + lasts / 2)) / 2
        return out
