"""Adds a jump of the biases that a recording shows to the info of its calibration."""

from __future__ import annotations

from dataclasses import replace

from fieldcal.calibration import Calibration
from fieldcal.core.samples import CHANNELS
from fieldcal.diagnosis.explain import Explanation
from fieldcal.diagnosis.findings.found_effects import parameter_estimates

JUMP = "bias_step"

NAMES = dict(
    zip(
        CHANNELS,
        (f"{group}.{axis}" for group in ("acc_bias", "gyr_bias") for axis in "xyz"),
        strict=True,
    )
)
"""Full name of each channel's bias."""


def with_jump(calibration: Calibration, shown: Explanation) -> Calibration:
    """Add a jump of biases that the recording shows to `info`.

    `jump` has the time `at_s`, and under `bias`, by full name, change and standard
    uncertainty, m/s^2 and rad/s, as far as the recording determines them.
    """
    for cause in shown.probable_causes:
        if cause.name == JUMP:
            estimates = parameter_estimates(shown, cause)
            bias = {
                NAMES[channel]: [quantity.value, quantity.sigma]
                for channel, quantity in estimates.items()
                if channel in NAMES
            }
            info = {"at_s": estimates["at_s"].value, "bias": bias}
            return replace(calibration, info={**calibration.info, "jump": info})
    return calibration
