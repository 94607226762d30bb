"""Powers of a device's cosine coefficients, and the contribution of each process.

Rows are frequency bins of all stretches of a device, over all sessions; columns are
processes (`cosine`). The last level of each stretch keeps its coefficients, so that the
parts that follow time and temperature can be subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Index
from fieldcal.noise import cosine
from fieldcal.noise.levels import FOLDS, SEGMENT, ReducedStretch, octave_bins

NODES = 2
"""Correlation times per octave at which the column of a Gauss-Markov process is
calculated; a cubic spline interpolates."""

BEYOND = 64.0
"""Longest correlation time of flicker, in lengths of the longest stretch: slower parts
are a constant and a ramp there."""

WITHIN = 8.0
"""Shortest correlation time of flicker: this fraction of the sampling period."""


@dataclass(frozen=True, slots=True)
class LastLevel:
    """Coefficients of the last levels of all stretches.

    Attributes
    ----------
    values : (k, c) of channels and covariates
    time : (k,) of the time, s
    bin, fold : (k,) to which each belongs
    stretch : (k,) from which each comes

    """

    values: Array
    time: Array
    bin: Index
    fold: Index
    stretch: Index


class CosineSpectrum:
    """Powers of one device.

    Parameters
    ----------
    stretches : each reduced; at the same rate but for the clock's errors
    noisy : how many of their columns are channels; further ones are covariates

    Attributes
    ----------
    frequency : (b,) Hz, middle of each bin
    folded_from : (b,) Hz, the lowest one that means over samples fold onto it
    folded_share : (b,) part of white noise's power there that is folded onto it
    power : (b, folds, c) sums of squares of the stretches below the last level
    count : (b, folds) how many
    last : coefficients of the last levels
    seconds : length of the longest stretch

    """

    def __init__(self, stretches: Sequence[ReducedStretch], noisy: int) -> None:
        if not stretches:
            raise InputError("there is no stretch at rest to take noise from")
        self.stretches = tuple(stretches)
        self.seconds = max(s.samples * s.dt for s in stretches)
        self.dt = float(np.median([s.dt for s in stretches]))
        self._noisy = noisy
        self._parts: list[tuple[int, int, Index]] = []
        self._below()
        self._above()
        self.frequency = np.concatenate(
            [(e[:-1] + e[1:] - 1) / (4 * n * m * self.dt) for n, m, e in self._parts]
        )
        many = np.concatenate([np.full(len(e) - 1, m) for _, m, e in self._parts])
        self.folded_from = 1 / (many * self.dt) - self.frequency
        half = np.pi * self.frequency * self.dt
        self.folded_share = 1 - (np.sin(many * half) / (many * np.sin(half))) ** 2

    def _below(self) -> None:
        """Sums of the levels below the last ones, of all stretches together."""
        sums: dict[int, list[Any]] = {}
        for stretch in self.stretches:
            for level in stretch.levels:
                sums.setdefault(level.m, []).append(level)
        power, count = [], []
        for m, levels in sorted(sums.items()):
            edges = levels[0].edges
            self._parts.append((SEGMENT, m, edges))
            power.append(np.sum([lv.power for lv in levels], axis=0))
            count.append(np.sum([lv.number for lv in levels], axis=0))
        self._rows = sum(len(p) for p in power)
        self._power = np.concatenate([np.empty((0, FOLDS, self._noisy)), *power])
        self._count = np.concatenate([np.empty((0, FOLDS)), *count])

    def _above(self) -> None:
        """Coefficients of the last levels; those of equal length share their bins."""
        from scipy.fft import dct

        rows, known = self._rows, dict[tuple[int, int], tuple[int, Index]]()
        found: list[tuple[Any, ...]] = []
        for number, s in enumerate(self.stretches):
            n = len(s.means)
            end = n if s.m == 1 else n // 2
            if end < 3:
                continue
            if (n, s.m) not in known:
                edges = octave_bins(1, end)
                known[n, s.m] = rows, edges
                self._parts.append((n, s.m, edges))
                rows += len(edges) - 1
            first, edges = known[n, s.m]
            k = np.arange(1, end)
            where = first + np.searchsorted(edges, k, side="right") - 1
            time = np.arange(n) * s.m * s.dt
            both = np.column_stack([s.means, time - time.mean()])
            coefficients = dct(both, norm="ortho", axis=0)[1:end]
            found.append(
                (
                    coefficients[:, :-1],
                    coefficients[:, -1],
                    where,
                    (k + number) % FOLDS,
                    np.full(len(k), number),
                )
            )
        if not found:
            raise InputError("no stretch at rest has four samples")
        self.last = LastLevel(*(np.concatenate(c) for c in zip(*found, strict=True)))
        self._bins = rows

    def channel_powers(
        self, channel: int, rest: Array, weight: Array
    ) -> tuple[Array, Array]:
        """Sums of squares and numbers of one channel, (b, folds) both.

        Parameters
        ----------
        channel : which
        rest : (k,) coefficients of the last levels, less the covariates
        weight : (k,) part of the variance of each that the regression leaves, 1 at most

        """
        power, count = np.zeros((2, self._bins, FOLDS))
        power[: self._rows] = self._power[:, :, channel]
        count[: self._rows] = self._count
        where = (self.last.bin, self.last.fold)
        np.add.at(power, where, rest**2)
        np.add.at(count, where, weight)
        return power, count

    def ever_changes(self, channel: int) -> bool:
        """Whether a channel ever changes."""
        last = self.last.values[:, channel]
        return bool(self._power[:, :, channel].any() or last.any())

    @cached_property
    def fixed_columns(self) -> dict[str, Array]:
        """Columns of the processes without a correlation time, (b,) each, by symbol."""
        made = {"N": cosine.white, "Q": cosine.quantisation, "K": cosine.walk}
        return {
            name: self._binned(lambda n, m, of=of: of(n, m, self.dt))
            for name, of in made.items()
        }

    def _binned(self, of: Any) -> Array:
        out = []
        for n, m, edges in self._parts:
            each = of(n, m)[edges[0] - 1 : edges[-1] - 1]
            sums = np.add.reduceat(each, edges[:-1] - edges[0])
            out.append(sums / np.diff(edges))
        return np.concatenate(out)

    @cached_property
    def _markov(self) -> Any:
        from scipy.interpolate import CubicSpline

        low, high = np.log([self.dt / WITHIN, self.seconds * BEYOND]).tolist()
        count = int(NODES * (high - low) / np.log(2)) + 2
        nodes = np.linspace(low, high, count)
        table = [
            self._binned(lambda n, m, t=t: cosine.markov(n, m, self.dt, t))
            for t in np.exp(nodes)
        ]
        return CubicSpline(nodes, np.array(table))

    @cached_property
    def _summed(self) -> Any:
        return self._markov.antiderivative()

    def markov(self, log_time: float) -> tuple[Array, Array]:
        """Column of a Gauss-Markov process of unit variance, and its derivative."""
        return self._markov(log_time), self._markov(log_time, 1)

    def flicker(self, log_time: float) -> tuple[Array, Array]:
        """Column of flicker with B = 1 up to a correlation time, and its derivative."""
        column = self._summed(log_time) - self._summed(self._markov.x[0])
        return column / np.pi, self._markov(log_time) / np.pi

    @cached_property
    def _endless(self) -> Array:
        return self.flicker(float(self._markov.x[-1]))[0]

    def column(self, process: str) -> Array:
        """Column of a process without a correlation time."""
        return self._endless if process == "B" else self.fixed_columns[process]

    @property
    def log_times(self) -> tuple[float, float]:
        """Range of correlation times distinct from white noise and walk, ln s."""
        return float(np.log(2 * self.dt)), float(np.log(self.seconds))
