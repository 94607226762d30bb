"""Random processes of a device at rest: how large, how sure, and what follows.

Here live the processes (`processes`), what a recording is reduced to in one pass
(`levels`, `disturbed`), their estimation (`cosine`, `likelihood`, `reference`, `terms`,
`covariates`, `estimate`), and what the answer says of other recordings (`prediction`,
`filters`, `recalibration`, `alignment`, `averaging`). No effect of the catalogue, no
position and no calibration is known here. To add a process: its Allan variance and
covariance in `processes`, the variance of its cosine coefficients in `cosine`.
"""

from __future__ import annotations

from fieldcal.noise.estimate import ChannelEstimate, NoiseModel, Size, estimate
from fieldcal.noise.reduction import Reduction, reduced

__all__ = ["ChannelEstimate", "NoiseModel", "Reduction", "Size", "estimate", "reduced"]
