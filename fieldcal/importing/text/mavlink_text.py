"""Messages of MAVLink as text, as mavlogdump and pymavlink show them.

    2024-05-03 10:11:12.00: RAW_IMU {time_usec : 5020000, xacc : 3, yacc : -12, …}
    HIGHRES_IMU {time_usec : 5020000, xacc : 0.031, yacc : -0.118, …}

Of the messages of several IMUs, those of one are read. Accelerations and rates of
SCALED_IMU, 2 and 3 are mg and mrad/s, those of HIGHRES_IMU m/s^2 and rad/s; of RAW_IMU
gravity tells. Temperatures are hundredths of deg C, of which 0 is none, but deg C in
HIGHRES_IMU. Source: MAVLink, common.xml.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_top import is_number
from fieldcal.importing.words.sensor_words import AXES

SCALED, SI, UNKNOWN = ("mg", "mrad/s"), ("m/s^2", "rad/s"), ("", "")

MESSAGES = {
    "HIGHRES_IMU": SI,
    "RAW_IMU": UNKNOWN,
    "SCALED_IMU": SCALED,
    "SCALED_IMU2": SCALED,
    "SCALED_IMU3": SCALED,
}
"""Messages of an IMU, and the units of their accelerations and rates."""

TIMES = {"time_usec": 1e-6, "time_boot_ms": 1e-3}
"""Fields of their times, s in one of each."""

CENTI = 100.0
"""Hundredths in a deg C."""

_SHOWN = re.compile(r"(?:\S+ \S+: )?(?:< ?)?([A-Z][A-Z\d_]*) \{(.*)\}\s*>?\s*")
_FIELD = re.compile(r"(\w+) ?: ?([^,{}]*)")


class ShownMessage(NamedTuple):
    """A message of an IMU.

    Attributes
    ----------
    name : of the message and the number of the sensor, where it says one
    kind : of `MESSAGES`
    fields : as they are written

    """

    name: str
    kind: str
    fields: Mapping[str, str]


class MavlinkText(TextForm):
    """Of the messages of MAVLink, those of one IMU as rows."""

    gathers = True

    def __init__(self, wanted: str, kind: str, others: Sequence[str]) -> None:
        self._wanted, force, rate = wanted, *MESSAGES[kind]
        self.names = (
            "time [s]",
            *(_with_unit(f"{axis}acc", force) for axis in AXES),
            *(_with_unit(f"{axis}gyro", rate) for axis in AXES),
            "temperature [deg C]",
        )
        if others:
            self.says = (
                f"of its messages, those of {wanted} are taken, and those of"
                f" {', '.join(others)} are not: its .tlog has all of them"
            )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> MavlinkText | None:
        """The form, if most lines are messages, and some are of an IMU."""
        if not is_true_of_most(lines, lambda line: _SHOWN.fullmatch(line) is not None):
            return None
        read = [one for line in lines if (one := _message(line)) is not None]
        seen = Counter(one.name for one in read)
        if not seen:
            return None
        kinds = {one.name: one.kind for one in read}
        order = [*MESSAGES]
        first, *others = sorted(
            seen, key=lambda name: (-seen[name], order.index(kinds[name]), name)
        )
        return cls(first, kinds[first], sorted(others))

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""

        def read(lines: Sequence[str]) -> list[str]:
            found = (_message(line) for line in lines)
            return [_row(one) for one in found if one and one.name == self._wanted]

        return read


def _message(line: str) -> ShownMessage | None:
    """The message of an IMU that a line shows; None of another line.

    >>> _message("RAW_IMU {time_usec : 5, xacc : 3, id : 1}").name
    'RAW_IMU.1'
    >>> _message("ATTITUDE {time_boot_ms : 5, roll : 0.1}")
    """
    said = _SHOWN.fullmatch(line)
    if said is None or said[1] not in MESSAGES:
        return None
    fields = {name: text.strip() for name, text in _FIELD.findall(said[2])}
    own = fields.get("id", "")
    return ShownMessage(f"{said[1]}.{own}" if own else said[1], said[1], fields)


def _row(one: ShownMessage) -> str:
    """Cells of a message, in the order of the columns.

    >>> _row(_message("SCALED_IMU {time_boot_ms : 20, xacc : 3, temperature : 2512}"))
    '0.020000,3,,,,,,25.12'
    """
    fields = one.fields
    times = (
        f"{float(fields[name]) * size:.6f}"
        for name, size in TIMES.items() if is_number(fields.get(name, ""), False)
    )  # fmt: skip
    axes = [f"{axis}{sensor}" for sensor in ("acc", "gyro") for axis in AXES]
    warm = fields.get("temperature", "")
    if one.kind != "HIGHRES_IMU" and is_number(warm, False):
        warm = f"{float(warm) / CENTI:g}" if float(warm) else ""
    return ",".join([next(times, ""), *(fields.get(name, "") for name in axes), warm])


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
