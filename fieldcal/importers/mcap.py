"""MCAP files with ROS 2 messages: topics of sensor_msgs/msg/Imu.

A stream is a topic. Units are those of the message, m/s^2 and rad/s; the time is the
stamp in its header. A temperature comes along from the topic of
sensor_msgs/msg/Temperature that has the same frame, where there is one. Other programs'
bags (sqlite3) become MCAP with ``ros2 bag convert``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.errors import InputError
from fieldcal.recording import Recording, Stream, on_disk, unpacked
from fieldcal.samples import Block

WHAT = "MCAP with sensor_msgs/Imu"

MAGIC = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"

IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"

MANY = 4096
"""Samples handed on together."""

NOT_MEASURED = -1.0
"""First element of a covariance where the message has no such measurement."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one, or like the other kind of ROS 2 bag."""
    return head.startswith((MAGIC, SQLITE))


class File(Recording):
    """An MCAP file."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("mcap", "mcap_ros2"), "mcap"

    def streams(self) -> list[Stream]:
        """Topics with samples."""
        found = [topic for topic, kind in self._topics().items() if kind == IMU]
        if not found:
            raise InputError(f"{self.path}: has no topic of {IMU}")
        return [Stream(topic, "m/s^2, rad/s") for topic in sorted(found)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return topic and units."""
        return {"message": stream, "acc_unit": "m/s^2", "gyr_unit": "rad/s"}

    def _topics(self) -> dict[str, str]:
        """Kind of the messages of each topic."""
        from mcap.exceptions import McapError
        from mcap.reader import make_reader

        with unpacked(self.path) as packed:
            if packed.read(len(SQLITE)) == SQLITE:
                raise InputError(
                    f"{self.path}: is a bag of the sqlite3 kind; make an MCAP file of"
                    " it with ros2 bag convert"
                )
        with on_disk(self.path) as path, path.open("rb") as file:
            try:
                summary = make_reader(file).get_summary()
            except (McapError, ValueError, EOFError, OSError) as error:
                raise InputError(
                    f"{self.path}: has no summary at its end: {error or 'cut off'}; "
                    "mend it with mcap recover"
                ) from error
        if summary is None:
            raise InputError(
                f"{self.path}: has no summary at its end; mend it with mcap recover"
            )
        kinds = {n: schema.name for n, schema in summary.schemas.items()}
        return {
            channel.topic: kinds.get(channel.schema_id, "")
            for channel in summary.channels.values()
        }

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a topic, many at a time."""
        from mcap.exceptions import McapError
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        degrees = [t for t, kind in self._topics().items() if kind == TEMPERATURE]
        rows: list[tuple[float, ...]] = []
        with on_disk(self.path) as path, path.open("rb") as file:
            reader = make_reader(
                file, validate_crcs=True, decoder_factories=[DecoderFactory()]
            )
            seen, warm = 0, dict[str, float]()
            try:
                for _, channel, message, said in reader.iter_decoded_messages(
                    topics=[stream, *degrees]
                ):
                    if channel.topic != stream:
                        warm[said.header.frame_id] = said.temperature
                        continue
                    degrees_now = warm.get(said.header.frame_id, np.nan)
                    rows.append(_row(said, degrees_now, message.log_time))
                    seen += 1
                    if len(rows) == MANY:
                        yield _block(rows)
                        rows = []
            except InputError:
                raise
            except (McapError, Exception) as error:
                # decoders are made of what the file says, and raise what they like
                raise InputError(
                    f"{self.path}: cannot be read behind message {seen} of {stream}: "
                    f"{error or type(error).__name__}; mend it with mcap recover"
                ) from error
        if rows:
            yield _block(rows)


def _row(said: Any, degrees: float, logged: int) -> tuple[float, ...]:
    stamp, f, w = said.header.stamp, said.linear_acceleration, said.angular_velocity
    acc = (f.x, f.y, f.z)
    if said.linear_acceleration_covariance[0] == NOT_MEASURED:
        acc = (np.nan,) * 3
    gyr = (w.x, w.y, w.z)
    if said.angular_velocity_covariance[0] == NOT_MEASURED:
        gyr = (np.nan,) * 3
    return (stamp.sec + 1e-9 * stamp.nanosec, *acc, *gyr, degrees, 1e-9 * logged)


def _block(rows: list[tuple[float, ...]]) -> Block:
    table = np.array(rows)
    t, acc, gyr = table[:, 0], table[:, 1:4], table[:, 4:7]
    return Block.of(t, acc, gyr, table[:, 7], None, table[:, 8])
