"""Reads the noise of a device for `fieldcal plan`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from fieldcal.core.errors import PlanError, SessionError

if TYPE_CHECKING:
    from fieldcal.planning.device_noise import DeviceNoise


def read_device_noise(path: Path, triad: Literal["acc", "gyr"]) -> DeviceNoise:
    """Noise of a device, from its noise.json, that of one triad at least.

    Raises
    ------
    SessionError
        If there is no noise.json, or it is invalid.
    PlanError
        If the triad was not recorded.

    """
    from fieldcal.planning.device_noise import device_noise_from
    from fieldcal.session.noise_file import read_noise

    content = read_noise(path)
    if content is None:
        raise SessionError(
            f"{path}: has no noise.json; run fieldcal noise on a recording at rest"
        )
    found = device_noise_from(content)
    if getattr(found, triad) is None:
        sensors = {"acc": "accelerometers", "gyr": "gyroscopes"}[triad]
        raise PlanError(
            f"{path}: says nothing of the {sensors}, which this plan calibrates: state"
            " a grade with --noise instead"
        )
    return found
