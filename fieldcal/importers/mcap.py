"""MCAP files with ROS 2 messages: topics of sensor_msgs/msg/Imu.

A stream is a topic. Units are those of the message, m/s^2 and rad/s; the time is the
stamp in its header. A temperature comes along from the topic of
sensor_msgs/msg/Temperature that has the same frame, where there is one.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importing.files.packed_stream import unpacked_file
from fieldcal.importing.messages.mcap_messages import (
    Decoders,
    QuietDecoders,
    messages,
)
from fieldcal.importing.messages.ros_messages import (
    IMU,
    TEMPERATURE,
    MessageRows,
    message_row,
)
from fieldcal.importing.recording import ImuStream, Recording

WHAT = "MCAP with sensor_msgs/Imu"

MAGIC = b"\x89MCAP0\r\n"


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one."""
    return head.startswith(MAGIC)


class McapLog(Recording):
    """An MCAP file."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("mcap", "mcap_ros2"), "mcap"

    def streams(self) -> list[ImuStream]:
        """Topics with samples."""
        found = [topic for topic, kind in self._topics().items() if kind == IMU]
        if not found:
            raise InputError(f"{self.path}: has no topic of {IMU}")
        return [ImuStream(topic, "m/s^2, rad/s") for topic in sorted(found)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return topic and units."""
        return {"message": stream, "acc_unit": "m/s^2", "gyr_unit": "rad/s"}

    def _topics(self) -> dict[str, str]:
        """Kind of the messages of each topic."""
        with unpacked_file(self.path, self.cut_off) as path:
            if self.repair:
                said = messages(path, self.damaged, self.cut_off)
                return {one.channel.topic: one.kind for one in said}
            return self._summary(path)

    def _summary(self, path: Path) -> dict[str, str]:
        from mcap.exceptions import McapError
        from mcap.reader import make_reader

        with path.open("rb") as file:
            try:
                summary = make_reader(file).get_summary()
            except (McapError, ValueError, EOFError, OSError, struct.error):
                summary = None
        if summary is None:
            raise InputError(
                f"{self.path}: has no summary at its end, as if cut off;"
                f" {_describe_undamaged(path)}, or copy it again from where it came"
            )
        kinds = {n: schema.name for n, schema in summary.schemas.items()}
        return {
            channel.topic: kinds.get(channel.schema_id, "")
            for channel in summary.channels.values()
        }

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a topic, many at a time."""
        degrees = {t for t, kind in self._topics().items() if kind == TEMPERATURE}
        rows = MessageRows()
        warm = dict[str, float]()
        with unpacked_file(self.path, self.cut_off) as path:
            found = self._streamed if self.repair else self._indexed
            for topic, logged, said in found(path, stream, degrees):
                try:
                    if topic != stream:
                        warm[said.header.frame_id] = said.temperature
                        continue
                    degrees_now = warm.get(said.header.frame_id, np.nan)
                    row = message_row(said, degrees_now, logged)
                except (AttributeError, TypeError) as error:
                    raise InputError(
                        f"{self.path}: messages of {topic} are none of the kind that"
                        f" they are called, by their schema in the file ({error});"
                        " record them again with the definition of their type"
                    ) from error
                yield from rows.add(row)
        yield from rows.rest()
        self.says += [s for s in rows.says if s not in self.says]

    def _indexed(
        self, path: Path, stream: str, degrees: set[str]
    ) -> Iterator[tuple[str, int, Any]]:
        """Topic, time of logging, ns, and contents of messages, in order of time."""
        from mcap.reader import make_reader

        seen = 0
        with path.open("rb") as file:
            decoders: Any = [QuietDecoders()]  # as the reader wants them, by its shape
            reader = make_reader(file, validate_crcs=True, decoder_factories=decoders)
            try:
                for _, channel, message, said in reader.iter_decoded_messages(
                    topics=[stream, *degrees]
                ):
                    yield channel.topic, message.log_time, said
                    seen += channel.topic == stream
            except Exception as error:
                # decoders are made of what the file says, and raise what they like
                raise InputError(
                    f"{self.path}: cannot be read behind message {seen} of {stream}: "
                    f"{error or type(error).__name__}; copy it again, or leave out what"
                    " is damaged with --repair"
                ) from error

    def _streamed(
        self, path: Path, stream: str, degrees: set[str]
    ) -> Iterator[tuple[str, int, Any]]:
        """The same in the order of the file, without those that are damaged."""
        decoders, seen = Decoders(), 0
        for one in messages(path, self.damaged, self.cut_off):
            if one.channel.topic not in {stream, *degrees}:
                continue
            seen += one.channel.topic == stream
            try:
                said = decoders.read(one)
            except Exception as error:
                # decoders are made of what the file says, and raise what they like
                where = f"message {seen} of {one.channel.topic}"
                self.damaged(where, f"cannot be read ({error})")
                continue
            if one.kind in (IMU, TEMPERATURE) and said is not None:
                yield one.channel.topic, one.message.log_time, said


def _describe_undamaged(path: Path) -> str:
    """Message on the undamaged part of a file without a summary, and its recovery."""

    def pass_over(where: str, what: str) -> None:
        pass

    found = Counter(
        one.channel.topic
        for one in messages(path, pass_over, pass_over)
        if one.kind == IMU
    )
    if not found:
        return "no message of an IMU in it is whole"
    many = ", ".join(f"{n} messages of {topic}" for topic, n in sorted(found.items()))
    return f"{many} are whole: take them with --repair"
