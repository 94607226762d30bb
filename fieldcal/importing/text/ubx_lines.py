"""Messages of a u-blox receiver with an IMU as pyubx2 prints them.

    <UBX(ESF-MEAS, timeTag=514162, …, dataField_01=16776523, dataType_01=16, …)>
    <UBX(ESF-RAW, …, dataField_01=…, dataType_01=16, sTtag_01=…, …)>

A value has 24 bits, signed, which pyubx2 prints without a sign; its kind says what it
is. ESF-MEAS has those of one sensor at a time, in ms; each of the accelerometer goes
with the nearest of the gyroscope. ESF-RAW has a time of 39.0625 us beside each value,
which has 24 bits as well. Source: UBX-13003221, u-blox M8 protocol, UBX-ESF; how they
are printed, by the tests of pyubx2 (test_socket.py: 16776523 is -0.677 m/s^2).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple, Self

from fieldcal.importing.text.nearest_lines import NearestLines
from fieldcal.importing.text.text_form import Reader, TextForm

_MESSAGE = re.compile(r"<UBX\(ESF-(MEAS|RAW), (.*)\)>")
_FIELD = re.compile(r"(\w+?)(?:_(\d\d+))?=(\d+)(?=,|$)")

SCALES = {16: 2.0**-10, 17: 2.0**-10, 18: 2.0**-10, 14: 2.0**-12, 13: 2.0**-12,
          5: 2.0**-12, 12: 0.01}  # fmt: skip
"""What one is by the kind of a value: m/s^2, deg/s and deg C."""

FORCE, RATE, WARM = (16, 17, 18), (14, 13, 5), 12
"""Kinds of x y z of both sensors, and of the thermometer."""

BITS, SPAN = 24, 1 << 24
TICKS = {"MEAS": 1e-3, "RAW": 39.0625e-6}
"""Seconds in one of what the times of each message count."""

NAMES = ("time [s]", "acc_x [m/s^2]", "acc_y [m/s^2]", "acc_z [m/s^2]",
         "gyro_x [deg/s]", "gyro_y [deg/s]", "gyro_z [deg/s]",
         "temperature [degC]")  # fmt: skip


class UbxSample(NamedTuple):
    """Values of one time.

    Attributes
    ----------
    ticks : of the message
    values : by their kind

    """

    ticks: int
    values: Mapping[int, float]

    def of(self, kinds: Sequence[int]) -> list[str]:
        """Values of some kinds, as text; empty if not all are there."""
        there = all(kind in self.values for kind in kinds)
        return [f"{self.values[kind]:.12g}" for kind in kinds] if there else []


class UbxLines(TextForm):
    """Samples of a receiver's IMU as rows."""

    gathers = True
    names = NAMES

    def __init__(self, message: str) -> None:
        self._message = message

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if lines are such messages with accelerations in them."""
        found = {
            said[1]
            for line in lines
            if (said := _MESSAGE.search(line)) is not None
            and any(one.of(FORCE) for one in _samples(said[1], said[2]))
        }
        # of the same values, RAW are those that nothing was averaged of
        return cls("RAW" if "RAW" in found else "MEAS") if found else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        pairs = NearestLines(len(RATE) + 1)
        wraps, newest = 0, 0

        def seconds(ticks: int) -> float:
            nonlocal wraps, newest
            if self._message == "RAW":
                wraps += ticks < newest - 2 ** (BITS - 1)
                newest = ticks
            return float(ticks + wraps * SPAN) * TICKS[self._message]

        def read(lines: Sequence[str]) -> list[str]:
            found = [] if lines else pairs.rest()
            for line in lines:
                said = _MESSAGE.search(line)
                if said is None or said[1] != self._message:
                    continue
                for one in _samples(said[1], said[2]):
                    t = seconds(one.ticks)
                    if rates := one.of(RATE):
                        warm = one.of([WARM]) or [""]
                        found += pairs.rate(t, rates + warm)
                    if forces := one.of(FORCE):
                        found += pairs.force(t, [f"{t:.9f}", *forces])
            return [",".join(row) for row in found]

        return read


def _samples(message: str, text: str) -> Iterator[UbxSample]:
    """Samples of a message, whose values of one time follow each other."""
    numbered: dict[str, dict[str, int]] = {}
    fields = {}
    for name, number, value in _FIELD.findall(text):
        if number:
            numbered.setdefault(number, {})[name] = int(value)
        else:
            fields[name] = int(value)
    whole = [
        (one.get("sTtag", -1) if message == "RAW" else fields.get("timeTag", -1), one)
        for one in numbered.values()
        if {"dataField", "dataType"} <= one.keys()
    ]
    for ticks, some in groupby(whole, key=lambda pair: pair[0]):
        values = {
            one["dataType"]: _signed(one["dataField"]) * SCALES[one["dataType"]]
            for _, one in some
            if one["dataType"] in SCALES
        }
        if ticks >= 0:
            yield UbxSample(ticks, values)


def _signed(field: int) -> int:
    """A number of 24 bits with its sign.

    >>> _signed(16776523), _signed(576)
    (-693, 576)
    """
    return field - 2**BITS if field >= 2 ** (BITS - 1) else field
