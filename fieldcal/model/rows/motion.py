"""Rows of a device in motion, compared with a reference that has the same motion.

The reference states specific force and angular rate, u(s), at every time s of its own
clock. The device experiences at time t of its clock

    v(t) = R u(s),    s = t - delay + drift (t - middle)                           (1)

with R the rotation from the axes of the reference to those of the device. A row is the
mean of some samples, and of v at the same times; or, where samples are even and the
reference has several in each row, v of the reference's mean over a row, in the middle.
Rows lie in stretches without gaps. Since the noise is not white, the rows of each
stretch are replaced by their cosine coefficients,

    c_k = sqrt(2 / n) sum_j y_j cos(pi k (j + 1/2) / n),    c_0 by 1 / sqrt(n)       (2)

at the frequencies f_k = k / (2 n d), with d the spacing of the rows, s. For stationary
noise these are nearly independent. For noise slower than a stretch, (2) is applied once
more to the c_0 of the m stretches, at frequencies j / (2 m n d). m/s^2, rad/s, device
axes. Source:
DCT-II, N. Ahmed et al. 1974; P. Whittle 1953 for the independence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.fft import dct, idct

from fieldcal.core.gravity import G0
from fieldcal.core.samples import ACC, GYR, Array, Index, Mask
from fieldcal.model import resolutions
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.reference_noise import ReferenceNoise
from fieldcal.model.rows.response import Response
from fieldcal.physics.experience import Experience

TRIADS = (ACC, GYR)


@dataclass(frozen=True, slots=True)
class Alignment:
    """Alignment of a recording with its reference, (1).

    Attributes
    ----------
    delay : s that the recording's clock is ahead of the reference's at `middle`
    drift : by how much the reference's clock is the quicker one, 1
    middle : s of the recording's clock
    rotation : (3, 3) R, device = R reference
    unseen_gravity : (6,) gravity along an upright axis that the reference lacks, m/s^2

    """

    delay: float
    drift: float
    middle: float
    rotation: Array = field(default_factory=lambda: np.eye(3))
    unseen_gravity: Array = field(default_factory=lambda: np.zeros(6))

    def reference_time(self, t: Array) -> Array:
        """Instants of the recording by the reference's clock, s."""
        return t - self.delay + self.drift * (t - self.middle)  # (1)


