"""Rows of one channel, linearised."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fieldcal.core.samples import Array, Index, Mask


@dataclass(frozen=True)
class ChannelRows:
    """Rows of one channel, about any state.

    Attributes
    ----------
    channel : index in `samples.CHANNELS`
    rows : (r,) which rows
    window : (r,) number of the window of each row
    weight : (r,) 1/sigma

    """

    channel: int
    rows: Index
    window: Index
    weight: Array

    def linearised(self, columns: Index, design: Array, white: Array) -> LinearRows:
        """The rows with their columns (k,), a design (r, k) and (r,) whitened."""
        own = self.channel, self.rows, self.window, self.weight
        out = LinearRows(*own, columns, design, white)
        for cached in ("starts", "windows", "info"):
            out.__dict__[cached] = getattr(self, cached)
        return out

    @cached_property
    def starts(self) -> Index:
        """First row of each of its windows, (w,)."""
        return np.flatnonzero(np.diff(self.window, prepend=-1))

    @cached_property
    def windows(self) -> Index:
        """Number of each of its windows, (w,)."""
        return self.window[self.starts]

    @cached_property
    def info(self) -> Array:
        """Inverse variance of the mean of each window, (w,)."""
        return np.add.reduceat(self.weight**2, self.starts)


@dataclass(frozen=True)
class LinearRows(ChannelRows):
    """Rows of one channel, whitened.

    Attributes
    ----------
    columns : (k,) of the dictionary with influence on the channel
    design : (r, k) whitened
    white : (r,) whitened y - h(state)

    """

    columns: Index
    design: Array
    white: Array

    def select_rows(self, kept: Mask) -> LinearRows:
        """Some of its rows, by (r,)."""
        rows, window, weight = self.rows[kept], self.window[kept], self.weight[kept]
        design, white = self.design[kept], self.white[kept]
        return LinearRows(
            self.channel, rows, window, weight, self.columns, design, white
        )

    def with_columns(self, more: LinearRows) -> LinearRows:
        """The rows with columns more, those of the same rows in `more`."""
        columns = np.concatenate([self.columns, more.columns])
        design = np.hstack([self.design, more.design])
        out = self.linearised(columns, design, self.white)
        if "courses" in self.__dict__:
            beside = self._product(self.design, self.means, more.design, more.means)
            out.__dict__["means"] = np.hstack([self.means, more.means])
            out.__dict__["courses"] = np.block(
                [[self.courses, beside], [beside.T, more.courses]]
            )
        return out

    def select_columns(self, columns: Mask) -> LinearRows:
        """The rows with only some columns, (all,) of the dictionary."""
        kept = columns[self.columns]
        if kept.all():
            return self
        return self.linearised(self.columns[kept], self.design[:, kept], self.white)

    @cached_property
    def means(self) -> Array:
        """Mean of each column in each window, (w, k)."""
        return self.window_means(self.design)

    @cached_property
    def courses(self) -> Array:
        """Products of the columns' courses about their means in windows, (k, k)."""
        return self._product(self.design, self.means, self.design, self.means)

    def _product(self, a: Array, mean_a: Array, b: Array, mean_b: Array) -> Array:
        """Products of two designs (r, ...), about their means in windows (w, ...)."""
        if len(self.starts) == len(self.rows):  # no row differs from its mean
            return np.zeros((a.shape[1], b.shape[1]))
        out: Array = a.T @ b
        out -= (mean_a * self.info[:, None]).T @ mean_b
        return out

    def window_means(self, white: Array) -> Array:
        """Weighted mean of each window, (w, ...), of whitened rows (r, ...)."""
        wide = (-1, *[1] * (white.ndim - 1))
        total = np.add.reduceat(white * self.weight.reshape(wide), self.starts, axis=0)
        out: Array = total / self.info.reshape(wide)
        return out
