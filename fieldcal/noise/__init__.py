"""Random processes of a device at rest: their sizes, and predictions from them.

`processes` has the Allan variances. `levels` and `disturbed` reduce a recording in one
pass. `cosine`, `likelihood`, `reference`, `terms`, `covariates` and `estimate` estimate
the processes. `prediction`, `filters`, `recalibration`, `alignment` and `averaging`
draw conclusions. The package knows no effects, positions or calibrations. A new process
needs its Allan variance and covariance in `processes`, and the variance of its cosine
coefficients in `cosine`.
"""

from __future__ import annotations

from fieldcal.noise.estimate import (
    ChannelEstimate,
    NoiseModel,
    ProcessSize,
    estimate_noise,
)
from fieldcal.noise.reduction import Reduction, reduce_recording

__all__ = [
    "ChannelEstimate",
    "NoiseModel",
    "Reduction",
    "ProcessSize",
    "estimate_noise",
    "reduce_recording",
]
