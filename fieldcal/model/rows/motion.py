"""Rows of a device in motion, beside a reference that follows the same motion.

The reference says specific force and angular rate at every moment of its own clock.
What the device goes through at t of its clock is

    v(t) = R u(s),    s = t - delay + drift (t - middle)                           (1)

with u what the reference says and R the turn from its axes to the device's. A row is
the mean of some samples, and of v at their instants; rows lie in stretches without
gaps. What is off by colour, not white, is told apart by frequency: rows count as the
cosine coefficients of each stretch,

    c_k = sqrt(2 / n) sum_j y_j cos(pi k (j + 1/2) / n),    c_0 by 1 / sqrt(n)       (2)

at f_k = k / (2 n d), d s from row to row, which of stationary noise are all but
independent; of what is slower than a stretch, the c_0 of the m stretches are put
through (2) once more and lie at j / (2 m n d). m/s^2, rad/s, device axes. Source:
DCT-II, N. Ahmed et al. 1974; P. Whittle 1953 for the independence.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct
from scipy.interpolate import CubicSpline

from fieldcal.core.gravity import G0
from fieldcal.core.samples import ACC, GYR, Array, Block, Index
from fieldcal.physics.experience import Experience

GAP = 3.5
"""Intervals between samples from which there is a gap."""

PARTS = 8
"""Parts of a recording, of whole stretches, that something may happen to."""

FEWEST = 8
"""Samples of a channel from which a reference has it."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """Where a recording stands beside its reference, (1).

    Attributes
    ----------
    delay : s that the recording's clock is ahead of the reference's at `middle`
    drift : by how much the reference's clock is the quicker one, 1
    middle : s of the recording's clock
    rotation : (3, 3) R, device = R reference
    unseen : (6,) gravity along an upright axis that the reference lacks, m/s^2

    """

    delay: float
    drift: float
    middle: float
    rotation: Array = field(default_factory=lambda: np.eye(3))
    unseen: Array = field(default_factory=lambda: np.zeros(6))

    def reference_time(self, t: Array) -> Array:
        """Instants of the recording by the reference's clock, s."""
        out: Array = t - self.delay + self.drift * (t - self.middle)  # (1)
        return out


class Reference:
    """What a reference says between its samples, by cubic splines.

    Parameters
    ----------
    block : its samples; a channel that it has not is taken as 0

    Attributes
    ----------
    observed : (6,) channels that it has
    start, end : s of its clock

    """

    def __init__(self, block: Block) -> None:
        six = block.six
        self.observed = np.isfinite(six).sum(axis=0) >= FEWEST
        whole = np.isfinite(six[:, self.observed]).any(axis=1)
        self.t, self.step = block.t[whole], float(np.median(np.diff(block.t[whole])))
        self.start, self.end = float(self.t[0]), float(self.t[-1])
        self._splines = [
            (c, CubicSpline(block.t[known], six[known, c]))
            for c in np.flatnonzero(self.observed)
            for known in [np.isfinite(six[:, c])]
        ]

    @property
    def lost(self) -> Index:
        """Channels that it lacks of triads of which it has some."""
        some = np.repeat(self.observed.reshape(2, 3).any(axis=1), 3)
        return np.flatnonzero(some & ~self.observed)

    def at(self, s: Array, order: int = 0) -> Array:
        """The six channels, or a derivative, at instants of its clock, (n, 6)."""
        out = np.zeros((len(s), 6))
        for c, spline in self._splines:
            out[:, c] = spline(s, order)
        return out

    def covers(self, s: Array, margin: float) -> NDArray[np.bool_]:
        """Instants about which it has samples, and so far beyond, s."""
        inside = (s > self.start + margin) & (s < self.end - margin)
        after = np.clip(np.searchsorted(self.t, s), 1, len(self.t) - 1)
        return inside & (self.t[after] - self.t[after - 1] < GAP * self.step)


