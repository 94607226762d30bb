"""Whether a device lay still in what counts as its rest.

Disturbances end a stretch or are bridged, but a device that turns all the time has
none: that is how it behaves. Gravity shows a turn about a level axis, and rates that no
bias is show one about the vertical.
"""

from __future__ import annotations

import numpy as np

from fieldcal.calibration.plausible import UNREAL
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.noise.levels import ReducedStretch
from fieldcal.noise.reduction import Reduction

MEAN_S = 1.0
"""Time over which samples are averaged, s: what is quicker is noise or vibration."""

MAX_LEAN_DEG = 10.0
"""Angle by which nothing that lies leans while it settles, deg."""

FORCE_OF_GRAVITY = 0.2
"""Part of g by which a mean force may differ from it: in other units it is no force."""


def refuse_turned(recording: Reduction, name: str) -> None:
    """Refuse a recording of a device that turns in a stretch at rest.

    Parameters
    ----------
    recording : reduced
    name : of the recording, for the message

    Raises
    ------
    InputError
        If it turned.

    """
    for stretch in recording.stretches:
        means = _means(stretch)
        if not len(means):
            continue
        turned = ""
        if recording.known[ACC].all() and (lean := _lean_deg(means[:, ACC])):
            turned = f"leans by {lean:.0f}°"
        rate = float(np.abs(np.median(means[:, GYR], axis=0)).max())
        if recording.known[GYR].any() and rate > UNREAL["gyr_bias"]:
            turned = f"reads {np.rad2deg(rate):.3g} deg/s, which no bias is,"
        if turned:
            raise InputError(
                f"{name}: the device {turned} in {stretch.samples * stretch.dt:.0f} s"
                " that count as rest: let it lie still, or write down in session.toml"
                " when it did, with a [[position]] for each rest"
            )


def _means(stretch: ReducedStretch) -> Array:
    """Means over `MEAN_S` or more, (n, c)."""
    each = max(round(MEAN_S / (stretch.m * stretch.dt)), 1)
    n = len(stretch.means) // each
    rows = stretch.means[: n * each].reshape(n, each, -1)
    out: Array = rows.mean(axis=1) + stretch.origin
    return out


def _lean_deg(acc: Array) -> float:
    """Largest angle between the first force and the others, deg; 0 if it was held."""
    size = np.linalg.norm(acc, axis=1)
    if abs(float(np.median(size)) / G0 - 1) > FORCE_OF_GRAVITY:
        return 0.0
    up = acc / size[:, None]
    angle = float(np.rad2deg(np.arccos(np.clip(up @ up[0], -1.0, 1.0).min())))
    return angle if angle > MAX_LEAN_DEG else 0.0
