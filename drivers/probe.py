"""Listen to a port: which device answers, at which rate, in which format."""

from __future__ import annotations

from collections.abc import Iterable
from time import monotonic
from typing import NamedTuple

from fieldcal.core.errors import DeviceError
from fieldcal.drivers.codec import (
    FormatMatch,
    codec_class,
    open_codec,
    recognise_format,
    wire_formats,
)
from fieldcal.drivers.column_guess import describe_lines
from fieldcal.drivers.mavlink_detection import detect_autopilot
from fieldcal.drivers.named_guess import NameReader, guess_named_options
from fieldcal.drivers.options import Options
from fieldcal.drivers.protocols.text import TextCodec
from fieldcal.drivers.reader import ByteSource
from fieldcal.drivers.serial_imu import open_port
from fieldcal.session.mixed_devices import GIVE_EACH_A_PORT, mixed_samples_text

SILENT_RATES = 2
"""Baud rates at which not a byte came, after which there is no device."""

UNKNOWN_GYRO_UNIT = (
    "; nothing tells the unit of its gyroscopes at rest: rad/s is taken, add"
    " &gyr_unit=deg/s if they send that (a run sees it by the first turn)"
)
"""What is said of lines whose rates may be in either unit."""

ENOUGH_BYTES = 6000
"""Bytes after which a format shows, and so do two devices: 50 of the longest frames."""


OLD_BYTE_DELAY, LONGEST_OLD_READ = 0.003, 0.3
"""Bytes that are there within the first time, s, had come before we listened; they are
read for at most the second time, s: a quick device always has some."""


class DetectedDevice(NamedTuple):
    """What was heard on a port.

    Attributes
    ----------
    port : its path
    url : address that opens it, empty if no format was known
    format : name of the format, or mavlink; empty if none was known
    baud : rate at which it was known, 0 if none
    rate_hz : samples a second, as they arrived
    says : one sentence
    mixed : what shows that two devices send on it; empty if they do not

    """

    port: str
    url: str
    format: str
    baud: int
    rate_hz: float
    says: str
    mixed: str = ""


def baud_rates() -> list[int]:
    """Baud rates to try: what most formats use first."""
    ranked: dict[int, float] = {}
    for name in wire_formats():
        for rank, baud in enumerate(codec_class(name).bauds):
            ranked[baud] = ranked.get(baud, 0.0) + 1 / (1 + rank)
    return sorted(ranked, key=lambda baud: -ranked[baud])


def probe_port(
    port: str,
    seconds: float,
    rates: Iterable[int] | None = None,
    meaning: NameReader | None = None,
) -> DetectedDevice:
    """Listen at one baud rate after the other, at most so many seconds each.

    Lines whose values have names are known where `meaning` tells what those are.
    """
    heard = silent = 0
    lines = ""
    for baud in baud_rates() if rates is None else rates:
        try:
            data, found = _listen_at(port, baud, seconds, meaning)
        except (DeviceError, OSError) as fault:
            return DetectedDevice(port, "", "", 0, 0.0, str(fault))
        heard += len(data)
        silent += not data
        if not lines and (seen := describe_lines(data)):
            lines = f"at {baud} baud {seen}"
        if silent >= SILENT_RATES and not heard:
            break
        if found:
            return found
    says = (
        lines or "bytes come, but no format that is known"
        if heard
        else "nothing comes; is the device powered and sending? A CAN adapter is silent"
        " until a run opens it (--device can:…)"
    )
    return DetectedDevice(port, "", "", 0, 0.0, says)


def _identify(
    port: str,
    baud: int,
    data: bytes,
    took: float,
    old: int = 0,
    meaning: NameReader | None = None,
) -> DetectedDevice | None:
    """Say whose bytes these are; None if that is not known.

    The first `old` of them had waited in the port, so they tell nothing of the rate;
    the others came in `took` s.
    """
    took *= len(data) / max(1, len(data) - old)
    known = recognise_format(data, took)
    if known is None and meaning is not None:
        known = _recognise_names(data, took, meaning)
    if known:
        name, like = known
        query = f"&{like.query}" if like.query else ""
        url = f"serial:{port}?format={name}&baud={baud}{query}"
        rate = like.samples / took
        says = f"{name} at {baud} baud, about {rate:.0f} samples a second"
        if "gx" in query and "gyr_unit" not in query:
            says += UNKNOWN_GYRO_UNIT
        if mixed := _two_devices(name, like.query, data):
            says += f"; {mixed}: {GIVE_EACH_A_PORT}"
        return DetectedDevice(port, url, name, baud, rate, says, mixed)
    if heard := detect_autopilot(data):
        query = f"&{heard.query}" if heard.query else ""
        url, rate = f"mavlink:{port}?baud={baud}{query}", heard.samples / took
        sends = "no message of an IMU until it is asked"
        if heard.message:
            sends = f"{heard.message} about {rate:.0f} times a second"
        says = f"an autopilot (MAVLink) at {baud} baud, which sends {sends}"
        return DetectedDevice(port, url, "mavlink", baud, rate, says)
    return None


def _two_devices(name: str, query: str, data: bytes) -> str:
    """What shows that two devices send these bytes; empty if one does."""
    declared = f"{query}&rate=1" if query else "rate=1"
    block = open_codec(name, Options("probe", declared)).feed(data, 0.0)
    return "" if block is None else mixed_samples_text(block.six)


def _recognise_names(
    data: bytes, took: float, meaning: NameReader
) -> tuple[str, FormatMatch] | None:
    """Match lines whose values have names; None if the names tell no IMU."""
    query = guess_named_options(data, took, meaning)
    like = TextCodec.match_decoded(data, query) if query else None
    return ("text", like) if like else None


def _listen_at(
    port: str, baud: int, seconds: float, meaning: NameReader | None
) -> tuple[bytes, DetectedDevice | None]:
    """Bytes of a port, and whose they are; it stays open until that is known."""
    link = open_port(port, baud)
    try:
        data = _read_old_bytes(link)
        old, took, begin = len(data), 0.0, monotonic()
        while took < seconds and not (
            len(data) > old + ENOUGH_BYTES and took > seconds / 4
        ):
            data += link.read()
            took = monotonic() - begin
        return bytes(data), _identify(port, baud, bytes(data), took, old, meaning)
    finally:
        link.close()


def _read_old_bytes(link: ByteSource) -> bytearray:
    """What had come before we listened, such as all that a pty keeps for nobody."""
    data, begin = bytearray(), monotonic()
    while (asked := monotonic()) - begin < LONGEST_OLD_READ:
        data += link.read()
        if monotonic() - asked > OLD_BYTE_DELAY:
            break
    return data
