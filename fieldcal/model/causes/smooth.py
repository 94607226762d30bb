"""Smooth functions of a row's covariates, for mismatches without a known effect.

They compete with the effects under the same rules. A mismatch that depends on the angle
of a joint or on time, and on no effect of the catalogue, is thus not attributed to the
most similar effect. Each is a short series with decreasing terms; a course in time is

    sum_k a_k cos(pi k s),    s = (t - t_0) / (t_1 - t_0),    k = 1 ... WAVES

with the session from t_0 to t_1, s. For a smooth course of w half waves, a_k has a
standard deviation proportional to exp(-(k / w)^2 / 2). A random walk
is the same series with a_k of standard deviation q sqrt(2 T) / (pi k) (Karhunen-Loeve;
its mean is part of the bias); a walk far above the noise needs more terms (`wander`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.model import priors, resolutions
from fieldcal.physics.experience import Experience


class CourseSpan:
    """Span of a session in time and temperature, and the functions over it.

    They are the same functions wherever they are evaluated: in the windows, during
    turns, and at the end of the recording.

    Parameters
    ----------
    t : (n,) s, instants of the rows
    count : cosines of the time
    warming : (n,) K, temperature of the rows less that at the session's start; nan
        where unknown

    """

    def __init__(
        self, t: Array, count: int = resolutions.COSINES, warming: Array | None = None
    ) -> None:
        self.start, self.length = float(t[0]), max(float(np.ptp(t)), 1e-9)
        self.count = count
        known = np.nan_to_num(np.zeros(1) if warming is None else warming)
        self.cold, self.range = float(known[0]), float(np.ptp(known)) or 1.0

    def waves(self, x: Experience) -> Array:
        """Means of cosines of the time over the rows, (n, count)."""
        k = np.arange(1, self.count + 1)
        part = self._part(x)
        few, at = np.unique(x.lasts.round(6), return_inverse=True)
        mean = np.sinc(np.outer(few / (2 * self.length), k))[at]
        return np.cos(np.pi * np.outer(part, k)) * mean

    def _part(self, x: Experience) -> Array:
        """Time of the rows as a part of the session, 0 to 1, (n,)."""
        part: Array = (x.t - self.start) / self.length
        return part.clip(0.0, 1.0)

    def fading(self, x: Experience) -> Array:
        """Force along each axis, in gravities, times polynomials of time, (n, 12)."""
        part = 2 * self._part(x) - 1
        steps = np.polynomial.legendre.legvander(part, resolutions.POLYNOMIALS)[:, 1:]
        f = x.f / x.gravity
        return (f[:, :, None] * steps[:, None, :]).reshape(len(x), -1)

    def temperature(self, x: Experience) -> Array:
        """Powers 1 to 4 of the temperature, as a part of its range, (n, 4)."""
        return _powers((np.nan_to_num(x.warming) - self.cold) / self.range)

    def walk(self) -> Array:
        """Standard deviation of each cosine in a walk of 1 per sqrt(s), (count,)."""
        k = np.arange(1, self.count + 1)
        sizes: Array = np.sqrt(2 * self.length) / (np.pi * k)
        return sizes


def smooth_course_sizes(span: float) -> Array:
    """Standard deviation of each cosine of a course of `span` half waves, (k,).

    The course has the rms 1.
    """
    k = np.arange(1, resolutions.COSINES + 1)
    sizes: Array = np.exp(-0.5 * (k / span) ** 2)
    sizes = sizes[sizes > resolutions.MIN_COSINE_SIZE]
    unit_rms: Array = sizes / np.sqrt((sizes**2).sum() / 2)
    return unit_rms


def force_time_columns(axis: int) -> slice:
    """Columns of `CourseSpan.fading` that contain the force along one axis."""
    return slice(axis * resolutions.POLYNOMIALS, (axis + 1) * resolutions.POLYNOMIALS)


def alpha(x: Experience) -> Array:
    """Harmonics of the angle of the first joint."""
    return _angle(x.alpha)


def beta(x: Experience) -> Array:
    """Harmonics of the angle of the second joint."""
    return _angle(x.beta)


def joints(x: Experience) -> Array:
    """Products of harmonics of both joints' angles."""
    # the sines and cosines of the first two harmonics of each angle
    first, second = (_angle(a)[:, [0, 1, 4, 5]] for a in (x.alpha, x.beta))
    return (first[:, :, None] * second[:, None, :]).reshape(len(x), -1)


def _angle(angle: Array) -> Array:
    """Sines and cosines of the harmonics of an angle (n,) rad, over k, (n, 8)."""
    k = np.arange(1, resolutions.HARMONICS + 1)
    turns = np.outer(np.nan_to_num(angle), k)
    return np.hstack([np.sin(turns) / k, np.cos(turns) / k])


def force(x: Experience) -> Array:
    """Powers of the force along each axis, in gravities."""
    f = x.f / x.gravity
    powers = [f**n / n for n in (2, 3, 4, 5)]
    return np.hstack([*powers, np.abs(f) / 2])


def since_turn(x: Experience) -> Array:
    """Powers of the logarithm of the time since the turn."""
    part = np.log1p(np.clip(x.since_turn, 0.0, priors.SETTLED_S)) / np.log1p(100.0)
    return _powers(part)


def _powers(part: Array) -> Array:
    """Powers 1 to 4 of a part of a range, by their number, (n, 4)."""
    return np.column_stack([part**n / n for n in (1, 2, 3, 4)])


def covariates(span: CourseSpan) -> Mapping[str, Callable[[Experience], Array]]:
    """Functions of a row's covariates other than time, by name."""
    return {
        "alpha": alpha,
        "beta": beta,
        "joints": joints,
        "force": force,
        "force and time": span.fading,
        "temperature": span.temperature,
        "since turn": since_turn,
    }
