"""Samples as if the device had applied one calibration of its own to all of them.

A device that corrects its own samples sends  U = (r - o) k  of its sensor's output r,
with offsets o and scales k that may change while it is recorded: an autopilot averages
its gyroscopes at each start. From one set (o, k) to another (o', k'), axis by axis,

    U' = (U / k + o - o') k'                                                        (1)

A ``device`` mark of marks.jsonl tells o and k in ``in_samples``. They hold for samples
after its ``at_s``; those before hold until its ``until_s``, when they were last read,
or, where a run was broken off, until the last window, since a window counts only after
they were read once more. What lies in between belongs to neither, and is left out.

Units m/s^2, rad/s; device axes; s of device time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fieldcal.core.samples import Array, Block, concat

NOTHING = {"acc_offset": [0.0] * 3, "acc_scale": [1.0] * 3, "gyr_offset": [0.0] * 3}
"""What is in the samples of a device that corrects nothing."""


@dataclass(frozen=True, slots=True)
class InstalledStretch:
    """Samples that hold one set of offsets and scales.

    Attributes
    ----------
    after, until : s; the samples lie after the first, up to the second
    used : offsets and scales by name; None where they are not known
    taken_out : whether the device was told to correct nothing

    """

    after: float
    until: float
    used: Mapping[str, Any] | None
    taken_out: bool


def stretches(marks: Iterable[Mapping[str, Any]]) -> list[InstalledStretch]:
    """What was in the samples, stretch by stretch; empty where nobody said so."""
    found: list[InstalledStretch] = []
    window_end = -np.inf
    for mark in marks:
        if mark.get("event") == "window":
            window_end = float(mark["end_s"])
        told = mark.get("installed") if mark.get("event") == "device" else None
        if not isinstance(told, Mapping) or "in_samples" not in told:
            continue
        used, out = told["in_samples"], bool(told.get("taken_out"))
        if found and found[-1].used == used:
            continue
        after = -np.inf
        if found:
            after = float(mark.get("at_s", window_end))
            until = float(mark.get("until_s", window_end))
            found[-1] = replace(found[-1], until=min(until, after))
        found.append(InstalledStretch(after, np.inf, used, out))
    return found


def in_one_calibration(
    block: Block, marks: Iterable[Mapping[str, Any]]
) -> tuple[Block, tuple[str, ...]]:
    """Samples with the offsets and scales that the last of them have, (1).

    Parameters
    ----------
    block : in SI units
    marks : of the session

    Returns
    -------
    The samples, without those of which it is not known, and what must be known of it.

    """
    parts = stretches(marks)
    if len(parts) < 2:
        return block, ()
    last = parts[-1]
    goal = NOTHING if last.taken_out else last.used
    kept = []
    for part in parts:
        some = block.between(
            np.nextafter(part.after, np.inf), np.nextafter(part.until, np.inf)
        )
        if part is last and not last.taken_out:
            kept.append(some)
        elif goal is not None and part.used is not None:
            kept.append(_from_to(some, part.used, goal))
    whole = concat(kept)
    said = (
        "the device changed its own calibration while it was recorded, as autopilots"
        " do when they start: its samples are taken as under the last one, and"
        f" {len(block) - len(whole)} are left out, for which it is not known",
    )
    return whole, said


def _applied(marks: Iterable[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Offsets and scales that the last samples hold; None if none, or not known."""
    last = ([None, *stretches(marks)])[-1]
    return None if last is None or last.taken_out else last.used


def tells_an_offset(marks: Iterable[Mapping[str, Any]]) -> bool:
    """Whether the device said that it subtracts an offset from its gyroscopes."""
    used = _applied(marks)
    return used is not None and bool(np.any(used["gyr_offset"]))


def as_sent(
    nominal: Mapping[str, Array], marks: Iterable[Mapping[str, Any]]
) -> dict[str, Array]:
    """What a sensor of nominal errors would send, corrected as `in_one_calibration` is.

    Parameters
    ----------
    nominal : biases and scales of the sensor, (3,) each, SI
    marks : of the session

    """
    used = _applied(marks)
    if used is None:
        return dict(nominal)
    o, k, w = (np.array(used[n], float) for n in NOTHING)
    return {
        **nominal,
        "acc_bias": (nominal["acc_bias"] - o) * k,  # U = (r - o) k
        "acc_scale": nominal["acc_scale"] * k,
        "gyr_bias": nominal["gyr_bias"] - w,
    }


def _from_to(block: Block, used: Mapping[str, Any], goal: Mapping[str, Any]) -> Block:
    o, k, w = (np.array(used[n], float) for n in NOTHING)
    to, scale, rate = (np.array(goal[n], float) for n in NOTHING)
    acc: Array = (block.acc / k + o - to) * scale  # (1)
    return replace(block, acc=acc, gyr=block.gyr + w - rate)
