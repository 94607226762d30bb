"""Rows of one file of which a part is in another unit, or at another full scale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Array
from fieldcal.importing.units.gravity_size import are_means

RATIOS = (G0, 1000.0, 1000.0 * G0, 1000.0 / G0)
"""How often one unit is in another: g, m/s^2 and mg."""

FULL_SCALES = (2.0, 4.0, 8.0)
"""How often one full scale of counts is in another."""

GROUP, QUIET, FEWEST = 8, 0.5, 6
"""Rows of which the mean is taken; the share of these groups that is looked at, the
quietest for their length; and the fewest on each side of the change."""

WITHIN = 0.15
"""Part by which the lengths of one unit differ, and two units from a ratio."""


class ChangedUnit(NamedTuple):
    """Lengths of the accelerations up to a row, and behind it."""

    row: int
    before: float
    behind: float


def changed_unit(acc: Array) -> ChangedUnit | None:
    """Where the unit of accelerations (n, 3) changes; None where it does not.

    Gravity is as long at every rest. No position and no bias makes it ten times as long
    from some row on, but alike before and behind.
    """
    known = np.flatnonzero(np.isfinite(acc).all(axis=1) & acc.any(axis=1))
    groups = known[: len(known) // GROUP * GROUP].reshape(-1, GROUP)
    if len(groups) < 2 * FEWEST or are_means(acc):
        return None
    means = acc[groups].mean(axis=1)
    length = np.linalg.norm(means, axis=1)
    spread = acc[groups].std(axis=1).max(axis=1) / np.maximum(length, 1e-300)
    quiet = np.flatnonzero(spread <= np.quantile(spread, QUIET))
    size = np.log(length[quiet])
    many = np.arange(1, len(size))
    first, last = np.cumsum(size)[:-1] / many, size[::-1].cumsum()[-2::-1] / many[::-1]
    at = int(np.argmax(np.abs(last - first) * np.sqrt(many * many[::-1]))) + 1
    parts = size[:at], size[at:]
    before, behind = (float(np.median(one)) for one in parts)
    alike = all(
        len(one) >= FEWEST and np.quantile(np.abs(one - np.median(one)), 0.9) < WITHIN
        for one in parts
    )
    counts = bool((acc[known] == np.round(acc[known])).all())
    ratios = np.log([*RATIOS, *(FULL_SCALES if counts else ())])
    usual = np.abs(ratios - abs(behind - before)).min() < WITHIN
    if not (alike and usual):
        return None
    row = int(groups[quiet[at], 0])
    return ChangedUnit(row, float(np.exp(before)), float(np.exp(behind)))
