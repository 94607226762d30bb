"""Samples of the windows at rest, prepared for the search for lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array, Mask
from fieldcal.core.sampling import sampling_rate
from fieldcal.model import detections, tolerances
from fieldcal.model.rows.averages import Rows
from fieldcal.model.rows.change_points import clear_jumps
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.experience import Experience

Complex = NDArray[np.complexfloating]


@dataclass(frozen=True, slots=True)
class WindowSamples:
    """Samples of each window without mean and slope, and the orientations.

    Attributes
    ----------
    x : orientation and forces, one row for each window
    samples, times : (n, 6) without mean and slope, (n,) s, of each window
    noise : (6,) of one sample
    rate : Hz
    usable : (n, 6) of each window, whether a sample can be used; all if not given
    cuts : s, instants at which a bias jumps; either side has a mean of its own

    """

    x: Experience
    samples: tuple[Array, ...]
    times: tuple[Array, ...]
    noise: Array
    rate: float
    usable: tuple[Mask, ...] = ()
    cuts: Array = field(default_factory=lambda: np.zeros(0))

    def shortest_samples(self, most: int) -> int:
        """Number of samples of the shortest window, or `most` if that is less."""
        return min(most, *map(len, self.samples))

    def with_whole_line(self, hz: float, amplitude: Complex) -> WindowSamples:
        """Restore the part of a line that means and slopes have removed.

        A wave of n periods loses up to 6 / (pi n)^2 of its power to a slope.
        `amplitude` (w, 6) is that of the line in each window.
        """
        samples = []
        for own, t, known, one in zip(
            self.samples, self.times, self.usable, amplitude, strict=True
        ):
            line = evaluate_line(t, hz, one)
            samples.append(own + np.where(known, line, 0.0))
            samples[-1] -= _detrended(t, line, known, self.cuts)
        return replace(self, samples=tuple(samples))


def long_windows(source: RowSource, rows: Rows) -> list[tuple[int, int, int]]:
    """Windows that are long enough: index of their first row, and sample bounds."""
    first = {int(p): i for i, p in reversed(list(enumerate(rows.x.position)))}
    bounds = enumerate(window_bounds(source.block, source.about))
    return [
        (first[p], int(a), int(b))
        for p, (a, b) in bounds
        if b - a >= detections.MIN_LINE_SAMPLES and p in first
    ]


def samples_of_windows(source: RowSource, rows: Rows) -> WindowSamples:
    """Samples of the windows of a recording that are long enough.

    Outputs that the rows do not use, such as accelerometers on a table that turns, are
    zero. Jumps of a bias are removed, since they have power at every frequency.
    """
    block, held = source.block, long_windows(source, rows)
    times = tuple(block.t[a:b] for _, a, b in held)
    cuts = np.ravel(clear_jumps(rows))
    samples, usable = [], []
    for (row, a, b), t in zip(held, times, strict=True):
        values = np.hstack([block.acc[a:b], block.gyr[a:b]])
        # rows of one window may be for the accelerometers or the gyroscopes alone
        use = rows.used[rows.x.position == rows.x.position[row]].any(axis=0)
        usable.append(source.usable[a:b] & use & np.isfinite(values))
        samples.append(_detrended(t, values, usable[-1], cuts))
    return WindowSamples(
        experience_in_windows(rows, held), tuple(samples), times, rows.noise,
        sampling_rate(block), tuple(usable), cuts,
    )  # fmt: skip


def experience_in_windows(
    rows: Rows, held: Sequence[tuple[int, int, int]]
) -> Experience:
    """Orientation and forces in the windows of `long_windows`."""
    x, at = rows.x, np.array([row for row, _, _ in held], dtype=np.intp)
    return Experience.at_rest(
        x.alpha[at], x.beta[at], x.gravity, f=x.f[at], mounting=x.mounting,
        gamma=x.gamma[at],
    )  # fmt: skip


def _detrended(t: Array, values: Array, usable: Mask, cuts: Array) -> Array:
    """Samples less slope and means between cuts, (n, 6); zero if not usable."""
    s = (t - t.mean()) / max(np.ptp(t), 1e-9)
    first = np.unique(np.append(0, np.searchsorted(t, cuts[cuts < t[-1]])))
    long = np.diff(np.append(first, len(t)))
    s -= np.repeat(np.add.reduceat(s, first) / long, long)
    out = np.zeros((len(t), 6), order="F")  # each channel in one piece
    for c in range(6):
        known = usable[:, c]
        column = np.where(known, values[:, c], 0.0)
        many = np.add.reduceat(known.astype(float), first)
        column -= np.repeat(np.add.reduceat(column, first) / np.maximum(many, 1), long)
        column *= known
        slope = (s @ column) / max(float((s * s) @ known), 1e-12)
        column -= slope * s
        column *= known
        rounding = tolerances.ROUNDING * np.abs(values[known, c]).max(initial=0.0)
        if np.abs(column).max(initial=0.0) > rounding:  # else it never changes
            out[:, c] = column
    return out


def evaluate_line(t: Array, hz: float, amplitude: Complex) -> Array:
    """Samples of a line, Re(amplitude exp(2 pi i hz t)), (n, c)."""
    turned = 2 * np.pi * hz * t
    amplitudes = np.array([amplitude.real, -amplitude.imag])
    line: Array = np.column_stack([np.cos(turned), np.sin(turned)]) @ amplitudes
    return line


def subtract_line(values: Array, t: Array, hz: float, amplitude: Complex) -> None:
    """Subtract a line from samples (n, c), in place."""
    for chunk in chunks(0, len(t)):
        values[chunk] -= evaluate_line(t[chunk], hz, amplitude)


def chunks(first: int, last: int) -> Iterator[slice]:
    """Slices of at most `tolerances.SAMPLES_AT_ONCE` samples, to limit memory."""
    for start in range(first, last, tolerances.SAMPLES_AT_ONCE):
        yield slice(start, min(start + tolerances.SAMPLES_AT_ONCE, last))
