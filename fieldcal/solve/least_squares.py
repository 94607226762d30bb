"""Least squares over n known positions or n known rates of a table, as printed.

    axial accelerometers      U = B + M1 f                                        (1.1)
    pendulous accelerometers  U = B + M1 f + M2 (fx fy, fy fz, fx fz)             (2.1)
    gyroscopes                W = B + M1 w                                        (3.1)
    gyroscopes, expanded      W = B + M1 w + M2 (wx wy, wy wz, wx wz)             (4.1)

One row of the matrix G is (1, v) or (1, v, products), v = f or w, and the solution is
X = (G^T G)^-1 G^T U (1.3) (2.3) (3.3) (4.3), the Earth's rate left in W. f in m/s^2, w
in rad/s, B and M in device axes. Source: Avrutov, Sapegin, Stefanishin, Tsisarzh 2017.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array
from fieldcal.solve.closed import Closed
from fieldcal.solve.observations import Observations
from fieldcal.solve.rank import determined


def matrix(v: Array, products: bool = False) -> Array:
    """Rows (1, v) or (1, v, products) of the calibration equation, (n, 4) or (n, 7).

    >>> matrix(np.array([[1.0, 2.0, 3.0]]), products=True)
    array([[1., 1., 2., 3., 2., 6., 3.]])
    """
    parts = [np.ones((len(v), 1)), v]
    if products:
        parts.append(v * np.roll(v, -1, axis=1))  # x y, y z, z x
    return np.hstack(parts)


def accelerometers(observations: Observations, products: bool = False) -> Closed:
    """Bias, scale factor, cross-coupling, (1.3); with `products` pendulous, (2.3)."""
    names = _names("acc_bias", "acc_scale", "cross_coupling.k", "pendulous_products.l")
    return _solved(names, matrix(observations.forces, products), observations, ACC)


def gyroscopes(observations: Observations, products: bool = False) -> Closed:
    """Bias, scale factor, cross-coupling, (3.3); with `products` expanded, (4.3)."""
    names = _names("gyr_bias", "gyr_scale", "gyro_cross_coupling.s", "gyro_products.p")
    return _solved(names, matrix(observations.rates, products), observations, GYR)


def _names(bias: str, scale: str, cross: str, product: str) -> list[list[str]]:
    """Full names, one row a column of G, one column a channel."""
    table = [[f"{bias}.{axis}" for axis in "xyz"]]
    for j in range(3):
        table.append(
            [f"{scale}.{'xyz'[i]}" if i == j else f"{cross}{i + 1}{j + 1}"
             for i in range(3)]
        )  # fmt: skip
    return [*table, *([f"{product}{i + 1}{j + 1}" for i in range(3)] for j in range(3))]


def _solved(
    names: list[list[str]], g: Array, observations: Observations, channels: slice
) -> Closed:
    """X = (G^T G)^-1 G^T U of the columns that are determined."""
    known, _ = determined(g)
    inverse = np.linalg.pinv(g[:, known])  # (1.3) (2.3) (3.3) (4.3)
    gain = np.einsum("kn,cd->kcnd", inverse, np.eye(3)).reshape(-1, len(g), 3)
    kept = [n for row, k in zip(names, known, strict=False) if k for n in row]
    return Closed.of(kept, gain, observations, channels)
