"""What the sensor shell of Zephyr prints: a line for each channel of a device.

    uart:~$ sensor get icm42688p@0
    channel type=3(accel_xyz) index=0 shift=8 num_samples=1 value=19162868474ns, (...)
    channel type=12(die_temp) index=0 shift=9 num_samples=1 value=19162868474ns (31.9)
    channel idx=3 accel_xyz shift=8 num_samples=1 value=19162868474ns, (...)
    channel idx=7 gyro_xyz x =  -0.004255 y =  -0.026604 z =   0.012769
    channel idx=12 die_temp =  31.951991
    XL data for lsm6dsv16x@6b 19162868474ns (-0.004787, 0.052671, 9.916782)

Lines of one device and time are one row; without times, a channel that comes again
begins another. Source: Zephyr, sensor_shell.c and the samples of streams; by sensor.h
channels are in m/s^2, rad/s and deg C.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple, Self

from fieldcal.importing.text.labelled_lines import DEVICE
from fieldcal.importing.text.labels import LINES
from fieldcal.importing.text.repeated_lines import NUMBER
from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.words.sensor_words import AXES

_CHANNEL = re.compile(
    r".*?\bchannel (?:type|idx)=\d+(?:\((?P<new>\w+)\)| (?P<old>\w+))"
    r"(?P<rest>\s.*)"
)
_TIMED = re.compile(r".*?\bvalue=(\d+)ns,?\s*\(([^()]*)\)\s*")
_NONE = "num_samples=0 "
_STREAM = re.compile(
    r".*?\b(?P<kind>XL|GY|A|G|TP|T) (?:data for )?(?P<device>\S+) (?P<t>\d+)ns,?"
    r"\s*\((?P<values>[^()]*)\)\s*"
)
_ASKED = re.compile(r".*?~\$\s*sensor (?:get|stream)\s+(\S+)")

TIME = "t [ns]"
STREAMED = {"XL": "accel_xyz", "A": "accel_xyz", "GY": "gyro_xyz", "G": "gyro_xyz",
            "TP": "die_temp", "T": "die_temp"}  # fmt: skip
UNITS = {"accel": "m/s^2", "gyro": "rad/s", "die_temp": "deg C",
         "ambient_temp": "deg C"}  # fmt: skip
"""Units of the channels that are read, by what their names begin with."""


class Channel(NamedTuple):
    """What a line says.

    Attributes
    ----------
    kind : of the channel
    time : ns; nothing if it says none
    values : by the names of the columns

    """

    kind: str
    time: str
    values: dict[str, str]


class ZephyrLines(TextForm):
    """Channels of the sensors that Zephyr's shell was asked for, as rows."""

    gathers = True
    says = "its lines are those of Zephyr's sensor shell, in m/s^2 and rad/s"

    def __init__(self, kinds: Collection[str], names: Sequence[str]) -> None:
        self._kinds, self.names = kinds, tuple(names)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        told = [line for line in lines if not _asked(line)]
        if not is_true_of_most(told, lambda line: _is_channel(line)):
            return None
        read = [one for line in told if (one := _channel(line)) is not None]
        kinds = {one.kind for one in read}
        # of axes that come together and alone, those together are taken
        kinds -= {kind[:-3] + axis for kind in kinds if kind.endswith("xyz")
                  for axis in AXES}  # fmt: skip
        read = [one for one in read if one.kind in kinds]
        columns = dict.fromkeys(name for one in read for name in one.values)
        if not columns:
            return None
        devices = {name for line in lines if (name := _device(line, ""))}
        names = [DEVICE] * (len(devices) > 1)
        names += [TIME] * any(one.time for one in read)
        return cls(kinds, [*names, *columns])

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        row: dict[str, str] = {}
        device = ""

        def taken() -> Iterator[str]:
            if any(name not in (DEVICE, TIME) for name in row):
                yield ",".join(row.get(name, "") for name in self.names)
            row.clear()

        def read(lines: Sequence[str]) -> list[str]:
            nonlocal device
            found = [] if lines else [*taken()]
            for line in lines:
                device = _device(line, device)
                said = _channel(line)
                if said is None or said.kind not in self._kinds:
                    continue
                where = {DEVICE: device, TIME: said.time}
                again = not said.time and row.keys() & said.values.keys()
                if again or any(row.get(k, v) != v for k, v in where.items()):
                    found += taken()
                row.update(where | said.values)
            return found

        return read


def _is_channel(line: str) -> bool:
    # most lines have neither sign, which is seen sooner
    told = "channel" in line and _CHANNEL.match(line) is not None
    return told or ("ns" in line and _STREAM.match(line) is not None)


def _asked(line: str) -> re.Match[str] | None:
    """What the shell was asked for in a line; None of another line."""
    return _ASKED.match(line) if "~$" in line else None


def _device(line: str, before: str) -> str:
    """The device that a line is of, which the shell was asked for `before`."""
    asked = _asked(line)
    if asked is not None:
        return asked[1]
    streamed = _STREAM.match(line)
    return before if streamed is None else streamed["device"]


@lru_cache(LINES)
def _channel(line: str) -> Channel | None:
    """What a line says of an IMU or its temperature; None if nothing.

    >>> _channel("channel idx=12 die_temp =  31.95")
    Channel(kind='die_temp', time='', values={'die_temp [deg C]': '31.95'})
    >>> _channel("XL data for imu@0 120ns (0.1, 0.2, 9.8)").values["accel y [m/s^2]"]
    '0.2'
    """
    if streamed := _STREAM.match(line):
        kind, time, text = STREAMED[streamed["kind"]], streamed["t"], streamed["values"]
    elif (said := _CHANNEL.match(line)) and _NONE not in line:
        kind, text = said["new"] or said["old"], said["rest"]
        timed = _TIMED.fullmatch(text)
        time, text = timed.groups() if timed else ("", text)
    else:
        return None
    unit = next((u for name, u in UNITS.items() if kind.startswith(name)), "")
    values = re.findall(NUMBER, text)
    sensor, _, axis = kind.rpartition("_")
    names = [f"{sensor} {a} [{unit}]" for a in (AXES if axis == "xyz" else axis)]
    if "temp" in kind:
        names = [f"{kind} [{unit}]"]
    if not unit or len(names) != len(values):
        return None
    return Channel(kind, time, dict(zip(names, values, strict=True)))
