"""Whether bytes of a port are MAVLink, and which message of an IMU is among them."""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

from fieldcal.drivers.codec import LEAST_SCORE
from fieldcal.drivers.options import Options

HEARTBEAT = "HEARTBEAT"


class DetectedAutopilot(NamedTuple):
    """An autopilot: the options it takes, its message and how often that came.

    Attributes
    ----------
    query : options of its address, empty if none is needed
    message : message of an IMU that comes unasked, empty if there is none
    samples : how many came of the first sensor

    """

    query: str
    message: str
    samples: int


def detect_autopilot(data: bytes) -> DetectedAutopilot | None:
    """Tell what an autopilot says; None if it is none, or pymavlink is not there."""
    if not all(find_spec(module) for module in ("pymavlink", "fastcrc")):
        return None
    from fieldcal.drivers.mavlink_samples import MESSAGE_KINDS, MavlinkDecoder

    def decoded(name: str) -> MavlinkDecoder:
        # any unit will do to count them
        decoder = MavlinkDecoder(Options("probe", f"message={name}&acc_unit=m/s^2"))
        decoder.feed(data, 0.0)
        return decoder

    usual = next(iter(MESSAGE_KINDS))
    first = decoded(usual)
    beats = any(message.get_type() == HEARTBEAT for message in first.other_messages)
    health = first.health
    share = 1 - health.skipped / max(1, health.received)
    if share <= LEAST_SCORE or not (beats or first.messages_heard):
        return None
    name = next((kind for kind in MESSAGE_KINDS if kind in first.messages_heard), "")
    query = f"message={name}" if name not in ("", usual) else ""
    return DetectedAutopilot(query, name, decoded(name).health.samples if name else 0)
