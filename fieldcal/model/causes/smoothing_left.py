"""What is left of a smoothing whose time constant is not known exactly.

The smoothed outputs y of a device follow its outputs x by tau y' = x - y. What is
calculated from y with a time constant that is too long by e is

    y + (tau + e) y' = x + e y'                                                     (1)

In a row of a window this is the change of y from one end to the other, over the length
of the row: nothing but where y still settles. During a turn the outputs have e y' more
all the way, with

    tau y'' = x' - y'                                                               (2)

Both are those of a device without noise, which rests in its windows, and moves as its
gyroscopes say: the noise of y' is that of the rows, and would be taken for e. Source:
model of this project.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fieldcal.core.last_known import last_known
from fieldcal.core.samples import ACC, GYR, Array, Block, Index
from fieldcal.model.causes.basis import General, RowView
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.column_table import ColumnTable
from fieldcal.model.rows.row_source import RowSource
from fieldcal.model.rows.window_bounds import window_bounds
from fieldcal.physics.experience import Experience

SMOOTHING = "smoothing"
"""Part of the group; the id of the effect that is undone."""


@dataclass(frozen=True, eq=False)
class UndoneSmoothing:
    """A smoothing that was undone in the outputs of some sensors.

    Attributes
    ----------
    block : the outputs x
    windows : (p, 2) first and one past the last sample of each window
    seconds, sigma : (2,) time constant of accelerometers and of gyroscopes, and its
        standard deviation, s; 0 where they were not smoothed

    """

    block: Block
    windows: Index
    seconds: Array
    sigma: Array

    @classmethod
    def of(cls, source: RowSource) -> UndoneSmoothing:
        """What session.toml and the repairs of the samples say of a recording."""
        windows = window_bounds(source.block, source.about)
        return cls(source.block, windows, *source.about.smoothing)

    def groups(self, table: ColumnTable) -> Iterator[Group]:
        """Group of e: one of both sensors where one program smoothed them alike."""
        smoothed = np.flatnonzero(self.seconds)
        if not len(smoothed):
            return
        alike = len(smoothed) == 2 and np.ptp(self.seconds) == 0
        parts = [[ACC, GYR]] if alike else [[(ACC, GYR)[i]] for i in smoothed]
        y = self._smoothed()

        def columns(view: RowView) -> Array:
            """Slope y' in each row, by the sensors of each part: (n, 6, k)."""
            at_rest = view.x.position >= 0
            slope = y.slope(view.x) if at_rest.any() else self._on_the_way(view, y)
            out = np.zeros((len(view.x), 6, len(parts)))
            for k, triads in enumerate(parts):
                for triad in triads:
                    out[:, triad, k] = slope[:, triad]
            return out

        at = table.add(General(SMOOTHING, columns, needs_whole_turn=True), len(parts))
        yield Group("device", SMOOTHING, at, self.sigma[smoothed[: len(parts)]],
                    fixed_size=1.0)  # fmt: skip

    def _on_the_way(self, view: RowView, y: SmoothedOutputs) -> Array:
        """Slope y' at the edges of a turn, (2), from that where the device rested."""
        tau = np.repeat(np.where(self.seconds > 0, self.seconds, np.inf), 3)
        x = np.hstack([view.x.f, view.x.w]) * view.state.scale
        out = np.zeros_like(x)
        out[0] = y.slope_at(view.x.t[0])
        for k, step in enumerate(np.diff(view.x.t).tolist()):
            left = np.exp(-step / tau)
            # x' is even from edge to edge
            out[k + 1] = left * out[k] + (1 - left) * (x[k + 1] - x[k]) / step
        return out

    def _smoothed(self) -> SmoothedOutputs:
        """The outputs y, without noise in windows."""
        # loading it takes 0.1 s, and few recordings are smoothed
        from scipy.signal import lfilter

        t, six = self.block.t, last_known(self.block.six)
        for a, b in self.windows.tolist():
            if b > a:
                six[a:b] = six[a:b].mean(axis=0)
        interval = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        for triad, tau in zip((ACC, GYR), self.seconds.tolist(), strict=True):
            if tau:
                share = float(np.exp(-interval / tau))
                begin = share * six[:1, triad]
                six[:, triad], _ = lfilter(
                    [1 - share], [1, -share], six[:, triad], axis=0, zi=begin
                )
        return SmoothedOutputs(t, six)


@dataclass(frozen=True, eq=False)
class SmoothedOutputs:
    """Outputs y (n, 6) at the instants t (n,), s."""

    t: Array
    y: Array

    def slope(self, x: Experience) -> Array:
        """Mean of y' over rows, (n, 6)."""
        half = x.lasts / 2
        change = self._at(x.t + half) - self._at(x.t - half)
        out: Array = change / np.where(x.lasts > 0, x.lasts, 1.0)[:, None]
        return out

    def slope_at(self, t: float) -> Array:
        """Slope y' just before an instant, (6,)."""
        k = max(int(np.searchsorted(self.t, t)), 1)
        out: Array = (self.y[k] - self.y[k - 1]) / (self.t[k] - self.t[k - 1])
        return out

    def _at(self, t: Array) -> Array:
        return np.stack([np.interp(t, self.t, y) for y in self.y.T], axis=1)
