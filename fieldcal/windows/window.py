"""A window while it fills: mean, its error and the test for rest after every block.

If a device rotates slightly at rest, in a hand or on a support that gives way, its
specific force f changes across its mean and not along it. The noise of the mean along n
= f / |f| is then lower than the covariance C of the axes states, and C is replaced by

    C' = C - C n n^T C (1 / q - v / q^2),   q = n^T C n                          (1)

where v is the variance of the mean of n . f by the spectrum of n . f; with it n^T C' n
is v. Units: m/s^2 and rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fieldcal.core.errors import InputError, Moved
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.windows.cells import CellAccumulator, CellTable, join_cells
from fieldcal.windows.grain import rounding_variance, visible_step
from fieldcal.windows.limits import StillnessLimits
from fieldcal.windows.mean import Average
from fieldcal.windows.mean_error import MeanError, error_of_mean
from fieldcal.windows.quiet import QuietNoise
from fieldcal.windows.verdict import WindowVerdict, judge_window

FEWEST_CELLS = 10
"""Cells a window must have for its mean to have an error: 1 s of samples, or as many
samples where they come less often than cells."""

SETTLED_S = 15.0
"""Device time from which the gain of further averaging is judged, s."""

GAIN_OF_DOUBLING = 0.9
"""Factor to which twice the time must lower the error to go on (white noise: 0.71)."""


@dataclass(frozen=True, slots=True)
class LearnedNoise:
    """Noise of the device learned in a window, for the next one.

    Attributes
    ----------
    quiet : noise at rest by duration; None where it may differ from window to window
    shape_likelihood : (s, 7) log likelihood of the spectrum shapes, of the six channels
        and of the component along the force

    """

    quiet: QuietNoise | None
    shape_likelihood: Array

    @property
    def spectrum_shape_only(self) -> LearnedNoise:
        """The shape of the spectrum alone, which also holds in more wind or by hand."""
        return replace(self, quiet=None)


class Window:
    """A window of device time over which the device should be still.

    Samples are added with `add`. Every property holds for the samples so far, and none
    depends on how they were cut into blocks. `noise` is that of an earlier window of
    the device, which sharpens the test. `grain` is the rounding that the device states.
    `pieces` are earlier windows that this one continues; the gaps are left out.

    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> t = np.arange(3000) / 100
    >>> acc = [0.0, -9.81, 0.0] + 0.02 * rng.standard_normal((3000, 3))
    >>> window = Window()
    >>> for k in range(0, 3000, 50):
    ...     window.add(Block.of(t[k : k + 50], acc[k : k + 50]))
    >>> window.disturbance is None, window.n, f"{window.sigma[1]:.5f} m/s^2"
    (True, 3000, '0.00036 m/s^2')
    """

    def __init__(
        self,
        limits: StillnessLimits | None = None,
        noise: LearnedNoise | None = None,
        grain: Grain | None = None,
        pieces: Sequence[Window] = (),
    ) -> None:
        self._limits = limits or StillnessLimits()
        self._before, self._grain = noise, grain or Grain()
        self._pieces = tuple(pieces)
        self._sum = CellAccumulator()
        self._cells = reduce(join_cells, (*(p.cells for p in pieces), self._sum.table))
        self._error: MeanError | None = None
        self._verdict: WindowVerdict | None = None
        self._covariance: Array | None = None

    def add(self, block: Block) -> None:
        """Take in the block that follows; costs as much as the block is long."""
        self._sum.add(block)
        self._rebuild_cells()

    def _rebuild_cells(self) -> None:
        own = self._sum.table.with_values
        self._cells = reduce(join_cells, (*(p.cells for p in self._pieces), own))
        self._error = self._verdict = self._covariance = None

    @property
    def cells(self) -> CellTable:
        """The cells so far that hold a value."""
        return self._cells

    def truncate(self, at: float) -> None:
        """Discard the cells that end after an instant, s of device time."""
        self._sum.truncate(at)
        self._rebuild_cells()

    @property
    def start(self) -> float:
        """First instant, s of device time."""
        return self._pieces[0].start if self._pieces else self._sum.start

    @property
    def end(self) -> float:
        """Last instant, s of device time."""
        own = self._sum.n or not self._pieces
        return self._sum.end if own else self._pieces[-1].end

    @property
    def seconds(self) -> float:
        """Device time of which there are samples, s."""
        return self._cells.seconds

    @property
    def n(self) -> int:
        """Samples so far."""
        return self._sum.n + sum(piece.n for piece in self._pieces)

    @property
    def elapsed(self) -> float:
        """Device time so far, s."""
        return self.end - self.start if self.n else 0.0

    @property
    def mean(self) -> Array:
        """Mean so far, (6,); nan where not measured."""
        return self._cells.mean

    @property
    def temperature(self) -> float:
        """Mean temperature so far, deg C; nan where unknown."""
        return self._cells.temperature

    @property
    def sigma(self) -> Array:
        """Standard error of the mean so far, (6,); nan in the first second."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def covariance(self) -> Array:
        """Covariance of the mean so far, (6, 6); nan in the first second."""
        if self._covariance is None:
            self._covariance = self._mean_covariance()
        return self._covariance

    def _mean_covariance(self) -> Array:
        """Covariance, increased for rounding and for missing samples."""
        if len(self._cells) < FEWEST_CELLS:
            return np.full((6, 6), np.nan)
        whole = self._mean_error().covariance
        along = _with_variance_along(
            whole[:6, :6], self._force_direction, float(whole[6, 6])
        )
        covariance = along + np.diag(self._rounding_variance())
        known = np.isfinite(self._cells.means).mean(axis=0)
        share = np.where(known > 0, known, np.nan)
        widened: Array = covariance / np.outer(share, share)
        return widened

    @property
    def motion_now(self) -> float:
        """Motion in the last second over the allowed motion; above 1 it moves."""
        return self._current_verdict().ratio_now

    @property
    def disturbance(self) -> Moved | None:
        """The disturbance, if there was one; None while the window is good."""
        worst = self._current_verdict().worst
        return worst.as_error(self.start) if worst.ratio > 1 else None

    @property
    def noise(self) -> LearnedNoise | None:
        """Noise learned for the next window, if any."""
        quiet = self._current_verdict().quiet
        return (
            LearnedNoise(quiet, self._mean_error().shape_likelihood)
            if quiet
            else self._before
        )

    def reason_to_stop(self, target: float | None = None) -> str | None:
        """Return why averaging can stop early, as a sentence, or None.

        `target` is the wanted standard error of each accelerometer mean, m/s^2.
        """
        sigma = self.sigma[:3]
        if not np.isfinite(sigma).any():
            return None
        if target is not None and np.nanmax(sigma) <= target:
            return (
                f"each accelerometer mean is known to {np.nanmax(sigma):.2g} m/s², "
                f"{target:.2g} m/s² was wanted"
            )
        if self.elapsed < SETTLED_S:
            return None
        twice = np.sqrt(
            self._mean_error().sigma_of_doubled[:6] ** 2 + self._rounding_variance()
        )[:3]
        open_ = np.isfinite(sigma) & (sigma > (target or 0.0))
        if (twice[open_] > GAIN_OF_DOUBLING * sigma[open_]).all():
            return (
                f"the bias wanders as much as is averaged out: {np.nanmax(sigma):.2g} "
                f"m/s² is reached, and {2 * self.elapsed:.0f} s would give "
                f"{np.nanmax(twice):.2g} m/s²"
            )
        return None

    def average(self) -> Average:
        """Return the mean and its error.

        Raises
        ------
        Moved
            If the window was disturbed; with the instant and the axis.
        InputError
            If it is too short for its mean to have an error.

        """
        least = FEWEST_CELLS * self._cells.period
        if len(self._cells) < FEWEST_CELLS:
            what = f"a window of {self.n} samples over {self.elapsed:.2g} s"
            if self.elapsed < least:
                raise InputError(
                    f"{what} is too short for its mean to have an error: take"
                    f" {least:g} s or more"
                )
            raise InputError(
                f"{what} has values in {self.seconds:.2g} s of it only, too few for its"
                " mean to have an error: the rest is missing, stuck or clipped"
            )
        if moved := self.disturbance:
            raise moved
        start, end = self.start, self.end
        return Average(self.mean, self.covariance, self.temperature, self.n, start, end)

    def _current_verdict(self) -> WindowVerdict:
        if self._verdict is None:
            before = self._before.quiet if self._before else None
            sampled = np.nan_to_num(self._cells.noise)
            jumps = visible_step(self._grain, self.mean, sampled)
            self._verdict = judge_window(self._cells, self._limits, before, jumps)
        return self._verdict

    def _mean_error(self) -> MeanError:
        if self._error is None:
            before = self._before.shape_likelihood if self._before else None
            means = self._cells.steady_means
            seven = np.column_stack([means, means @ self._force_direction])
            self._error = error_of_mean(seven, self._cells.period, before)
        return self._error

    @property
    def _force_direction(self) -> Array:
        """Direction of the mean specific force among the channels, (6,)."""
        f = np.nan_to_num(self.mean) * (np.arange(6) < 3)
        length = np.linalg.norm(f)
        return f / length if length > 0 else f

    def _rounding_variance(self) -> Array:
        sampled = np.nan_to_num(self._cells.noise)
        return rounding_variance(
            self._grain, self.mean, sampled, self._cells.resolution
        )


def _with_variance_along(covariance: Array, n: Array, variance: float) -> Array:
    """Change a covariance (6, 6) so that its variance along n (6,) is `variance`."""
    reach = covariance @ n
    q = float(n @ reach)
    if q <= 0:
        return covariance
    known: Array = covariance - np.outer(reach, reach) * (
        1 / q - variance / q**2
    )  # (1)
    return known


def average(
    block: Block,
    limits: StillnessLimits | None = None,
    noise: LearnedNoise | None = None,
    grain: Grain | None = None,
) -> Average:
    """Average a window of samples.

    Raises
    ------
    Moved
        If the window was disturbed; with the instant and the axis.
    InputError
        If it is too short for its mean to have an error.

    """
    window = Window(limits, noise, grain)
    window.add(block)
    return window.average()
