"""Attitude as unit quaternions, component by component so that no sum is reordered.

A frame turned by the angle a about the unit axis u has the attitude

    q = (cos a/2, u sin a/2)                                        (q1)

a further turn about an axis of the turned frame multiplies from the right

    q <- q (x) step                                                 (q2)

and a vector that stands still has in the turned frame the coordinates

    q* v q = v - 2 s (r x v) + 2 r x (r x v),   q = (s, r)          (q3)

Arrays hold components first: vectors (3, n), quaternions (4, n). Source: Kuipers,
Quaternions and Rotation Sequences, chapters 5 to 7.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

STILL: Array = np.array([[1.0], [0.0], [0.0], [0.0]])
"""No turn at all, (4, 1)."""


def cross(a: Array, b: Array) -> Array:
    """Vector product of (3, n) arrays, one elementary operation at a time."""
    return np.stack(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )


def turn(axis: Array, angle: Array) -> Array:
    """Quaternion (4, n) of turns by `angle` (n,) rad about unit `axis` (3, 1 or n)."""
    half = np.asarray(angle) / 2
    return np.concatenate([np.cos(half)[None], axis * np.sin(half)])  # (q1)


def multiply(p: Array, q: Array) -> Array:
    """Hamilton product of (4, n) quaternions, (q2)."""
    return np.stack(
        [
            p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
            p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
            p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
        ]
    )


def to_frame(q: Array, v: Array) -> Array:
    """Coordinates of `v` (3, n) in the frame of attitude `q` (4, n), (q3)."""
    s, r = q[0], q[1:]
    across = cross(r, v)
    turned: Array = v - 2 * s * across + 2 * cross(r, across)
    return turned
