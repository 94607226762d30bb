"""Bags of ROS 1 (.bag) and of ROS 2 (.db3): topics of sensor_msgs/Imu.

A stream is a topic. Units are those of the message, m/s^2 and rad/s; the time is the
stamp in its header. A temperature comes along from the topic of sensor_msgs/Temperature
that has the same frame, where there is one. Messages are read by `rosbags`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importing.files.packed_stream import first_bytes, unpacked_file
from fieldcal.importing.messages.ros_messages import (
    IMU,
    TEMPERATURE,
    MessageRows,
    message_row,
)
from fieldcal.importing.recording import ImuStream, Recording

WHAT = "ROS bags: .bag, .db3"

BAG, SQLITE = b"#ROSBAG V2.0", b"SQLite format 3\0"

TOPICS = b"CREATE TABLE topics"
"""What the first page of a database of ROS 2 holds, and no other."""


class Message(NamedTuple):
    """A message: its topic, time of logging, ns, and contents."""

    topic: str
    logged: int
    said: Any


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one."""
    return head.startswith(BAG) or (head.startswith(SQLITE) and TOPICS in head)


class RosBag(Recording):
    """A bag."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("rosbags",), "ros"

    def streams(self) -> list[ImuStream]:
        """Topics with samples."""
        with unpacked_file(self.path, self.cut_off) as path:
            topics = self._topics(path)
        found = [topic for topic, kind in topics.items() if kind == IMU]
        if not found:
            raise InputError(f"{self.path}: has no topic of {IMU}")
        return [ImuStream(topic, "m/s^2, rad/s") for topic in sorted(found)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return topic and units."""
        return {"message": stream, "acc_unit": "m/s^2", "gyr_unit": "rad/s"}

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a topic, many at a time."""
        rows = MessageRows()
        warm = dict[str, float]()
        with unpacked_file(self.path, self.cut_off) as path:
            kinds = self._topics(path)
            wanted = {t for t, kind in kinds.items() if kind == TEMPERATURE}
            wanted.add(stream)
            for topic, logged, said in self._messages(path, kinds, wanted):
                if topic != stream:
                    warm[said.header.frame_id] = said.temperature
                    continue
                degrees = warm.get(said.header.frame_id, np.nan)
                yield from rows.add(message_row(said, degrees, logged))
        yield from rows.rest()
        self.says += [s for s in rows.says if s not in self.says]

    def _topics(self, path: Path) -> dict[str, str]:
        """Kind of the messages of each topic."""
        try:
            if _is_first(path):
                from rosbags.rosbag1 import Reader

                with Reader(path) as bag:
                    return {one.topic: one.msgtype for one in bag.connections}
            with _database(path) as base:
                return dict(base.execute("SELECT name, type FROM topics"))
        except Exception as error:
            raise InputError(
                f"{self.path}: its list of topics cannot be read: {_reason(error)};"
                " copy"
                " the file again from where it came"
            ) from error

    def _messages(
        self, path: Path, kinds: dict[str, str], wanted: set[str]
    ) -> Iterator[Message]:
        """Messages of some topics in order of time."""
        seen = 0
        try:
            found = _ros1_messages if _is_first(path) else _ros2_messages
            for one in found(path, kinds, wanted):
                yield one
                seen += 1
        except Exception as error:
            # readers are made of what the file says, and raise what they like
            self.cut_off(f"message {seen + 1}", f"cannot be read: {_reason(error)}")


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _is_first(path: Path) -> bool:
    return first_bytes(path).startswith(BAG)


def _database(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"file:{path}?mode=ro", uri=True)


def _ros1_messages(
    path: Path, kinds: dict[str, str], wanted: set[str]
) -> Iterator[Message]:
    """Messages of a bag of ROS 1."""
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    with Reader(path) as bag:
        some = [one for one in bag.connections if one.topic in wanted]
        for one, logged, data in bag.messages(connections=some):
            yield Message(one.topic, logged, types.deserialize_ros1(data, one.msgtype))


def _ros2_messages(
    path: Path, kinds: dict[str, str], wanted: set[str]
) -> Iterator[Message]:
    """Messages of a bag of ROS 2 in a database."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    marks = ",".join("?" * len(wanted))
    query = (
        "SELECT topics.name, messages.timestamp, messages.data FROM messages"
        " JOIN topics ON topics.id = messages.topic_id"
        f" WHERE topics.name IN ({marks}) ORDER BY messages.timestamp"
    )
    with _database(path) as base:
        for topic, logged, data in base.execute(query, sorted(wanted)):
            told = types.deserialize_cdr(data, kinds[topic])
            yield Message(topic, int(logged), told)  # a database may hold anything
