"""Changes of a level that are no push: a jump, and what fades after a turn."""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

AROUND_S = 6.0
"""Before and after a disturbance, where a jump of the level shows."""


BESIDE_S = 1.5
"""How much of that is on either side of it at least: a jump bends the course of two of
its parts."""


FADES_S = (1.0, 1.5, 2.0, 3.0, 4.5)
"""Time constants of exponential changes after a turn; slower ones are no bumps."""


def steady_changes(near: Array, at: tuple[int, int], rate: float) -> list[Array]:
    """Courses (n, 6) of a jump and of exponential changes, fitted to the samples."""
    known = np.nan_to_num(near)
    jump = _level_jump(known, round(BESIDE_S * rate))
    courses = [] if jump is None else [jump]
    if at[0] < round(AROUND_S * rate):
        courses += [_exponential_change(known, tau * rate) for tau in FADES_S]
    return courses


def _level_jump(z: Array, margin: int) -> Array | None:
    """Step function where the means before and after differ most, (n, 6).

    None if that leaves fewer than `margin` samples on one side.
    """
    n, each = len(z), np.arange(1, len(z))[:, None]
    total = np.cumsum(z, axis=0)
    before = total[:-1] / each
    after = (total[-1] - total[:-1]) / (n - each)
    gain = ((after - before) ** 2 * each * (n - each)).sum(axis=1)
    at = int(np.argmax(gain))
    if min(at + 1, n - at - 1) < margin:
        return None
    level: Array = np.where(np.arange(n)[:, None] <= at, before[at], after[at])
    return level


def _exponential_change(z: Array, tau: float) -> Array:
    """Fit of an exponential change towards a level, (n, 6); `tau` in samples."""
    design = np.column_stack([np.ones(len(z)), np.exp(-np.arange(len(z)) / tau)])
    course: Array = design @ np.linalg.lstsq(design, z, rcond=None)[0]
    return course
