"""Samples to block means: the rows that every hypothesis is fitted to.

Each window is cut into blocks (`window_bounds`), so that a hypothesis costs
milliseconds however long the recording is. The standard deviation of a mean of n
white samples of deviation s is s / sqrt(n); s is measured in the recording (`noise`).

A session may hold means alone. Their samples and the turns between them are not
recorded; each is one row. If no times are stated, all means count as taken at the same
time, and no effect that depends on time can be found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model.rows.averages import Rows, average_rows
from fieldcal.model.rows.block_means import masked
from fieldcal.model.rows.noise import rounding_sigma, shared_rounding_sigma
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.turntable import unknown_earth_rate
from fieldcal.model.rows.window_bounds import block_bounds, window_bounds
from fieldcal.physics.experience import Experience
from fieldcal.windows.dead_band import dead_bands, error_of_means


def reduce_to_rows(
    source: RowSource,
    whole: bool | Mask = False,
    level: Array | None = None,
    apart: bool = False,
) -> Rows:
    """Cut the windows into blocks and average them.

    Parameters
    ----------
    source : samples and windows
    whole : whether a window is one row, as of a device that is held by hand, of each
        position (p,) or of all
    level : (6,) standard deviation of one sample in these; if None, it is measured in
        each window, as in the others
    apart : whether the blocks are for the accelerometers only, and each window has a
        further row, its last, for the gyroscopes

    """
    block = masked(source.block, source.usable)
    cut = _CutWindows.of(source, block, whole, apart)
    out = _average_windows(source, cut, level)
    off, alike = _errors_of_values(block, cut.windows, out.y, cut.rows)
    off = _with_errors_of_site(source, out.x, off, len(cut.windows) > 1)
    if apart:
        ends = np.zeros(len(off), dtype=bool)
        ends[np.cumsum(cut.rows) - 1] = True
        out.sd[ends, :3] = np.nan
        out.sd[~ends, 3:] = np.nan
    return replace(out, window_error=off, session_error=alike)


@dataclass(frozen=True, slots=True)
class _CutWindows:
    """The w windows that have samples, cut into blocks.

    Attributes
    ----------
    windows : (w, 2) first and one past the last sample of each window
    position : (w,) index of each window's position
    whole : (w,) whether it is one row
    bounds : (r, 2) first and one past the last sample of the rows of each window

    """

    windows: Index
    position: Index
    whole: Mask
    bounds: list[Index]

    @classmethod
    def of(
        cls, source: RowSource, block: Block, whole: bool | Mask, apart: bool
    ) -> _CutWindows:
        """Cut the windows of `block`, the source's samples that may be used.

        `whole` and `apart` are those of `reduce_to_rows`.
        """
        windows = window_bounds(block, source.about)
        held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 1)
        rate, without = source.rate, source.about.excluded_spans
        one, bounds = np.broadcast_to(whole, len(windows))[held], []
        for (a, b), alone in zip(windows[held].tolist(), one.tolist(), strict=True):
            each = np.zeros((0, 2), dtype=np.intp)
            if not alone:
                each = block_bounds(block.t, (a, b), rate, len(held), without)
            bounds.append(np.vstack([each, [(a, b)]]) if alone or apart else each)
        return cls(windows[held], held, one, bounds)

    @property
    def rows(self) -> list[int]:
        """Number of rows of each window."""
        return [len(b) for b in self.bounds]


def _average_windows(source: RowSource, cut: _CutWindows, level: Array | None) -> Rows:
    """Average the blocks of windows, with the noise that the samples have.

    `level` (6,) is the standard deviation of one sample in windows that are one row;
    if None, and in the others, that of each window, and at least that of a base that
    sways.
    """
    shaken, rows = source.window_noise, cut.rows
    noise, levels = shaken.noise, shaken.levels
    if source.sway_noise is not None:
        noise, levels = (np.fmax(a, source.sway_noise) for a in (noise, levels))
    if level is not None:
        noise, levels = level, np.where(cut.whole[:, None], level, levels)
    return average_rows(
        replace(source, block=shaken.block), np.concatenate(cut.bounds),
        np.repeat(cut.position, rows), np.repeat(levels, rows, axis=0), noise,
        np.repeat(shaken.variance, rows, axis=0),
    )  # fmt: skip


def _with_errors_of_site(
    source: RowSource, x: Experience, off: Array, turned: bool
) -> Array:
    """Add what sway and an unknown direction of the Earth's rate do to whole windows.

    `off` (n, 6) are the standard deviations of the other errors that all rows of a
    window share; `turned` states that there is more than one window.
    """
    if source.sway_variance is not None:
        off = np.hypot(off, np.sqrt(source.sway_variance[x.position]))
    # the direction of the Earth's rate is unknown in device axes, except in a device
    # that was never turned (bias contains it) or whose gyroscopes measure it
    free = x.earth_unseen & turned
    earth = unknown_earth_rate(source.about.nominal["gyr_scale"])
    off[free, 3:] = np.hypot(off[free, 3:], earth)
    return off


def _errors_of_values(
    block: Block, windows: Index, y: Array, rows: Sequence[int]
) -> tuple[Array, Array]:
    """Errors by rounding and dead bands, which no average makes smaller.

    Standard deviations of what all rows of a window share, (n, 6), and of what all
    windows share, (6,). `windows` (w, 2) are samples, `rows` their numbers of rows.
    """
    rounded = rounding_sigma(block, windows)
    alike = shared_rounding_sigma(block, windows, rounded)
    off = np.repeat(rounded, rows, axis=0)
    hidden = error_of_means(y, dead_bands(block))
    off[:, :3] = np.hypot(off[:, :3], hidden[:, :3])
    # what a band hides of a gyroscope at rest is the same in each window
    alike[3:] = np.hypot(alike[3:], hidden[:, 3:].max(axis=0, initial=0.0))
    return off, alike


def median_sigma(sigma: Array) -> Array:
    """Median of each channel's (p, 6) over the positions that have one, (6,)."""
    known = [axis[np.isfinite(axis)] for axis in sigma.T]
    return np.array([np.median(axis) if len(axis) else np.nan for axis in known])


def rows_of_means(source: RowSource, sigma: Array) -> Rows:
    """One row for each position of which there is a mean.

    Parameters
    ----------
    source : the means as samples, one in each window
    sigma : (p, 6) standard deviation of each position's means, m/s^2 and rad/s

    """
    windows = window_bounds(source.block, source.about)
    held = np.flatnonzero(np.diff(windows, axis=1)[:, 0] > 0)
    level = median_sigma(sigma[held])
    still = np.zeros((len(held), 3))
    out = average_rows(source, windows[held], held, sigma[held], level, still)
    x = out.x
    if not source.about.means_timed:
        same = np.zeros(len(held))
        x = replace(x, t=same, since_start=same)
    x = replace(x, since_turn=np.full(len(held), np.inf))
    off = np.zeros_like(out.sd)
    unknown = ~x.oriented & (len(held) > 1)
    off[unknown, 3:] = unknown_earth_rate(source.about.nominal["gyr_scale"])
    return replace(out, x=x, window_error=off)
