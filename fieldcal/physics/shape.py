"""Shape parameters, in which the outputs are not linear: ranges and values to try."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fieldcal.core.samples import Array, Mask
from fieldcal.physics.experience import Experience

POINTS = 16
"""Values of a time constant to try: an exponential changes little from one to the
next."""

ONSETS = 12
"""Instants to try at most at which something begins to change: it changes little in the
time of a position."""

PIECES = 4
"""Instants to try within a window; the best is refined by the samples."""

INSTANTS = 36
"""And in all at least: of one long window no piece may be so long that what changes
amid it looks like a walk."""

BREAK_S = 0.2
"""Time between two rows of a window that something was left out in, s."""

WITHIN = (0.25, 0.08, 0.025, 0.008)
"""Parts of a row by which an instant is moved in it, closer and closer."""

FINEST = 1.06
"""Smallest ratio of neighbouring time constants."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A parameter that the outputs are not linear in, and the range to search.

    `kind` says what it is: a time constant of the "session", since the "turn" or since
    each turn of a "joint", an "instant" of a jump, the "onset" of a gradual change, or
    the "frequency" of a line, which is found in the spectrum. `points` are the time
    constants to try.
    """

    name: str
    unit: str
    low: float = 0.0
    high: float = np.inf
    kind: Literal["session", "turn", "joint", "instant", "onset", "frequency"] = (
        "frequency"
    )
    points: int = POINTS

    @property
    def is_instant(self) -> bool:
        """Whether it is when something begins, by a jump or gradually."""
        return self.kind in ("instant", "onset")

    def grid(self, x: Experience, since: Array) -> Iterator[tuple[float, int]]:
        """Values to try in rows, each with the origin that times count from.

        `since` (o, n) is the time since the turn, by origin.
        """
        span = float(np.ptp(x.t))
        if self.kind == "instant":
            yield from ((float(at), 0) for at in instants(x))
        elif self.kind == "onset":
            yield from ((float(at), 0) for at in onsets(x))
        elif self.kind == "session":
            low, high = max(self.low, span / 20), min(self.high, 3 * span)
            for tau in self._time_constants(low, high):
                yield tau, 0
        elif self.kind in ("turn", "joint"):
            # joints know by themselves when they were turned
            origins = since[:1] if self.kind == "joint" else since
            for origin, times in enumerate(origins):
                if not np.isfinite(soonest := float(times.min())):
                    continue  # it was never turned
                low, high = max(self.low, soonest / 4), min(self.high, span / 3)
                for tau in self._time_constants(low, high):
                    yield tau, origin

    def _time_constants(self, low: float, high: float) -> list[float]:
        """Time constants to try from `low` to `high`, s; one in the middle of them."""
        high = max(high, 1.01 * low)
        if self.points == 1:
            return [float(np.sqrt(low * high))]
        return [float(tau) for tau in np.geomspace(low, high, self.points)]

    @property
    def finer(self) -> tuple[float, ...]:
        """Steps to the next values to try, closer and closer.

        Ratios of time constants, `WITHIN`, or parts of the time between onsets.
        """
        if self.kind == "instant":
            return 1.0, *WITHIN
        if self.kind == "onset":
            return 0.5, 0.15, 0.04
        return (2.7, 1.4, FINEST) if self.points < POINTS else (1.3, 1.13, FINEST)

    def natural_step(self, x: Experience, ratio: float) -> float:
        """The step of `finer` in the coordinate of `moved`."""
        if self.kind == "onset":
            return ratio * float(np.ptp(x.t)) / ONSETS
        return float(np.log(ratio))

    def moved(self, value: float, step: float) -> float:
        """A value moved by a step of its natural coordinate.

        That is the logarithm of a time constant, and an instant itself, s.
        """
        if self.is_instant:
            return value + step
        return value * float(np.exp(step))

    def sigma(self, value: float, step: float) -> float:
        """Standard uncertainty of a value by that of its natural coordinate.

        That of a time constant is at most itself.
        """
        return step if self.is_instant else value * min(step, 1.0)


def instants(x: Experience) -> Array:
    """Instants at which something may change: between rows, some for each window, s.

    Those of a window part it into pieces of about the same length. Where something was
    left out of a window, somebody knocked.
    """
    between = _between_rows(x)
    turned = np.flatnonzero(np.diff(x.position))
    kept = [turned, np.flatnonzero(knocks(x))]
    for rows in np.split(np.arange(len(x.t)), turned + 1):
        pieces = max(PIECES, INSTANTS // (len(turned) + 1))
        cuts = np.linspace(x.t[rows[0]], x.t[rows[-1]], pieces + 1)[1:-1]
        inside = between[rows[:-1]]
        if len(inside):
            near = np.abs(np.subtract.outer(cuts, inside)).argmin(axis=1)
            kept.append(rows[near])
    out: Array = between[np.unique(np.concatenate(kept))]
    return out


def instants_near(x: Experience, here: float, part: float) -> list[float]:
    """Instants about one: every one between rows next to it, or parts of a row away.

    `part` is one of `WITHIN`, or 1 for those between rows.
    """
    if part < 1:
        k = int(np.argmin(np.abs(x.t - here)))
        row = float(x.lasts[k])
        if row == 0 or abs(float(x.t[k]) - here) > 0.6 * row:
            return []  # between windows: their rows do not tell
        return [here + steps * part * row for steps in (-2, -1, 1, 2)]
    between, grid = _between_rows(x), instants(x)
    low = grid[grid < here].max(initial=-np.inf)
    high = grid[grid > here].min(initial=np.inf)
    found: list[float] = between[(low < between) & (between < high)].tolist()
    return [at for at in found if at != here]


def onsets(x: Experience) -> Array:
    """Instants at which something may begin to change gradually, s.

    They lie between positions. Where these are fewer than `ONSETS`, as of one long
    position, they divide the time evenly.
    """
    turned = np.flatnonzero(np.diff(x.position))
    if len(turned) >= ONSETS:
        turned = turned[np.linspace(0, len(turned) - 1, ONSETS).astype(int)]
    elif len(turned) < ONSETS // 2:
        return np.linspace(x.t.min(), x.t.max(), ONSETS + 2)[1:-1]
    out: Array = _between_rows(x)[turned]
    return out


def knocks(x: Experience) -> Mask:
    """Whether something was left out of a window between two rows, (n - 1,)."""
    ends, starts = x.t[:-1] + x.lasts[:-1] / 2, x.t[1:] - x.lasts[1:] / 2
    here = (x.position[1:] == x.position[:-1]) & (x.position[1:] >= 0)
    out: Mask = here & (starts - ends > BREAK_S) & (x.lasts[1:] > 0)
    return out


def _between_rows(x: Experience) -> Array:
    """Instants between the end of each row and the start of the next, (n - 1,) s."""
    return (x.t[1:] + x.t[:-1] + (x.lasts[:-1] - x.lasts[1:]) / 2) / 2
