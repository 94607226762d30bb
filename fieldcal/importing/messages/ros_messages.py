"""Messages of ROS about an IMU, as samples: `sensor_msgs/msg/Imu` and Temperature."""

from __future__ import annotations

from typing import Any

import numpy as np

from fieldcal.core.samples import Block

IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"

NOT_MEASURED = -1
"""First element of a covariance where nothing was measured."""

MESSAGES_AT_ONCE = 4096
"""Messages made into samples at once."""


def message_row(said: Any, degrees: float, logged: int) -> tuple[float, ...]:
    """Return a row t, acc, gyr, deg C and time of logging, s, of a message.

    Parameters
    ----------
    said : the message
    degrees : temperature of its frame
    logged : ns

    """
    stamp, f, w = said.header.stamp, said.linear_acceleration, said.angular_velocity
    acc = (f.x, f.y, f.z)
    if said.linear_acceleration_covariance[0] == NOT_MEASURED:
        acc = (np.nan,) * 3
    gyr = (w.x, w.y, w.z)
    if said.angular_velocity_covariance[0] == NOT_MEASURED:
        gyr = (np.nan,) * 3
    return (stamp.sec + 1e-9 * stamp.nanosec, *acc, *gyr, degrees, 1e-9 * logged)


def samples_of_rows(rows: list[tuple[float, ...]]) -> Block:
    """Convert rows of `message_row` to samples."""
    table = np.array(rows)
    t, acc, gyr = table[:, 0], table[:, 1:4], table[:, 4:7]
    return Block.of(t, acc, gyr, table[:, 7], None, table[:, 8])
