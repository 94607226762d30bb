"""Kinematics of a turn from position p to q: attitudes, forces and the closure.

R (3, 3) transforms vectors from device axes at the start of the turn to device axes at
a later instant (`rotation`). Angles in rad, forces in m/s^2, t in s.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldcal.core.derivative import derivative
from fieldcal.core.rotation import cross
from fieldcal.core.running_integral import running_integral
from fieldcal.core.samples import Array, Index, Mask
from fieldcal.model import resolutions, thresholds
from fieldcal.model.turns.rotation import attitudes_from_rotations, small_turns
from fieldcal.physics.experience import Experience


def trapezoid_means(t: Array, values: Array, cut: Index) -> Array:
    """Means (k, ...) between indices cut (k + 1,) of values (n, ...) at instants t."""
    total = running_integral(t, values)
    length = np.diff(t[cut]).reshape(-1, *[1] * (values.ndim - 1))
    return np.diff(total[cut], axis=0) / length


def interpolate_vectors(
    attitude: Array, done: Array, start: Array, end: Array
) -> Array:
    """Vectors fixed in the base, in device axes during a turn, (m + 1, 3, ...).

    They are carried along from both ends, and weighted by the completed part. `start`
    and `end` (3, ...) are their values in device axes at both ends, `attitude` (m + 1,
    3, 3) is R, and `done` (m + 1,) the completed part of the turn.
    """
    part = done[:, None, None]
    at_start = attitude[-1].T @ end
    # as one product of a matrix: numpy is slow at many of small ones
    both = np.hstack([start.reshape(3, -1), at_start.reshape(3, -1)])
    carried = (attitude.reshape(-1, 3) @ both).reshape(len(done), 3, -1)
    width = both.shape[1] // 2
    out: Array = (1 - part) * carried[..., :width] + part * carried[..., width:]
    return out.reshape(len(done), *start.shape)


def sampling_error(t: Array, w: Array, each: int, noise: Array) -> float:
    """Error of the attitude at the end of a turn by the finite sampling rate, rad.

    The attitude from all samples is compared with that from every second one. The part
    of noise is subtracted from the square of their difference, and the root is divided
    by three (Richardson's rule for a method of second order at least).

    Parameters
    ----------
    t, w : (n,) s, (n, 3) rad/s samples of the turn
    each : samples in a step of the integration
    noise : (3,) white noise of one sample, rad/s

    """
    whole = (len(t) - 1) // (2 * each) * 2 * each
    ends = []
    for skip in (1, 2):
        coarse = slice(0, whole + 1, skip)
        edge = np.arange(0, whole // skip + 1, max(each // skip, 1))
        ends.append(
            attitudes_from_rotations(small_turns(t[coarse], w[coarse], edge))[-1]
        )
    rotation = ends[0] @ ends[1].T
    square = rotation[2, 1] ** 2 + rotation[0, 2] ** 2 + rotation[1, 0] ** 2
    by_noise = float(noise @ noise) * float(t[-1] - t[0]) ** 2 / len(t)
    return float(np.sqrt(max(square - by_noise, 0.0)) / 3)


def antisymmetric_vector(matrix: Array) -> Array:
    """Vectors v of the antisymmetric parts [v]x of matrices (..., 3, 3), (..., 3).

    >>> cross = np.array([[0.0, -3.0, 2.0], [3.0, 0.0, -1.0], [-2.0, 1.0, 0.0]])
    >>> antisymmetric_vector(cross)
    array([1., 2., 3.])
    """
    part = (matrix - np.swapaxes(matrix, -1, -2)) / 2
    return np.stack([part[..., 2, 1], part[..., 0, 2], part[..., 1, 0]], axis=-1)


def accelerations(t: Array, w: Array) -> Array:
    """Angular acceleration (m + 1, 3), rad/s^2, from short means of the rates w."""
    step = float(np.ptp(t)) / (len(t) - 1)
    m = max(1, round(resolutions.ACCELERATION_MEAN_S / step)) | 1
    kernel = np.ones(m) / m
    padded = np.pad(w, ((m // 2, m // 2), (0, 0)), mode="edge")
    smooth = np.column_stack([np.convolve(c, kernel, "valid") for c in padded.T])
    # times are averaged too: samples that arrive in one batch have nearly equal times
    times = np.pad(t, m // 2, mode="reflect", reflect_type="odd")
    return derivative(np.convolve(times, kernel, "valid"), smooth)


def contradicts_force(x: Experience, pair: tuple[int, int], attitude: Array) -> bool:
    """Whether the attitude R at the end of a turn contradicts the forces f_p and f_q.

    It does if the force at q, carried back to p, is further from the
    force at p than `thresholds.MAX_MISCLOSURE_RAD`.
    """
    p, q = (x.f[int(np.argmax(x.position == i))] for i in pair)
    cosine = float(p @ (attitude.T @ q)) / float(np.linalg.norm(p) * np.linalg.norm(q))
    return bool(cosine < np.cos(thresholds.MAX_MISCLOSURE_RAD))


def turn_geometry(
    x: Experience, pair: tuple[int, int], attitude: Array, done: Array
) -> tuple[Array, Array, Array]:
    """Force during a turn and its closure, by the positions at both ends.

    Parameters
    ----------
    x : inputs in the rows of the windows
    pair : p and q
    attitude, done : (m + 1, 3, 3) R and (m + 1,) u at the edges

    Returns
    -------
    f : (m + 1, 3) force during the turn, interpolated from both ends
    closure : (3,) phi_T, rad, in device axes at p
    known : (3, 3) projection on the known part of the closure: all of it, or the part
        across the force at p if an orientation is unknown

    """
    ends = first_row_of_each(x, pair)
    f, held = x.f[ends], x.to_device_in(ends)
    (closure,), (whole,) = closures(f[None], held[None], attitude[-1])
    known = np.eye(3)
    if not whole:
        known -= np.outer(f[0], f[0]) / (f[0] @ f[0])
    return interpolate_vectors(attitude, done, *f), closure, known


def first_row_of_each(x: Experience, positions: Iterable[int]) -> Index:
    """Index of the first row of each position, (p,)."""
    return np.array([int(np.argmax(x.position == p)) for p in positions])


def closures(f: Array, held: Array, end: Array) -> tuple[Array, Mask]:
    """Closures phi_T in device axes at p, and whether all components are known.

    Parameters
    ----------
    f : (n, 2, 3) forces in both positions, device axes
    held : (n, 2, 3, 3) direction cosines from base to device; nan where unknown
    end : (3, 3), or (n, 3, 3), attitude R at the end of the turn

    Returns
    -------
    (n, 3) rad, and (n,) whether it is whole; if not, it is the part across the force at
    p, from the directions of both forces

    """
    rotation = (
        np.swapaxes(end, -1, -2) @ held[:, 1] @ np.swapaxes(held[:, 0], 1, 2)
    )  # I + [phi]x
    whole = (np.trace(rotation, axis1=1, axis2=2) - 1) / 2 > np.cos(
        thresholds.MAX_MISCLOSURE_RAD
    )
    if whole.all():
        return antisymmetric_vector(rotation), whole
    up = f[:, 0] / np.linalg.norm(f[:, 0], axis=1, keepdims=True)
    force = (f[:, 1, None] @ end)[:, 0]
    force /= np.linalg.norm(force, axis=1, keepdims=True)
    return np.where(
        whole[:, None], antisymmetric_vector(rotation), cross(up, force)
    ), whole
