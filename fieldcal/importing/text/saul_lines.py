r"""What the sensor shell of RIOT prints: a line for each axis of a device.

    > saul read all
    Reading from #4 (lsm6dsl|SENSE_ACCEL)
    Data:\t[0]     12 mg
    \t[1]    -34 mg
    \t[2]    999 mg

Older releases print ``[0] 12mg``, newer ones ``mgₙ``; pyterm writes the time before
each line. What is read until a device comes again is one row, of the time of its first
line.
Source: RIOT, sys/phydat/phydat_str.c and sys/shell/cmds/saul.c.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Self

from fieldcal.importing.text.log_prefixes import TIME
from fieldcal.importing.text.repeated_lines import NUMBER
from fieldcal.importing.text.text_form import (
    Reader,
    TextForm,
    is_true_of_most,
    take_row,
)
from fieldcal.importing.words.sensor_words import AXES

_BEFORE = r"(?:(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[.,]\d+)(?: - [A-Z]+)? # ?)?"
_READING = re.compile(_BEFORE + r"Reading from #(\d+) \((.*)\|(\w+)\)\s*")
_VALUE = re.compile(
    _BEFORE + rf"(?:Data:)?\s*(?:\[(\d)\])?\s*({NUMBER})\s*([^\s\d][^\d]*)?"
)
_EMPTY = re.compile(_BEFORE + r"\s*")

SENSORS = {"SENSE_ACCEL": "accel", "SENSE_GYRO": "gyro", "SENSE_TEMP": "temp"}
"""Classes of devices that are read."""


class Reading(NamedTuple):
    """A value that was read.

    Attributes
    ----------
    time : at which its line came; nothing without a monitor's times
    name, value : of its column

    """

    time: str
    name: str
    value: str


class SaulLines(TextForm):
    """Devices that RIOT's shell was asked for, as rows."""

    gathers = True
    says = "its lines are those of RIOT's sensor shell"

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> Self | None:
        """The form, if most lines have it."""
        if not any(map(_READING.fullmatch, lines)):
            return None
        if not is_true_of_most(lines, _is_of_shell):
            return None
        read = [*_Shell().readings(lines)]
        columns = dict.fromkeys(one.name for one in read)
        timed = any(one.time for one in read)
        return cls([TIME] * timed + [*columns]) if columns else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        row: dict[str, str] = {}
        shell = _Shell()

        def read(lines: Sequence[str]) -> list[str]:
            found = []
            for one in shell.readings(lines):
                if one.name in row:
                    found.append(take_row(row, self.names, "\t"))
                row.setdefault(TIME, one.time)
                row[one.name] = one.value
            if not lines and row:
                found.append(take_row(row, self.names, "\t"))
            return found

        return read


class _Shell:
    """Reads values of the device that the last line named."""

    def __init__(self) -> None:
        self._device = self._sensor = ""
        self._numbers: dict[tuple[str, str], str] = {}

    def readings(self, lines: Sequence[str]) -> Iterator[Reading]:
        """Values of lines, with the names of their columns."""
        for line in lines:
            if (named := _READING.fullmatch(line)) is not None:
                number, device, kind = named.groups()[1:]
                # two of one driver have the same name
                first = self._numbers.setdefault((device, kind), number)
                self._device = device if number == first else f"{device} {number}"
                self._sensor = SENSORS.get(kind, "")
                continue
            said = _VALUE.fullmatch(line)
            if said is None or not self._sensor:
                continue
            axis = AXES[int(said[2])] if said[2] and int(said[2]) < len(AXES) else ""
            if bool(axis) == (self._sensor == "temp"):
                continue
            unit = (said[4] or "").strip()
            words = filter(None, (self._device, self._sensor, axis))
            name = " ".join(words) + (f" [{unit}]" if unit else "")
            yield Reading((said[1] or "").replace(",", "."), name, said[3])


def _is_of_shell(line: str) -> bool:
    """Whether a line names a device, holds a value of one, or nothing."""
    return any(form.fullmatch(line) for form in (_READING, _VALUE, _EMPTY))
