"""Converts samples that a device corrected with several calibrations of its own to one.

A device that corrects its own samples sends  U = (r - o) k  of its sensor's output r.
The offsets o and scales k may change during a recording: an autopilot averages its
gyroscopes at each start. From one set (o, k) to another (o', k'), axis by axis,

    U' = (U / k + o - o') k'                                                        (1)

A ``device`` mark of marks.jsonl states o and k in ``in_samples``. They hold for samples
after its ``at_s``. The earlier ones hold until its ``until_s``, when they were last
read, or, if a run was broken off, until the last window, since a window is accepted
only after they were read again. Samples in between belong to neither and are left out.

Units m/s^2, rad/s; device axes; s of device time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Block, concat

NO_CORRECTION = {
    "acc_offset": [0.0] * 3,
    "acc_scale": [1.0] * 3,
    "gyr_offset": [0.0] * 3,
}
"""Offsets and scales of a device that corrects nothing."""


@dataclass(frozen=True, slots=True)
class InstalledStretch:
    """Stretch of samples with one set of offsets and scales.

    Attributes
    ----------
    after, until : s; the samples lie after `after`, up to `until`
    corrections : offsets and scales by name; None where they are not known
    taken_out : whether the device was told to correct nothing

    """

    after: float
    until: float
    corrections: Mapping[str, Any] | None
    taken_out: bool


def installed_stretches(marks: Iterable[Mapping[str, Any]]) -> list[InstalledStretch]:
    """Stretches of samples with one set of offsets and scales; empty if not stated."""
    found: list[InstalledStretch] = []
    window_end = -np.inf
    for mark in marks:
        if mark.get("event") == "window":
            window_end = float(mark["end_s"])
        told = mark.get("installed") if mark.get("event") == "device" else None
        if not isinstance(told, Mapping) or "in_samples" not in told:
            continue
        used, out = told["in_samples"], bool(told.get("taken_out"))
        if found and found[-1].corrections == used:
            continue
        after = -np.inf
        if found:
            after = float(mark.get("at_s", window_end))
            until = float(mark.get("until_s", window_end))
            found[-1] = replace(found[-1], until=min(until, after))
        found.append(InstalledStretch(after, np.inf, used, out))
    return found


def under_last_calibration(
    block: Block, marks: Iterable[Mapping[str, Any]]
) -> tuple[Block, tuple[str, ...]]:
    """Samples converted to the offsets and scales of the last stretch, (1).

    Parameters
    ----------
    block : in SI units
    marks : of the session

    Returns
    -------
    The samples without those of unknown offsets and scales, and warnings.

    """
    parts = installed_stretches(marks)
    if len(parts) < 2:
        return block, ()
    last = parts[-1]
    goal = NO_CORRECTION if last.taken_out else last.corrections
    kept = []
    for part in parts:
        some = block.between(
            np.nextafter(part.after, np.inf), np.nextafter(part.until, np.inf)
        )
        if part is last and not last.taken_out:
            kept.append(some)
        elif goal is not None and part.corrections is not None:
            kept.append(_converted(some, part.corrections, goal))
    whole = concat(kept)
    said = (
        "the device changed its own calibration while it was recorded, as autopilots"
        " do when they start: its samples are taken as under the last one, and"
        f" {len(block) - len(whole)} are left out, for which it is not known",
    )
    return whole, said


def _last_corrections(marks: Iterable[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Offsets and scales of the last stretch; None if there are none, or not known."""
    last = ([None, *installed_stretches(marks)])[-1]
    return None if last is None or last.taken_out else last.corrections


def subtracts_gyro_offset(marks: Iterable[Mapping[str, Any]]) -> bool:
    """Whether the device is known to subtract an offset from its gyroscopes."""
    used = _last_corrections(marks)
    return used is not None and bool(np.any(used["gyr_offset"]))


def nominal_as_sent(
    nominal: Mapping[str, Array], marks: Iterable[Mapping[str, Any]]
) -> dict[str, Array]:
    """Biases and scales in the sent samples of a sensor with the nominal ones.

    Parameters
    ----------
    nominal : biases and scales of the sensor, (3,) each, SI
    marks : of the session

    """
    used = _last_corrections(marks)
    if used is None:
        return dict(nominal)
    o, k, w = (np.array(used[n], float) for n in NO_CORRECTION)
    return {
        **nominal,
        "acc_bias": (nominal["acc_bias"] - o) * k,  # U = (r - o) k
        "acc_scale": nominal["acc_scale"] * k,
        "gyr_bias": nominal["gyr_bias"] - w,
    }


def _converted(block: Block, used: Mapping[str, Any], goal: Mapping[str, Any]) -> Block:
    o, k, w = (np.array(used[n], float) for n in NO_CORRECTION)
    to, scale, rate = (np.array(goal[n], float) for n in NO_CORRECTION)
    acc: Array = (block.acc / k + o - to) * scale  # (1)
    return replace(block, acc=acc, gyr=block.gyr + w - rate)
