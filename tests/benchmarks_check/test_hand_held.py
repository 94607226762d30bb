"""Logs that are drawn without a fixture, and how they are judged."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.hand_held import pulls
from benchmarks.hand_held.draws import GRAVITY, Device, log


def device(acc: np.ndarray, gyr: np.ndarray) -> Device:
    none = np.zeros(6)
    return Device(none[:3], none[:3], acc, gyr, (0.0, 0.0), none, 0.0, (0.0, 0.0))


@pytest.mark.parametrize("seed", [pytest.param(3, marks=pytest.mark.thorough), 8])
def test_a_log_is_of_a_device_that_rests_and_turns(seed: int) -> None:
    one = log(88_000_000 + seed)
    t, six = one.rows[:, 0], one.rows[:, 1:7]
    assert (np.diff(t) > 0).all()
    force = np.linalg.solve(one.device.acc, (six[:, :3] - one.device.acc_bias).T)
    first = np.linalg.norm(force[:, :100].mean(axis=1))
    assert first == pytest.approx(GRAVITY, abs=0.02)
    rate = np.linalg.solve(one.device.gyr, (six[:, 3:] - one.device.gyr_bias).T)
    turned = np.linalg.norm(rate, axis=0) > 0.3
    assert np.sum(np.diff(turned.astype(int)) == 1) >= one.places - 1


def test_what_is_off_is_told_about_the_axes_of_the_tool() -> None:
    """The same device, whatever attitude its case has to the accelerometers."""
    rng = np.random.default_rng(5)
    upper = np.triu(0.01 * rng.standard_normal((3, 3)), 1) + np.diag([1.01, 0.99, 1.02])
    gyr = np.eye(3) + 0.01 * rng.standard_normal((3, 3))
    case = Rotation.from_rotvec([0.01, -0.02, 0.015]).as_matrix()
    scale = np.diag(gyr)
    told = {
        "acc_scale": {"value": np.diag(upper) + 0.01, "sigma": [0.005] * 3},
        "gyr_scale": {"value": scale - [0.0, 0.01, 0.02], "sigma": [0.01] * 3},
        "cross_coupling": {
            "value": (upper / np.diag(upper)[:, None])[np.triu_indices(3, 1)],
            "sigma": [1e-6] * 3,
        },
        "gyro_cross_coupling": {
            "value": [*((gyr / scale[:, None])[~np.eye(3, dtype=bool)] + 2e-3)],
            "sigma": [1e-3] * 6,
        },
    }
    found = pulls(told, device(upper @ case, gyr @ case))
    expected = [2.0] * 3 + [0.0, -1.0, -2.0] + [0.0] * 3 + [2.0] * 6
    np.testing.assert_allclose(found, expected, atol=1e-6)
