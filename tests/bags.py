"""Bags of ROS 1 and ROS 2 as a library writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as FirstWriter
from rosbags.rosbag2 import Writer as SecondWriter
from rosbags.typesys import Stores, get_typestore

from fieldcal.core.samples import Array

TOPIC, FRAME = "/imu/data", "imu_link"
IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"


def messages(
    types: Any, rows: Array, first: bool, stamped: bool = True
) -> list[tuple[int, str, Any]]:
    """Time of logging, ns, topic and message of rows t, a, w; some temperatures."""
    header, time = (
        types.types["std_msgs/msg/Header"],
        types.types["builtin_interfaces/msg/Time"],
    )
    vector = types.types["geometry_msgs/msg/Vector3"]
    turn = types.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    open_, found = np.zeros(9), []
    for i, row in enumerate(rows):
        ns = round(1e9 * row[0])
        stamp = time(*(divmod(ns, 10**9) if stamped else (0, 0)))
        above = {"stamp": stamp, "frame_id": FRAME} | ({"seq": i} if first else {})
        said = header(**above)
        if i % 50 == 0:
            warm = types.types[TEMPERATURE](said, 31.5, 0.0)
            found.append((ns, "/imu/temperature", warm))
        one = types.types[IMU](
            said, turn, open_, vector(*row[4:]), open_, vector(*row[1:4]), open_
        )
        found.append((ns + 1000, TOPIC, one))
    return found


def bag(folder: Path, rows: Array, first: bool, stamped: bool = True) -> Path:
    """Write a bag of either kind, rows t, a, w (n, 7), into a folder."""
    if first:
        path, types = folder / "log.bag", get_typestore(Stores.ROS1_NOETIC)
        writer: Any = FirstWriter(path)
        pack = types.serialize_ros1
    else:
        path, types = folder / "log", get_typestore(Stores.ROS2_HUMBLE)
        writer, pack = SecondWriter(path, version=8), types.serialize_cdr
    with writer:
        to = {
            TOPIC: writer.add_connection(TOPIC, IMU, typestore=types),
            "/imu/temperature": writer.add_connection(
                "/imu/temperature", TEMPERATURE, typestore=types
            ),
        }
        for logged, topic, said in messages(types, rows, first, stamped):
            writer.write(to[topic], logged, pack(said, type(said).__msgtype__))
    return path if first else next(path.glob("*.db3"))
