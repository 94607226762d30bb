"""Samples that are not those of one IMU, as they were recorded.

Whatever corrects samples comes after this: it hides what is looked for here.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcal.core.samples import Block
from fieldcal.session.direction_alone import refuse_direction_alone
from fieldcal.session.duplicate_channels import refuse_duplicate_channels
from fieldcal.session.mixed_devices import refuse_mixed_devices


def refuse_samples_of_no_imu(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> None:
    """Refuse samples that no single IMU sends.

    Parameters
    ----------
    block : samples as recorded
    windows : start and end of each rest, s; None where there is none

    Raises
    ------
    InputError
        If a channel is another's copy, accelerations are a direction, or samples are of
        two devices.

    """
    refuse_duplicate_channels(block)
    refuse_direction_alone(block, windows)
    refuse_mixed_devices(block, windows)