@dataclass(frozen=True, slots=True)
class MotionRows:
    """Rows of a recording beside a reference.

    Attributes
    ----------
    t : (n, m) s, stamps of the samples of each row
    at : (n, k) s, where the reference is taken: at all of them, or in the row's middle
    uneven : (n, k) s, by how much these are off the even times of their stretch
    y : (n, 6) their means, m/s^2 and rad/s; nan where a channel was not measured
    warming, heating : (n,) K and K/s, since the recording's start; nan if no
        thermometer shows a change
    length : rows of each stretch
    step : s from row to row
    reference : of the motion
    noise : that the reference may have
    alignment : beside it
    acc, gyr : what each triad makes of the motion, as far as that is known
    share : of `uneven` that is known to be the stamps' error

    """

    t: Array
    at: Array
    uneven: Array
    y: Array
    warming: Array
    heating: Array
    length: int
    step: float
    reference: Reference
    noise: ReferenceNoise
    alignment: Alignment
    acc: Response
    gyr: Response
    share: float = 0.0

    def __len__(self) -> int:
        return len(self.y)

    @property
    def used(self) -> Mask:
        """Rows with a value, by channel, (n, 6)."""
        return np.isfinite(self.y)

    @property
    def stretch(self) -> Index:
        """Number of the stretch that each row lies in, (n,)."""
        return np.arange(len(self)) // self.length

    @property
    def part(self) -> Index:
        """Number of the part of the recording that each row lies in, (n,)."""
        count = len(self) // self.length
        return self.stretch * min(resolutions.RECORDING_PARTS, count) // count

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
        cosines: Array = out.reshape(values.shape)
        return cosines

    def select_stretches(self, coefficients: Array, stretches: Index) -> Array:
        """Coefficients (m, k) of some stretches alone, of those (n, k) of all."""
        apart = coefficients.reshape(-1, self.length, coefficients.shape[1])
        means = idct(apart[:, 0], axis=0, norm="ortho")
        out = apart[stretches].copy()
        out[:, 0] = dct(means[stretches], axis=0, norm="ortho")
        return out.reshape(-1, coefficients.shape[1])

    def motion(self, response: Response, order: int = 0) -> Array:
        """The motion as a triad's response gives it, or a derivative, (n, 6)."""
        values = self._means_of(response.sensed, response.late, order)
        if order == 0:
            values += np.hstack(
                [self.alignment.unseen_gravity[p] @ self._turn for p in TRIADS]
            )
        return values

    def hidden(self) -> Array:
        """What noise of the reference hides of the motion in each output, (n, 6)."""
        both = [
            self._means_of(response.follow(self.noise.hidden), response.late, 0)
            for response in self._responses
        ]
        return np.hstack([both[0][:, ACC], both[-1][:, GYR]])

    def experience(self, response: Response) -> Experience:
        """The same as the inputs of effects."""
        v, change, bend = (self.motion(response, order) for order in range(3))
        n, t = len(self), self.middles
        missed: Array = np.zeros((n, 6))
        if self.uneven.any():
            missed = self._means_of(response.sensed, response.late, 1, self.uneven)
        unknown = np.full(n, np.nan)
        return Experience(
            alpha=unknown, beta=unknown, gamma=np.zeros(n),
            f=v[:, ACC], w=v[:, GYR], w_dot=change[:, GYR],
            slope=self._own_means([r.slope for r in self._responses]),
            bend=self._own_means([r.bend for r in self._responses]),
            missed=missed,
            f_dot=change[:, ACC], f_bend=bend[:, ACC], w_bend=bend[:, GYR],
            passed=np.zeros((n, 6)),
            t=t, lasts=np.full(n, self.step), since_start=t - t[0],
            since_turn=np.full(n, np.inf), warming=self.warming,
            heating=self.heating, variance=np.zeros((n, 3)),
            position=self.part, rate=v[:, GYR], speed=np.zeros(n),
            speed_sigma=np.zeros(n), base_force=np.array([0.0, -G0, 0.0]),
            base_rate=np.zeros(3), mounting=np.eye(3), latitude=np.nan,
            gravity_sigma=0.0, attitude_sigma=unknown, transport=np.zeros(3),
            alpha_axis=np.full((n, 3), np.nan),
        )  # fmt: skip

    @property
    def _responses(self) -> tuple[Response, ...]:
        """Those of the two triads, or the one of both."""
        return (self.acc,) if self.gyr is self.acc else (self.acc, self.gyr)

    def _own_means(self, references: Sequence[Reference]) -> Array:
        """Means of what belongs to each of the responses, in its own channels."""
        means = [
            self._means_of(reference, response.late, 0)
            for reference, response in zip(references, self._responses, strict=True)
        ]
        return np.hstack([means[0][:, ACC], means[-1][:, GYR]])

    @property
    def _turn(self) -> Array:
        return self.alignment.rotation.T

    def _means_of(
        self, reference: Reference, late: float, order: int, weight: Array | None = None
    ) -> Array:
        """Means over the rows of a reference as it was, in device axes, (n, 6).

        `weight` (n, k) is what it is multiplied by where it is taken.
        """
        taken = self.at - self.share * self.uneven
        s = self.alignment.reference_time(taken.ravel() - late)
        samples = reference.at(s, order).reshape(*taken.shape, 6)
        if weight is not None:
            samples *= weight[:, :, None]
        means = np.einsum("nmc->nc", samples) / samples.shape[1]  # mean() is slower
        return np.hstack([means[:, p] @ self._turn for p in TRIADS])  # (1)


def frequencies(count: int, length: int, step: float) -> Array:
    """Of the coefficients of some rows in stretches of a length, (count,) Hz."""
    k = np.arange(count)
    out = (k % length) / (2 * length * step)
    slow = k[::length]
    out[slow] = slow / length / (2 * step * count)
    return out