@dataclass(frozen=True, slots=True)
class MotionRows:
    """Rows of a recording beside a reference.

    Attributes
    ----------
    t : (n, m) s, instants of the samples of each row
    y : (n, 6) their means, m/s^2 and rad/s; nan where a channel was not measured
    temperature : (n,) deg C; nan where unknown
    length : rows of each stretch
    step : s from row to row
    reference : of the motion
    alignment : beside it
    late : s by which the gyroscopes are later than the accelerometers, as it is known

    """

    t: Array
    y: Array
    temperature: Array
    length: int
    step: float
    reference: Reference
    alignment: Alignment
    late: float = 0.0

    def __len__(self) -> int:
        return len(self.y)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Rows that say something, by channel, (n, 6)."""
        return np.isfinite(self.y)

    @property
    def stretch(self) -> Index:
        """Number of the stretch that each row lies in, (n,)."""
        return np.arange(len(self)) // self.length

    @property
    def part(self) -> Index:
        """Number of the part of the recording that each row lies in, (n,)."""
        count = len(self) // self.length
        return self.stretch * min(PARTS, count) // count

    @property
    def middles(self) -> Array:
        """Middle of each row, (n,) s."""
        out: Array = self.t.mean(axis=1)
        return out

    @property
    def frequency(self) -> Array:
        """Of each coefficient, (n,) Hz."""
        return frequencies(len(self), self.length, self.step)

    def cosines(self, values: Array) -> Array:
        """Coefficients (2) of each stretch, (n, k) of (n, k)."""
        apart = values.reshape(-1, self.length, values.shape[1])
        out = dct(apart, axis=1, norm="ortho")  # (2)
        out[:, 0] = dct(out[:, 0], axis=0, norm="ortho")
        both: Array = out.reshape(values.shape)
        return both

    def of_stretches(self, coefficients: Array, some: Index) -> Array:
        """Coefficients (m, k) of some stretches alone, of those (n, k) of all."""
        apart = coefficients.reshape(-1, self.length, coefficients.shape[1])
        means = idct(apart[:, 0], axis=0, norm="ortho")
        out = apart[some].copy()
        out[:, 0] = dct(means[some], axis=0, norm="ortho")
        return out.reshape(-1, coefficients.shape[1])

    def motion(self, order: int = 0, late: float = 0.0) -> Array:
        """What the device went through by the reference, or a derivative, (n, 6).

        `late` is by how many s that was earlier.
        """
        s = self.alignment.reference_time(self.t.ravel() - late)
        every = self.reference.at(s, order).reshape(*self.t.shape, 6)
        means, turn = every.mean(axis=1), self.alignment.rotation.T
        if order == 0:
            means += self.alignment.unseen
        return np.hstack([means[:, ACC] @ turn, means[:, GYR] @ turn])  # (1)

    def experience(self, late: float = 0.0) -> Experience:
        """The same as the inputs of effects."""
        v, n, t = self.motion(0, late), len(self), self.middles
        warming = self.temperature - self.temperature[0]
        unknown = np.full(n, np.nan)
        return Experience(
            alpha=unknown, beta=unknown, gamma=np.zeros(n),
            f=v[:, ACC], w=v[:, GYR], w_dot=self.motion(1, late)[:, GYR],
            t=t, lasts=np.full(n, self.step), since_start=t - t[0],
            since_turn=np.full(n, np.inf), warming=warming,
            heating=np.gradient(warming, t), variance=np.zeros((n, 3)),
            position=self.part, rate=v[:, GYR], speed=np.zeros(n),
            speed_sigma=np.zeros(n), base_force=np.array([0.0, -G0, 0.0]),
            base_rate=np.zeros(3), mounting=np.eye(3), latitude=np.nan,
            gravity_sigma=0.0, attitude_sigma=unknown, transport=np.zeros(3),
        )  # fmt: skip


def frequencies(count: int, length: int, step: float) -> Array:
    """Of the coefficients of some rows in stretches of a length, (count,) Hz."""
    k = np.arange(count)
    out = (k % length) / (2 * length * step)
    slow = k[::length]
    out[slow] = slow / length / (2 * step * count)
    return out


def rows_in_motion(
    block: Block,
    reference: Reference,
    alignment: Alignment,
    per_row: int,
    stretch_s: float,
    margin: float,
) -> MotionRows:
    """Reduce samples to rows, where the reference covers them.

    Parameters
    ----------
    block : the recording; a triad that the reference lacks altogether is left aside
    reference, alignment : of the motion
    per_row : samples of a row
    stretch_s : about how long a stretch is, s
    margin : s at both ends of the reference that are left out

    """
    six = block.six
    six[:, np.repeat(~reference.observed.reshape(2, 3).any(axis=1), 3)] = np.nan
    measured = np.isfinite(six).sum(axis=0) >= FEWEST
    good = np.isfinite(six[:, measured]).all(axis=1)
    good &= reference.covers(alignment.reference_time(block.t), margin)
    kept = np.flatnonzero(good)
    step = float(np.median(np.diff(block.t)))
    broken = (np.diff(block.t[kept]) > GAP * step) | (np.diff(kept) > 1)
    length = max(int(stretch_s / step / per_row), 1)
    stretches = [
        run[: len(run) // (per_row * length) * per_row * length]
        for run in np.split(kept, np.flatnonzero(broken) + 1)
    ]
    at = np.concatenate(stretches).reshape(-1, per_row)
    temperature = block.temperature[at].mean(axis=1)
    return MotionRows(
        block.t[at], six[at].mean(axis=1), temperature, length,
        step * per_row, reference, alignment,
    )  # fmt: skip
