"""A jump of the biases that a recording shows, stated beside its calibration."""

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


def with_jump(found: Calibration, shown: Explanation) -> Calibration:
    """The calibration with how much which bias jumps, and when, in its `info`.

    `jump` has `at_s`, and under `bias` by full name what it changes by and its standard
    uncertainty, m/s^2 and rad/s, as far as the recording determines it.
    """
    for standing in shown.probable_causes:
        if standing.name == JUMP:
            told = parameter_estimates(shown, standing)
            bias = {
                NAMES[channel]: [quantity.value, quantity.sigma]
                for channel, quantity in told.items()
                if channel in NAMES
            }
            info = {"at_s": told["at_s"].value, "bias": bias}
            return replace(found, info={**found.info, "jump": info})
    return found
