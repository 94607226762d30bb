"""A window in pieces: the undisturbed part before a disturbance is kept.

A gust, a step near the fixture or a gap in the samples costs only the disturbed part,
if the device has the same attitude afterwards. Pieces agree if their means do,

    |u_k - v_k| <= AGREES sqrt(s_k^2 + t_k^2)      on each channel k                (1)

with the standard errors s and t of the pieces. They are then one window, whose mean and
error are those of all cells. If they do not agree, the earlier pieces are discarded,
since a mean over two attitudes belongs to neither. Units: SI.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.errors import Moved
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.mean import Average
from fieldcal.windows.verdict import FEWEST_JUDGED_CELLS
from fieldcal.windows.window import LearnedNoise, Window

DISCARDED_BEFORE_S = 0.5
"""Least time before a disturbance that is discarded with it, s."""

AGREES = 4.0
"""Standard errors within which means agree; errors of short pieces are rough."""


class PiecedWindow:
    """A window made of undisturbed pieces, the last of which is being filled.

    Parameters
    ----------
    noise : learned in earlier windows
    grain : rounding that the device states
    limits : bounds of rest, the usual ones if not given

    Attributes
    ----------
    dropped : seconds that were discarded because the attitude differed afterwards

    """

    def __init__(
        self,
        noise: LearnedNoise | None,
        grain: Grain,
        limits: StillnessLimits | None = None,
    ) -> None:
        self._noise, self._grain, self._limits = noise, grain, limits
        self._kept: Window | None = None
        self._gaps: list[tuple[float, float]] = []
        self._now = Window(limits, noise, grain)
        self.dropped = 0.0

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        self._now.add(block)

    @property
    def disturbance(self) -> Moved | None:
        """The disturbance of the present piece, if there was one."""
        return self._now.disturbance

    @property
    def motion_now(self) -> float:
        """Motion in the last second over the allowed motion; above 1 it moves."""
        return self._now.motion_now

    @property
    def elapsed(self) -> float:
        """Device time of all pieces so far, s."""
        return (self._kept.seconds if self._kept else 0.0) + self._now.elapsed

    @property
    def sigma(self) -> Array:
        """Standard error of the mean so far, (6,); nan in the first second."""
        now = self._now.sigma
        if self._kept is None:
            return now
        before = self._kept.sigma
        combined = 1 / np.sqrt(1 / before**2 + 1 / now**2)
        return np.where(np.isfinite(combined), combined, before)

    @property
    def noise(self) -> LearnedNoise | None:
        """Noise learned for the next window, if any."""
        return self._now.noise

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Stretches between the pieces, s of device time."""
        return list(self._gaps)

    def reason_to_stop(self, target: float | None) -> str | None:
        """As `Window.reason_to_stop`, for all pieces together."""
        if self._kept is None:
            return self._now.reason_to_stop(target)
        if target is None or not np.nanmax(self.sigma[:3]) <= target:
            return None
        return self._joined_window(self._kept, self._now).reason_to_stop(target)

    def keep_undisturbed(self, moved: Moved) -> float:
        """Keep the undisturbed part before a disturbance; returns the seconds kept.

        A new piece begins with the next block.
        """
        piece, end = self._now, _undisturbed_until(moved)
        self.dropped = 0.0
        while piece.n:
            piece.truncate(end)
            again = piece.disturbance if _can_be_tested(piece) else None
            if again is None:
                break
            end = min(_undisturbed_until(again), end - DISCARDED_BEFORE_S)
        learned = self._noise
        if _can_be_tested(piece):
            learned = piece.noise
            self._join(piece)
        self._now = Window(self._limits, learned, self._grain)
        return self._kept.seconds if self._kept else 0.0

    def is_full(self, seconds: float) -> bool:
        """Whether there are `seconds` s, and the last piece is long enough to test."""
        short = self._kept is not None and not _can_be_tested(self._now)
        return self.elapsed >= seconds and not short

    def average(self) -> Average | None:
        """Mean of all pieces; None if earlier pieces disagree and were discarded.

        Raises
        ------
        Moved
            If the only piece was disturbed.

        """
        self.dropped = 0.0
        if self._kept is None:
            return self._now.average()
        before = self._kept
        whole = self._merged(before, self._now)
        if whole is not None:
            self._gaps.append(_gap_between(before, self._now))
            return whole.average()
        self.dropped = before.seconds
        self._kept, self._gaps = None, []
        return None

    def _join(self, piece: Window) -> None:
        """Add a piece; earlier ones are discarded if they do not agree with it."""
        before = self._kept
        whole = self._merged(before, piece) if before else None
        if before is not None and whole is not None:
            self._gaps.append(_gap_between(before, piece))
            self._kept = whole
            return
        self.dropped = before.seconds if before else 0.0
        self._kept, self._gaps = piece, []

    def _merged(self, before: Window, after: Window) -> Window | None:
        """Two pieces as one window; None if they do not agree."""
        whole = self._joined_window(before, after)
        return (
            whole if self._agree(before, after) and whole.disturbance is None else None
        )

    def _joined_window(self, before: Window, after: Window) -> Window:
        return Window(self._limits, self._noise, self._grain, (before, after))

    @staticmethod
    def _agree(before: Window, after: Window) -> bool:
        spread = np.hypot(before.sigma, after.sigma)
        off = np.abs(before.mean - after.mean)
        known = np.isfinite(off) & np.isfinite(spread)
        return bool((off[known] <= AGREES * spread[known]).all())  # (1)


def _can_be_tested(piece: Window) -> bool:
    """Whether a piece is long enough to be tested for rest."""
    return piece.cells.complete_count >= FEWEST_JUDGED_CELLS


def _gap_between(before: Window, after: Window) -> tuple[float, float]:
    """Gap from after the last sample of a piece to the first of the next, s."""
    return float(np.nextafter(before.end, np.inf)), after.start


def _undisturbed_until(moved: Moved) -> float:
    """Instant up to which a window is unaffected by a disturbance, s."""
    return moved.at - max(DISCARDED_BEFORE_S, moved.seconds)
