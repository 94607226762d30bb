"""Messages of ROS about an IMU, as samples: `sensor_msgs/msg/Imu` and Temperature."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fieldcal.core.samples import Block

IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"

NOT_MEASURED = -1
"""First element of a covariance where nothing was measured."""

UNSTAMPED = (
    "the headers of its messages have no stamp: the times at which they were logged are"
    " taken, which tremble with the load of the computer"
)

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


class MessageRows:
    """Gathers rows of `message_row` to samples, many at a time.

    Where no header has a stamp, the times of logging count, as long as none has.

    Attributes
    ----------
    says : what the user must know, a sentence each

    """

    def __init__(self) -> None:
        self.says: list[str] = []
        self._rows: list[tuple[float, ...]] = []

    def add(self, row: tuple[float, ...]) -> Iterator[Block]:
        """Take a row in; gives samples when there are many."""
        self._rows.append(row)
        if len(self._rows) == MESSAGES_AT_ONCE:
            yield from self.rest()

    def rest(self) -> Iterator[Block]:
        """Give the samples that wait."""
        if not self._rows:
            return
        table, self._rows = np.array(self._rows), []
        t, acc, gyr, logged = table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 8]
        # a simulation begins at 0, and leaves it with its next message
        if (t == 0).all() and (len(t) > 1 or self.says):
            t, self.says = logged, [UNSTAMPED]
        yield Block.of(t, acc, gyr, table[:, 7], None, logged)
