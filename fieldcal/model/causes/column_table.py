"""The table of a session's columns: those that every session has, and appended ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from fieldcal.core.samples import GYR, Array, Index, Mask
from fieldcal.model import resolutions
from fieldcal.model.causes import columns, smooth
from fieldcal.model.causes.basis import Course, General
from fieldcal.model.causes.cause import TRIADS, Basis
from fieldcal.model.causes.wander import Wander
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import select_rows


class ColumnTable:
    """Columns of a session's rows.

    Parameters
    ----------
    x : rows of the windows
    used : (n, 6) rows with information, by channel
    since : (o, n) s since the turn, by origin
    unit : (6,) outputs per SI unit
    wander : how the biases wander inside windows

    Attributes
    ----------
    observed : channels that were measured
    measured, measured_since : `x` and `since` of rows in which some channel was
    window_positions : positions that have a window
    bases : functions that calculate columns, each with its first column
    width : number of columns
    bias, scale, small_rotation, windows, waves : first column of each kind

    """

    turns = False
    """Whether the turns between windows were recorded."""

    def __init__(
        self, x: Experience, used: Mask, since: Array, unit: Array, wander: Wander
    ) -> None:
        self.x, self.used, self.since, self.unit = x, used, since, unit
        self.observed = np.flatnonzero(np.any(used, axis=0))
        rows = np.any(used, axis=1)
        self.measured = x if rows.all() else select_rows(x, np.flatnonzero(rows))
        self.measured_since = since[:, rows]
        self.window_positions = np.unique(x.position)
        self.position_count = int(x.position.max()) + 1
        self.wander = wander
        self.span = smooth.CourseSpan(x.t, int(wander.modes.max()), x.warming)
        self.bases: list[tuple[int, Basis]] = []
        self.width = 0
        sides = columns.small_rotation_sides
        turns = General("aside", columns.small_rotation, sides, per_position=True)
        held = len(self.window_positions)
        self.bias: int = self.add(General("bias", columns.bias), 6)[0]
        self.scale: int = self.add(General("scale", columns.scale), 6)[0]
        self.small_rotation: int = self.add(turns, 2 * self.position_count)[0]
        self.windows: int = self.add_course("window", self._inside, held, False)[0]
        self.waves: int = self.add_course(
            "waves", self.span.waves, self.span.count, True
        )[0]

    def add(self, basis: Basis, width: int) -> Index:
        """Append a basis; returns its columns, (width,)."""
        self.bases.append((self.width, basis))
        self.width += width
        return np.arange(self.width - width, self.width)

    def basis_ranges(self) -> Iterator[tuple[int, int, Basis]]:
        """First column, end column and basis, of every basis."""
        ends = [*(first for first, _ in self.bases[1:]), self.width]
        for (first, basis), end in zip(self.bases, ends, strict=True):
            yield first, end, basis

    def add_course(
        self, name: str, of: Callable[[Experience], Array], width: int, timed: bool
    ) -> Index:
        """Append a function of the row on every channel; returns its columns.

        `timed` states that the function is also known during turns.
        """
        return self.add(Course(name, lambda v: of(v.x), width, timed), 6 * width)

    @property
    def has_gyroscopes(self) -> bool:
        """Whether any gyroscope was measured."""
        return bool(self.used[:, GYR].any())

    @property
    def triads(self) -> list[tuple[str, Index]]:
        """Name of each triad that was measured, with its measured channels."""
        each = ((part, np.intersect1d(c, self.observed)) for part, c in TRIADS)
        return [(part, channels) for part, channels in each if len(channels)]

    def cosine_columns(self, channel: int, count: int = resolutions.COSINES) -> Index:
        """Columns of the first cosines in time of a channel, (count,)."""
        return self.waves + channel * self.span.count + np.arange(count)

    def window_columns(self, channel: int) -> Index:
        """Columns of the offsets of a channel's windows, (p,)."""
        count = len(self.window_positions)
        return self.windows + channel * count + np.arange(count)

    @property
    def rotations(self) -> slice:
        """Columns of the small rotations of all positions."""
        return slice(self.small_rotation, self.small_rotation + 2 * self.position_count)

    def rotations_of(self, positions: ArrayLike) -> Index:
        """Columns of the small rotations of some positions, two of each, (2 m,)."""
        first = 2 * np.atleast_1d(positions)[:, None]
        return (self.small_rotation + first + [0, 1]).ravel()

    def _inside(self, x: Experience) -> Array:
        inside: Array = np.equal.outer(x.position, self.window_positions).astype(float)
        return inside
