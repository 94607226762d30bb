"""Whether rows of several names are those of one device that a column labels.

A module that charges and then idles, or an IMU whose column holds its temperature, is
one device: where the name changes, its time goes on as from row to row. Of two devices
whose rows lie one behind the other, it begins anew, or leaps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array

USUAL = 5.0
"""Usual steps within which a time goes on."""

SELDOM = 0.05
"""Share of the rows at which the name changes, of rows that do not come in turn."""


class NameChanges:
    """Times at which a name changes, piece by piece of a file.

    Attributes
    ----------
    rows, changes : that were seen

    """

    def __init__(self) -> None:
        self.rows = self.changes = 0
        self._steps: list[Array] = []
        self._across: list[Array] = []
        self._last: tuple[object, float] | None = None

    def feed(self, names: NDArray[np.generic], t: Array) -> None:
        """Take the names (n,) and times (n,) of some rows in."""
        if not len(t):
            return
        steps = np.diff(t)
        differ = names[1:] != names[:-1]
        if self._last is not None:
            steps = np.insert(steps, 0, t[0] - self._last[1])
            differ = np.insert(differ, 0, bool(names[0] != self._last[0]))
        self._last = (names[-1], float(t[-1]))
        self.rows += len(t)
        self.changes += int(differ.sum())
        self._across.append(steps[differ])
        # a few of each piece tell what is usual
        self._steps.append(steps[~differ][:1000])

    def skip(self, name: str, first: float, last: float, many: int) -> None:
        """Take so many rows of one name in, by the times of the first and the last."""
        if self._last is not None and name != self._last[0]:
            self.changes += 1
            self._across.append(np.array([first - self._last[1]]))
        self._last = (name, last)
        self.rows += many

    @property
    def go_on(self) -> bool:
        """Whether the time goes on wherever the name changes."""
        if not 0 < self.changes <= SELDOM * self.rows:
            return False
        within = np.concatenate(self._steps)
        within = within[within > 0]
        across = np.concatenate(self._across)
        if not len(within) or not np.isfinite(across).all():
            return False
        most = USUAL * float(np.median(within))
        return bool(((across > 0) & (across <= most)).all())
