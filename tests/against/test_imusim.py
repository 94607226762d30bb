"""A simulator from PyPI, x-io's, held against the numpy one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import strapdown
from scipy.spatial.transform import Rotation

from fieldcal.against import compare
from fieldcal.core.samples import Array, Block
from fieldcal.session import description_file

G = 9.8
"""Gravity of that simulator, m/s^2."""

UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""East, down, north of its East, north, up."""

NOISE = {"acc": [0.02] * 3, "gyr": [1e-3] * 3}


def trajectory(path: Path) -> Path:
    """The schedule as a file of times, positions and quaternions."""
    t, axes = strapdown.attitude()
    turned = Rotation.from_matrix(np.swapaxes(axes @ UP, 1, 2)).as_quat()
    table = np.column_stack([t, np.zeros((len(t), 3)), turned])
    head = "time,x,y,z,qx,qy,qz,qw"
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")
    return path


def described(table: Array) -> tuple[Block, Any]:
    unknown = np.full(len(table), np.nan)
    block = Block.of(
        table[:, 0], table[:, 1:4], table[:, 4:], unknown, unknown, unknown
    )
    about = {"format": 1, "site": {"gravity": G}, "position": strapdown.schedule()}
    return block, description_file.parse_description(about)


@pytest.mark.thorough
def test_what_x_ios_simulator_is_told_comes_back(tmp_path: Path) -> None:
    simulator = pytest.importorskip("imusim").Simulator(
        trajectory(tmp_path / "trajectory.csv"), xyzw=True
    )
    np.random.seed(4)  # noqa: NPY002 (it draws from that)
    rate = strapdown.RATE_HZ
    simulator.set_accelerometer(
        offset=np.array([0.0, 0.005, 0.0]),
        sensitivity_error=np.array([0.4, 0.0, 0.0]),
        noise_density=np.array(NOISE["acc"]) / G / np.sqrt(rate),
    )
    simulator.set_gyroscope(
        offset=np.array([0.0, 0.0, 0.2]),
        noise_density=np.rad2deg(NOISE["gyr"]) / np.sqrt(rate),
    )
    simulated = np.column_stack(
        [simulator.time, G * simulator.accelerometer, np.deg2rad(simulator.gyroscope)]
    )
    real = strapdown.outputs({"noise": NOISE, "seed": 5}, gravity=G)
    found = compare(described(real), described(simulated))
    told = {
        f"{d.id}.{name}": pair.difference
        for d in found.differences
        for name, pair in d.parameters.items()
    }
    # its rates are differences backward in time, half a sample late
    expected = {
        "acc_bias.y": -0.005 * G,
        "acc_scale.x": -0.004,
        "gyr_bias.z": -np.deg2rad(0.2),
        "time_delay.seconds": -0.5 / rate,
    }
    assert {d.id for d in found.differences} == {n.partition(".")[0] for n in expected}
    for name, value in expected.items():
        off, sigma = float(told[name].value), told[name].sigma or np.nan
        assert abs(off - value) < 4 * sigma < 0.2 * abs(value), name
