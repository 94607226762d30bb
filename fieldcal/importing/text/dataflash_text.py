"""A dataflash log of ArduPilot as text.

    FMT, 131, 39, IMU, QBffffffIIfBBHH, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,…
    PARM, 1000, INS_ACCOFFS_X, 0.1
    IMU, 2018601318, 0, 0.01, 0.02, 0.03, 0.1, 0.2, -9.8, 0, 0, 38.5, …

or as mavlogdump shows it, where each message names its fields:

    2023-04-05 10:11:12.00: IMU {TimeUS : 2018601318, I : 0, GyrX : 0.01, …}

Messages are m/s^2 and rad/s. Where ``IMU`` is not logged, but ``ACC`` and ``GYR`` are,
each of the accelerometer goes with the nearest of the gyroscope. Which are, their
definitions do not say: those of all messages stand at the beginning.
Source: ArduPilot, LogStructure.h.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from fieldcal.importing.text.nearest_lines import NearestLines
from fieldcal.importing.text.text_form import Reader, TextForm, is_true_of_most
from fieldcal.importing.text.text_top import is_number, split_cells

BEGINS = 20
"""Lines before the first definition: numbers of the log, or nothing."""

TIMES = ("TimeUS", "TimeMS")
RATES = ("GyrX", "GyrY", "GyrZ")
FORCES = ("AccX", "AccY", "AccZ")
WARM = ("T", "Temp")

_DEFINED = re.compile(
    r"FMT(?:,\s*\d+,\s*\d+,| \{.*\bName :)\s*(IMU|ACC|GYR),"
    r"(?:\s*\w+,| Format : \w+, Columns :)\s*([\w, ]+)"
)

_SHOWN = re.compile(r"(?:\S+ \S+: )?([A-Z][A-Z\d]*) \{(.*)\}\s*")
"""A message with its fields, and before it the time at which it came."""

_FIELD = re.compile(r"(\w+) : ([^,{}]*)")

MESSAGES = ("IMU", "ACC", "GYR")

Defined = Mapping[str, Sequence[str]]
"""Fields of each message, of which the first is its name."""


Message = tuple[str, dict[str, str]]
"""Name of a message, and the values of its fields."""


class DataflashText(TextForm):
    """Of the messages of a dataflash log, those of the first IMU."""

    gathers = True
    says = (
        "it is the text of a dataflash log, of which the first IMU alone is read: its"
        " .bin has all of them, with what was installed"
    )

    def __init__(self, defined: Defined) -> None:
        self._defined = defined
        fields = {name for of in defined.values() for name in of}
        self._time = next(name for name in TIMES if name in fields)
        rates = (f"{name} [rad/s]" for name in RATES)
        forces = (f"{name} [m/s^2]" for name in FORCES)
        self.names = (self._time, *rates, *forces, "temperature")

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> DataflashText | None:
        """The form, if it begins with what defines messages, or messages do."""
        shown = is_true_of_most(lines, lambda line: _SHOWN.fullmatch(line) is not None)
        if not (shown or any(line.startswith("FMT,") for line in lines[:BEGINS])):
            return None
        said = [found for line in lines if (found := _DEFINED.search(line))]
        defined = {one[1]: [one[1], *split_cells(one[2], ",")] for one in said}
        for name, fields in filter(None, map(_shown_message, lines)):
            # mavlogdump may show no definitions
            defined.setdefault(name, [name, *fields])
        whole = {*defined} >= {"IMU"} or {*defined} >= {"ACC", "GYR"}
        timed = all({*TIMES} & {*fields} for fields in defined.values())
        return cls(defined) if whole and timed else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        first: dict[str, str] = {}
        wanted: list[str] = []
        pairs = NearestLines(len(RATES))

        def messages(lines: Sequence[str]) -> list[Message]:
            """Messages of the first instance, by their names and fields."""
            found = []
            for line in lines:
                message = _shown_message(line) or self._defined_message(line)
                if message is None or not self._is_whole(message):
                    continue
                mine = message[1].get("I", "")
                if first.setdefault(message[0], mine) == mine:
                    found.append(message)
            return found

        def read(lines: Sequence[str]) -> list[str]:
            said = messages(lines)
            if said and not wanted:
                all_in_one = any(name == "IMU" for name, _ in said)
                wanted.extend(["IMU"] if all_in_one else ["ACC", "GYR"])
            rows = [] if lines else [_in_order(row) for row in pairs.rest()]
            for name, one in (one for one in said if one[0] in wanted):
                if name == "IMU":
                    rows.append(self._row(one))
                    continue
                t = one.get("SampleUS", one[self._time])
                if not is_number(t, comma=False):
                    continue
                if name == "GYR":
                    both = pairs.rate(float(t), [one[n] for n in RATES])
                else:
                    both = pairs.force(float(t), [t, *(one[n] for n in FORCES)])
                rows += [_in_order(row) for row in both]
            return [",".join(row) for row in rows]

        return read

    def _is_whole(self, message: Message) -> bool:
        """Whether a message has the fields of its kind."""
        name, fields = message
        return [name, *fields] == [*self._defined.get(name, ())]

    def _defined_message(self, line: str) -> Message | None:
        """The name and fields of a message that is a row of values; None of others."""
        fields = self._defined.get(line.partition(",")[0].strip(), ())
        row = split_cells(line, ",") if fields else []
        if not fields or len(row) != len(fields):
            return None
        return row[0], dict(zip(fields[1:], row[1:], strict=True))

    def _row(self, one: Mapping[str, str]) -> list[str]:
        """Cells of a message that has all channels."""
        warm = next((one[name] for name in WARM if name in one), "")
        return [*(one.get(n, "") for n in (self._time, *RATES, *FORCES)), warm]


def _shown_message(line: str) -> Message | None:
    """The name and fields of an IMU's message that names them; None of other lines.

    >>> _shown_message("2023-04-05 10:11:12.00: ACC {TimeUS : 5, AccX : 0.1}")
    ('ACC', {'TimeUS': '5', 'AccX': '0.1'})
    >>> _shown_message("ATT {TimeUS : 5}"), _shown_message("IMU, 5, 0.1")
    (None, None)
    """
    said = _SHOWN.fullmatch(line)
    if said is None or said[1] not in MESSAGES:
        return None
    return said[1], {name: text.strip() for name, text in _FIELD.findall(said[2])}


def _in_order(row: Sequence[str]) -> list[str]:
    """Time, rates, forces and no temperature, of time, forces and rates."""
    return [row[0], *row[4:], *row[1:4], ""]
