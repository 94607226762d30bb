"""The columns of a session: what every session has of them, and where more begin."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fieldcal.core.samples import Array, Index
from fieldcal.model.causes import columns, smooth
from fieldcal.model.causes.cause import Basis
from fieldcal.model.causes.columns import Course, General
from fieldcal.model.causes.wander import Wander
from fieldcal.physics.experience import Experience


class ColumnTable:
    """Columns of a session's rows.

    Parameters
    ----------
    x : rows of the windows
    used : (n, 6) rows that say something, by channel
    since : (o, n) s since the turn, by origin
    unit : (6,) outputs per SI unit
    wander : how the biases wander inside windows

    Attributes
    ----------
    observed : channels that were measured
    held : positions that have a window
    bases : what columns are, each with the first that it has
    width : columns so far
    bias, scale, small_rotation, windows, waves : the first column of each kind

    """

    turns = False
    """Whether the ways between windows were recorded."""

    def __init__(
        self,
        x: Experience,
        used: NDArray[np.bool_],
        since: Array,
        unit: Array,
        wander: Wander,
    ) -> None:
        self.x, self.used, self.since, self.unit = x, used, since, unit
        self.observed = np.flatnonzero(np.any(used, axis=0))
        self.held = np.unique(x.position)
        self.places = int(x.position.max()) + 1
        self.wander = wander
        self.span = smooth.CourseSpan(x.t, int(wander.modes.max()))
        self.bases: list[tuple[int, Basis]] = []
        self.width = 0
        self.bias = self.add(General("bias", columns.bias), 6)
        self.scale = self.add(General("scale", columns.scale), 6)
        turns = General(
            "aside",
            columns.small_rotation,
            sides=columns.small_rotation_sides,
            each=True,
        )
        self.small_rotation = self.add(turns, 2 * self.places)
        self.windows = self.course("window", self._inside, len(self.held), False)
        self.waves = self.course("waves", self.span.waves, self.span.count, True)

    def add(self, basis: Basis, width: int) -> int:
        """Append a basis; back comes its first column."""
        start = self.width
        self.bases.append((start, basis))
        self.width += width
        return start

    def spans(self) -> Iterator[tuple[int, int, Basis]]:
        """Every basis with its first column, and the first of the next one."""
        ends = [*(first for first, _ in self.bases[1:]), self.width]
        for (first, basis), end in zip(self.bases, ends, strict=True):
            yield first, end, basis

    def course(
        self, name: str, of: Callable[[Experience], Array], width: int, timed: bool
    ) -> int:
        """Append a function of the row on every channel; back comes its first column.

        `timed` says that it is known on the way between windows as well.
        """
        return self.add(Course(name, lambda v: of(v.x), width, timed), 6 * width)

    def wave(self, channel: int, count: int = smooth.WAVES) -> Index:
        """Columns of a channel's first cosines, (count,)."""
        at: Index = self.waves + channel * self.span.count + np.arange(count)
        return at

    def window(self, channel: int) -> Index:
        """Columns of what each window of a channel is off by, (p,)."""
        count = len(self.held)
        at: Index = self.windows + channel * count + np.arange(count)
        return at

    @property
    def rotations(self) -> slice:
        """Columns of the small rotations of all positions."""
        return slice(self.small_rotation, self.small_rotation + 2 * self.places)

    def rotations_of(self, positions: ArrayLike) -> Index:
        """Columns of the small rotations of some positions, two of each, (2 m,)."""
        first = 2 * np.atleast_1d(positions)[:, None]
        at: Index = (self.small_rotation + first + [0, 1]).ravel()
        return at

    def _inside(self, x: Experience) -> Array:
        inside: Array = np.equal.outer(x.position, self.held).astype(float)
        return inside
