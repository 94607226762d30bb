"""Permanent groups of the site and the set-up: what nobody knows exactly there.

Gravity, the Earth's rate where the orientation is not known, speeds of a rate table
whose axis is not known, times that were counted from a nominal rate, and errors of
rounding that all windows share.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcal.core.frames import EARTH_RATE
from fieldcal.core.samples import ACC, Array
from fieldcal.model import priors
from fieldcal.model.causes import columns
from fieldcal.model.causes.basis import Course, General
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable


def gravity_group(table: ColumnTable) -> Iterator[Group]:
    """Group of the uncertainty of gravity, which all accelerometers share."""
    if table.x.gravity_sigma and table.used[:, ACC].any():
        at = table.add(General("gravity", columns.gravity), 1)
        size = np.array([table.x.gravity_sigma / table.x.gravity])
        yield Group("gravity", "acc", at, size, fixed_size=1.0)


def unoriented_earth_groups(table: ColumnTable) -> Iterator[Group]:
    """Groups of the Earth's rate in positions of unknown orientation.

    In a session of one position it is part of the bias.
    """
    if not table.has_gyroscopes or len(table.window_positions) < 2:
        return
    shown = table.x.earth_seen
    if shown.any():
        basis = General("earth aside", columns.earth_rate_direction)
        held = np.unique(table.x.position[shown])
        own = table.add(basis, 2 * table.position_count).reshape(-1, 2)[held].ravel()
        wide = np.full(len(own), 1 / priors.FREE_SIZE)
        yield Group("earth aside", "gyr", own, wide, fixed_size=priors.FREE_SIZE)
    if table.x.earth_unseen.any():
        at = table.add(General("earth anyhow", columns.earth_rate_unoriented), 4)
        size = EARTH_RATE * np.array([3**-0.5, 3**-0.5, 3**-0.5, 1.0])
        yield Group("earth anyhow", "gyr", at, size, fixed_size=1.0)


def speed_group(table: ColumnTable) -> Iterator[Group]:
    """Group of the errors of a rate table's speeds, if its axis is not known.

    There is one relative error for each speed. It includes the Earth's rate along
    the axis of the table, which does not depend on the orientation of the device.
    """
    known = np.unique(table.x.speed[table.x.speed > 0])
    if not len(known) or not table.has_gyroscopes:
        return
    at = table.add(General("speed", columns.speed(known)), len(known))
    error = np.array([table.x.speed_sigma[table.x.speed == v].max() for v in known])
    wide = np.hypot(error, EARTH_RATE / 3**0.5) / known
    yield Group("speed", "gyr", at, wide, fixed_size=1.0)


def clock_group(table: ColumnTable) -> Iterator[Group]:
    """Group of the error of times that were counted from a nominal sampling rate.

    All gyroscopes share it during turns, where it looks like their scale factors.
    """
    if table.x.clock_sigma and table.has_gyroscopes:
        at = table.add(General("clock", columns.clock), 1)
        yield Group("clock", "gyr", at, np.array([table.x.clock_sigma]), fixed_size=1.0)


def rounding_group(table: ColumnTable, sizes: Array | None) -> Iterator[Group]:
    """Group of the errors of rounding and of dead bands that all windows share.

    They act while an output keeps its value; where outputs change they average out.
    """
    if sizes is None or not len(some := np.flatnonzero(sizes)):
        return
    even = Course(
        "rounding", lambda v: np.ones((len(v.x.t), 1)), 1, while_output_stands=True
    )
    at = table.add(even, 6)
    yield Group("rounding", "", at[some], sizes[some], fixed_size=1.0)
