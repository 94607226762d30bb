"""Samples of the windows at rest, prepared for the search for lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.samples import Array
from fieldcal.core.sampling import rate_of
from fieldcal.model.rows.bounds import spans
from fieldcal.model.rows.change_points import clear_jumps
from fieldcal.model.rows.reduce import Rows, RowSource
from fieldcal.physics.experience import Experience

Complex = NDArray[np.complexfloating]

AT_ONCE = 1 << 16
"""Samples that a line is taken out of at once."""

ROUNDED = 1e-12
"""Part of a value that taking out a mean and a slope leaves of it by rounding."""

SHORTEST = 64
"""Samples of a window from which it is looked at."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Samples of each window about their mean, and where the device was in it.

    Attributes
    ----------
    x : one row for each window
    samples, times : (n, 6) without means and slope, (n,) s, of each window
    noise : (6,) of one sample
    rate : Hz
    usable : (n, 6) of each window, samples that say something; all if not given
    cuts : s, instants at which a bias jumps: there is a mean for each side

    """

    x: Experience
    samples: tuple[Array, ...]
    times: tuple[Array, ...]
    noise: Array
    rate: float
    usable: tuple[NDArray[np.bool_], ...] = ()
    cuts: Array = field(default_factory=lambda: np.zeros(0))

    def with_whole_line(self, hz: float, amplitude: Complex) -> Pieces:
        """The same with what means and slopes have taken of a line, (w, 6).

        A wave of n periods loses up to 6 / (pi n)^2 of its power to a slope.
        """
        samples = []
        for own, t, known, one in zip(
            self.samples, self.times, self.usable, amplitude, strict=True
        ):
            line = line_of(t, hz, one)
            samples.append(own + np.where(known, line, 0.0))
            samples[-1] -= _flat(t, line, known, self.cuts)
        return replace(self, samples=tuple(samples))


def held_in(source: RowSource, rows: Rows) -> list[tuple[int, int, int]]:
    """Windows that are long enough: the first of their rows, and their bounds."""
    first = {int(p): i for i, p in reversed(list(enumerate(rows.x.position)))}
    bounds = enumerate(spans(source.block, source.about))
    return [
        (first[p], int(a), int(b))
        for p, (a, b) in bounds
        if b - a >= SHORTEST and p in first
    ]


def pieces_of(source: RowSource, rows: Rows) -> Pieces:
    """Windows of a recording that are long enough.

    Outputs of which rows say nothing, as of gravity on a table that turns, are zero. A
    bias that jumps is taken out: it has power at every frequency.
    """
    block, held = source.block, held_in(source, rows)
    times = tuple(block.t[a:b] for _, a, b in held)
    cuts = np.ravel(clear_jumps(rows))
    samples, usable = [], []
    for (row, a, b), t in zip(held, times, strict=True):
        values = np.hstack([block.acc[a:b], block.gyr[a:b]])
        usable.append(source.usable[a:b] & rows.used[row] & np.isfinite(values))
        samples.append(_flat(t, values, usable[-1], cuts))
    return Pieces(
        places_of(rows, held), tuple(samples), times, rows.noise, rate_of(block),
        tuple(usable), cuts,
    )  # fmt: skip


def places_of(rows: Rows, held: Sequence[tuple[int, int, int]]) -> Experience:
    """Where the device is in windows that `held_in` gives."""
    x, some = rows.x, np.array([row for row, _, _ in held], dtype=np.intp)
    return Experience.at_rest(
        x.alpha[some],
        x.beta[some],
        x.gravity,
        f=x.f[some],
        mounting=x.mounting,
        gamma=x.gamma[some],
    )


def _flat(t: Array, values: Array, usable: NDArray[np.bool_], cuts: Array) -> Array:
    """Samples without slope and the means between cuts, (n, 6); zero if not usable."""
    s = (t - t.mean()) / max(np.ptp(t), 1e-9)
    first = np.unique(np.append(0, np.searchsorted(t, cuts[cuts < t[-1]])))
    long = np.diff(np.append(first, len(t)))
    s -= np.repeat(np.add.reduceat(s, first) / long, long)
    out = np.zeros((len(t), 6))
    for c in range(6):
        known = usable[:, c]
        column = np.where(known, values[:, c], 0.0)
        many = np.add.reduceat(known.astype(float), first)
        column -= np.repeat(np.add.reduceat(column, first) / np.maximum(many, 1), long)
        column *= known
        slope = (s @ column) / max(float((s * s) @ known), 1e-12)
        column -= slope * s
        column *= known
        rounding = ROUNDED * np.abs(values[known, c]).max(initial=0.0)
        if np.abs(column).max(initial=0.0) > rounding:  # else it never changes
            out[:, c] = column
    return out


def line_of(t: Array, hz: float, amplitude: Complex) -> Array:
    """Line of some complex amplitudes, Re(amplitude exp(2 pi i hz t)), (n, c)."""
    turned = 2 * np.pi * hz * t
    both = np.array([amplitude.real, -amplitude.imag])
    line: Array = np.column_stack([np.cos(turned), np.sin(turned)]) @ both
    return line


def take_out(values: Array, t: Array, hz: float, amplitude: Complex) -> None:
    """Take a line out of samples, (n, c), in place."""
    for some in stretches(0, len(t)):
        values[some] -= line_of(t[some], hz, amplitude)


def stretches(first: int, last: int) -> Iterator[slice]:
    """Samples a part at a time: what is made of them takes memory, too."""
    for start in range(first, last, AT_ONCE):
        yield slice(start, min(start + AT_ONCE, last))
