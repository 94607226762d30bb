"""Rotations of both triads, from calibrations of devices that are turned exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldcal.acceptance.common_rotation import check_common_rotation
from fieldcal.calibration import Calibration
from fieldcal.calibration.limits import read
from fieldcal.core.samples import Array

LIMITS = read("tactical")
SIGMA = 4e-4


def turned(acc_deg: Array, gyr_deg: Array | None, sigma: float = SIGMA) -> Calibration:
    """Couplings of triads whose axes are turned by rotation vectors, deg."""
    names, values = [], []
    for prefix, by in (
        ("cross_coupling.k", acc_deg),
        ("gyro_cross_coupling.s", gyr_deg),
    ):
        if by is None:
            continue
        coupling = Rotation.from_rotvec(by, degrees=True).inv().as_matrix()
        for i, j in ((i, j) for i in range(3) for j in range(3) if i != j):
            names.append(f"{prefix}{i + 1}{j + 1}")
            values.append(coupling[i, j] / coupling[i, i])
    k = len(names)
    return Calibration(
        "joint", tuple(names), np.array(values), sigma**2 * np.eye(k), ("1",) * k,
        1.0, 1, 1e-3,
    )  # fmt: skip


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rotation_is_stated_with_its_axis(axis: int, sign: float) -> None:
    by = 1.3 * sign * np.eye(3)[axis]
    (check,) = check_common_rotation(turned(by, by), LIMITS)
    sigma = np.rad2deg(SIGMA / np.sqrt(2))
    assert check.ok is None
    assert (
        f"turned by {1.3 * sign:.2f} ± {sigma:.2f}° about {'xyz'[axis]}," in check.says
    )
    assert "and so are the gyroscopes" in check.says


def test_without_gyroscopes_nothing_is_said_of_them() -> None:
    (check,) = check_common_rotation(turned(np.array([0.0, 1.0, 0.0]), None), LIMITS)
    assert "gyroscopes" not in check.says and "1.00 ±" in check.says


@pytest.mark.parametrize(
    ("acc", "gyr", "sigma"),
    [(1.3, 0.0, SIGMA),  # one triad is turned in the device
     (0.05, 0.05, 1e-5),  # as sensors usually are
     (1.3, 1.3, 1e-2)],  # nobody knows
)  # fmt: skip
def test_what_is_no_common_rotation_is_not_stated(
    acc: float, gyr: float, sigma: float
) -> None:
    y = np.array([0.0, 1.0, 0.0])
    assert check_common_rotation(turned(acc * y, gyr * y, sigma), LIMITS) == []
